#!/bin/sh
# MuJoCo compiles a model with the former mesh when the mesh's file was written again within the same second.
#
# Setting: a program that looks for the shape of a part writes a mesh, loads the model that names it, measures its mass,
# and does so again with the next shape, some times a second.
# Guess: each model has the mesh that its file holds when it is loaded; file systems keep times in nanoseconds, and a
# cache that decides by contents or by these times sees the change.
# Seen, with mujoco 4.0.0 from the Python Package Index: a cache of compiled meshes, shared by the whole process, goes
# by the path and by the time of the file in whole seconds. A cube of twice the size that is written half a second after
# the first one is compiled as the first one, with an eighth of its mass and no warning; with a time one second later it
# has its own. After mj_clearCache it has its own, too. Meshes that are given as bytes (assets) always have their own.
# Fails if one of these changes. Needs Python 3.11 and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import os
import sys
from itertools import product
from pathlib import Path

import mujoco

FACES = "132 243 576 678 152 256 347 487 135 375 264 468"
MODEL = (
    '<mujoco><asset><mesh name="part" file="part.obj"/></asset>'
    '<worldbody><body><freejoint/><geom type="mesh" mesh="part"/></body></worldbody></mujoco>'
)
model, mesh = (Path(sys.argv[1], name) for name in ("model.xml", "part.obj"))
model.write_text(MODEL)


def cube(side):
    corners = [f"v {x * side} {y * side} {z * side}" for x, y, z in product((0, 1), repeat=3)]
    return "\n".join([*corners, *(f"f {' '.join(each)}" for each in FACES.split())]) + "\n"


def mass(side, written):
    """Return the mass in kg of a cube whose file was written at a time in ms."""
    mesh.write_text(cube(side))
    os.utime(mesh, ns=(written * 1_000_000, written * 1_000_000))
    return round(mujoco.MjModel.from_xml_path(str(model)).body_mass[1])


print("first", mass(1, 1_700_000_000_200))
print("half a second later", mass(2, 1_700_000_000_700))
print("a second later", mass(2, 1_700_000_001_700))
print("back in that second", mass(3, 1_700_000_001_900))
mujoco.mj_clearCache(mujoco.mj_getCache())
print("with an empty cache", mass(3, 1_700_000_001_900))
for side in (1, 2):
    given = mujoco.MjModel.from_xml_string(MODEL, {"part.obj": cube(side).encode()})
    print("given as bytes", round(given.body_mass[1]))
PYTHON
cat >"$folder/expected" <<'EXPECTED'
first 1000
half a second later 1000
a second later 8000
back in that second 8000
with an empty cache 27000
given as bytes 1000
given as bytes 8000
EXPECTED
"$folder/venv/bin/python" "$folder/tried.py" "$folder" >"$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
