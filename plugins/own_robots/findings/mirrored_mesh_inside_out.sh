#!/bin/sh
# A mesh that a URDF mirrors is inside out for pinocchio: its volume is negative, and so is the inertia made from it.
#
# Setting: the left half of a gripper is a box of 6 liters beside the hand, an STL file. The right half is the same file
# with scale="-1 1 1", as many descriptions have it. Each reader makes the mesh of the right half.
# Guess: a mirrored box beside the other side of the hand, with the same volume; whoever mirrors corners turns faces.
# Seen, with the versions below, from the Python Package Index:
#   yourdfpy   6 liters
#   urchin     6 liters
#   MuJoCo     6 liters
#   pinocchio  -6 liters: the corners are mirrored, and the faces look inwards; mirrored twice, it is right again
# The moments of inertia that pinocchio's geometry computes of it are negative, too.
# Fails if one of these changes. Needs Python 3.11 and some 40 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile \
    mujoco==4.0.0 pin==4.1.0 trimesh==5.2.0 yourdfpy==0.0.60 urchin==0.0.30 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import os
import sys

import mujoco
import numpy as np
import pinocchio
import trimesh
import urchin
import yourdfpy

os.chdir(sys.argv[1])
box = trimesh.creation.box((0.2, 0.1, 0.3))
box.apply_translation((0.3, 0, 0))
box.export("half.stl")


def described(scale):
    mesh = f'<geometry><mesh filename="half.stl" scale="{scale}"/></geometry>'
    with open("hand.urdf", "w") as file:
        parts = f"<visual>{mesh}</visual><collision>{mesh}</collision>"
        file.write(f'<robot name="hand"><link name="half">{parts}</link></robot>')
    robot = yourdfpy.URDF.load("hand.urdf", mesh_dir=".")
    yield "yourdfpy", robot.scene.to_mesh().volume
    yield "urchin", urchin.URDF.load("hand.urdf").links[0].collision_mesh.volume
    mj = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="half" file="{os.getcwd()}/half.stl" scale="{scale}"/></asset>'
        '<worldbody><body><geom type="mesh" mesh="half"/></body></worldbody></mujoco>'
    )
    yield "MuJoCo", mj.body_mass[1] / 1000.0
    model = pinocchio.buildModelFromUrdf("hand.urdf")
    shapes = pinocchio.buildGeomFromUrdf(model, "hand.urdf", pinocchio.GeometryType.COLLISION, ["."])
    geometry = shapes.geometryObjects[0].geometry
    moments = np.diag(geometry.computeMomentofInertiaRelatedToCOM())
    yield "pinocchio, with moments of inertia below 0," if max(moments) < 0 else "pinocchio", geometry.computeVolume()


with open("seen", "w") as seen:
    for scale in ("1 1 1", "-1 1 1", "-1 -1 1"):
        for name, cubic in described(scale):
            print(f"{scale}: {name} {1000.0 * cubic:.1f} liters", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
1 1 1: yourdfpy 6.0 liters
1 1 1: urchin 6.0 liters
1 1 1: MuJoCo 6.0 liters
1 1 1: pinocchio 6.0 liters
-1 1 1: yourdfpy 6.0 liters
-1 1 1: urchin 6.0 liters
-1 1 1: MuJoCo 6.0 liters
-1 1 1: pinocchio, with moments of inertia below 0, -6.0 liters
-1 -1 1: yourdfpy 6.0 liters
-1 -1 1: urchin 6.0 liters
-1 -1 1: MuJoCo 6.0 liters
-1 -1 1: pinocchio 6.0 liters
TEXT
"$folder/venv/bin/python" -W ignore "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
