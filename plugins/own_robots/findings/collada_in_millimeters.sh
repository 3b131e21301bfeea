#!/bin/sh
# A hand drawn in millimeters is 20 cm long in pybullet, and 200 m in three other readers of the same COLLADA file.
#
# Setting: the mesh of a hand is a COLLADA file, whose numbers go to 200 and which says <unit name="millimeter"
# meter="0.001"/>, as programs that export it write their unit there (here pycollada). A URDF names it without a scale.
# Guess: 0.2 m everywhere, since the format tells its unit for that reason, unlike STL and OBJ; who cannot follow it
# refuses the file or says so.
# Seen, with the versions below, from the Python Package Index:
#   pybullet                      0.2 m (as a box around it, with its margin of 2 mm at each end)
#   pinocchio, yourdfpy, urchin   200 m, without a word. trimesh, which reads the file for the last two, has read the
#                                 unit: it keeps "0.001 * meters" beside a mesh of 200
# A file with meter="1" is 200 m for all. Who mends a robot by scale="0.001 0.001 0.001" for one of the three, so has a
# hand of 0.2 mm in pybullet.
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile \
    pin==4.1.0 yourdfpy==0.0.60 urchin==0.0.30 pybullet==3.2.7 trimesh==5.2.0 pycollada==0.9.3 numpy==2.4.6 lxml==6.1.3
cat >"$folder/tried.py" <<'PYTHON'
import logging
import os
import sys
import warnings

import collada
import numpy as np
import pinocchio
import pybullet
import trimesh
import urchin
import yourdfpy

CORNERS = np.array([[0, 0, 0], [90, 0, 0], [0, 30, 0], [0, 0, 200]], float)
FACES = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])
URDF = """<robot name="one"><link name="hand">
  <visual><geometry><mesh filename="{name}.dae"{scale}/></geometry></visual>
  <collision><geometry><mesh filename="{name}.dae"{scale}/></geometry></collision></link></robot>"""
SMALL = ' scale="0.001 0.001 0.001"'


def draw(name, meter):
    """Write a hand as COLLADA, with a unit and z upwards."""
    drawn = collada.Collada()
    drawn.assetInfo.unitname, drawn.assetInfo.unitmeter, drawn.assetInfo.upaxis = name, meter, "Z_UP"
    corners = collada.source.FloatSource("corners", CORNERS.ravel(), ("X", "Y", "Z"))
    hand = collada.geometry.Geometry(drawn, "hand", "hand", [corners])
    inputs = collada.source.InputList()
    inputs.addInput(0, "VERTEX", "#corners")
    hand.primitives.append(hand.createTriangleSet(FACES, inputs, "plain"))
    drawn.geometries.append(hand)
    node = collada.scene.Node("one", children=[collada.scene.GeometryNode(hand)])
    drawn.scenes.append(collada.scene.Scene("all", [node]))
    drawn.scene = drawn.scenes[0]
    drawn.write(f"{name}.dae")


def by_pybullet(path):
    low, high = pybullet.getAABB(pybullet.loadURDF(path))
    return high[2] - low[2] - 0.004  # the margins


def by_pinocchio(path):
    model = pinocchio.buildModelFromUrdf(path)
    parts = pinocchio.buildGeomFromUrdf(model, path, pinocchio.GeometryType.COLLISION, os.path.dirname(path))
    (part,) = parts.geometryObjects
    part.geometry.computeLocalAABB()
    return part.geometry.aabb_local.max_[2] - part.geometry.aabb_local.min_[2]


def by_yourdfpy(path):
    return yourdfpy.URDF.load(path).scene.extents[2]


def by_urchin(path):
    (visual,) = urchin.URDF.load(path).links[0].visuals
    (mesh,) = visual.geometry.meshes
    return mesh.extents[2] * (1 if visual.geometry.mesh.scale is None else visual.geometry.mesh.scale[2])


warnings.simplefilter("ignore")
logging.disable(logging.CRITICAL)
pybullet.connect(pybullet.DIRECT)
os.chdir(sys.argv[1])
with open("seen", "w") as seen:
    for name, meter, scale in (("meter", 1, ""), ("millimeter", 0.001, ""), ("millimeter", 0.001, SMALL)):
        draw(name, meter)
        path = os.path.abspath(f"{name}{len(scale)}.urdf")
        with open(path, "w") as file:
            file.write(URDF.format(name=name, scale=scale))
        for told in (by_pybullet, by_pinocchio, by_yourdfpy, by_urchin):
            print(f"{name}{scale}, {told.__name__[3:]}: {told(path):.4g} m", file=seen)
    print("trimesh keeps", trimesh.load("millimeter.dae").units, file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
meter, pybullet: 200 m
meter, pinocchio: 200 m
meter, yourdfpy: 200 m
meter, urchin: 200 m
millimeter, pybullet: 0.2 m
millimeter, pinocchio: 200 m
millimeter, yourdfpy: 200 m
millimeter, urchin: 200 m
millimeter scale="0.001 0.001 0.001", pybullet: 0.0002 m
millimeter scale="0.001 0.001 0.001", pinocchio: 0.2 m
millimeter scale="0.001 0.001 0.001", yourdfpy: 0.2 m
millimeter scale="0.001 0.001 0.001", urchin: 0.2 m
trimesh keeps 0.001 * meters
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
