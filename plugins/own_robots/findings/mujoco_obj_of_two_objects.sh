#!/bin/sh
# Of an OBJ file with two objects MuJoCo sees the faces of one, but the corners of both: a table top without its legs.
#
# Setting: a mesh of two tetrahedra, as a modeling program writes two parts: `o top`, corners and faces, `o leg`,
# corners and faces. The second stands 10 m beside the first.
# Guess: one mesh of eight triangles, as other readers make it; or an error that asks for one object.
# Seen, with the versions below, from the Python Package Index:
#   trimesh   8 triangles of 8 corners
#   MuJoCo    4 triangles, but 8 corners (`mesh_facenum`, `mesh_vertnum`), and the mass of one tetrahedron; no warning
# A byte order mark before the first line, as some editors write it, costs the first corner: of one tetrahedron MuJoCo
# says that it has too few, and trimesh fails by an IndexError; neither names the mark.
# Fails if one of these changes. Needs Python 3.11 and some 30 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0 trimesh==5.2.0 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys

import mujoco
import trimesh

folder = sys.argv[1]


def tetrahedron(name, x, first):
    corners = [(x, 0, 0), (x + 1, 0, 0), (x, 1, 0), (x, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    lines = [f"o {name}", *("v {} {} {}".format(*each) for each in corners)]
    return [*lines, *("f {} {} {}".format(*(first + corner for corner in face)) for face in faces)]


def compiled(name, text):
    with open(f"{folder}/{name}", "w", encoding="utf-8") as file:
        file.write(text)
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler meshdir="{folder}"/><asset><mesh name="mesh" file="{name}"/></asset>'
        '<worldbody><body><geom type="mesh" mesh="mesh"/></body></worldbody></mujoco>'
    )


both = "\n".join(tetrahedron("top", 0, 1) + tetrahedron("leg", 10, 5)) + "\n"
with open(folder + "/seen", "w") as seen:
    mj = compiled("table.obj", both)
    print(f"MuJoCo: {mj.mesh_facenum[0]} triangles, {mj.mesh_vertnum[0]} corners", file=seen)
    print(f"MuJoCo: {mj.body_mass[1] / 1000:.3f} cubic meters of water", file=seen)
    mesh = trimesh.load(folder + "/table.obj", force="mesh")
    print(f"trimesh: {len(mesh.faces)} triangles, {len(mesh.vertices)} corners", file=seen)
    try:
        mj = compiled("marked.obj", "\ufeff" + "\n".join(tetrahedron("top", 0, 1)[1:]) + "\n")
        print(f"with a mark, MuJoCo: {mj.mesh_facenum[0]} triangles, {mj.mesh_vertnum[0]} corners", file=seen)
    except ValueError as error:
        print(f"with a mark, MuJoCo: {str(error).splitlines()[0]}", file=seen)
    try:
        mesh = trimesh.load(folder + "/marked.obj", force="mesh")
        print(f"with a mark, trimesh: {len(mesh.vertices)} corners", file=seen)
    except Exception as error:
        print(f"with a mark, trimesh: {type(error).__name__}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
MuJoCo: 4 triangles, 8 corners
MuJoCo: 0.167 cubic meters of water
trimesh: 8 triangles, 8 corners
with a mark, MuJoCo: Error: at least 4 vertices required
with a mark, trimesh: IndexError
TEXT
"$folder/venv/bin/python" -W ignore "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
