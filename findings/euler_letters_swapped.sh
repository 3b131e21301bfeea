#!/bin/sh
# "xyz" turns about the body's own axes for MuJoCo and about fixed ones for SciPy, and "XYZ" the other way round.
#
# Setting: two libraries that meet in every simulated robot take three angles and a text such as "xyz" for the order of
# axes, and small and capital letters for the two ways to go on: about the axes that have turned, or about those at
# rest. A hand is turned by 90 degrees about x, and then by 90 about y.
# Guess: the letters mean the same in both, as the texts look the same and both are given in this order.
# Seen, with the versions below, from the Python Package Index: they mean the opposite, as the comment on
# mju_euler2Quat in mujoco.h ("lower/upper-case mean intrinsic/extrinsic") and the page of Rotation.from_euler of SciPy
# say, each for itself. No error, and no difference where only one angle is not 0. So the fingers, along x, point
#   MuJoCo xyz, SciPy XYZ                      along y
#   MuJoCo XYZ, SciPy xyz                      along -z
# and an MJCF without eulerseq, whose default is xyz, has euler="90 90 0" along y, which SciPy names XYZ; a URDF with
# the same three numbers, rpy, is read along -z by the same MuJoCo.
# Fails if one of these changes. Needs Python 3.11 and some 30 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0 scipy==1.17.1 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

RIGHT = np.pi / 2
MJCF = """<mujoco><worldbody><body name="hand" euler="90 90 0"><geom size="1"/><joint/></body></worldbody></mujoco>"""
URDF = """<robot name="one"><link name="world"/><link name="hand"><inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="wrist" type="continuous"><parent link="world"/><child link="hand"/><axis xyz="0 0 1"/>
  <origin rpy="1.5707963267948966 1.5707963267948966 0"/></joint></robot>"""


def told(turn):
    """Name the axis that the fingers point along."""
    x, y, z = np.round(turn.apply([1, 0, 0])).astype(int)
    return {(0, 1, 0): "along y", (0, 0, -1): "along -z"}[x, y, z]


with open(sys.argv[1] + "/seen", "w") as seen:
    for letters in ("xyz", "XYZ"):
        found = np.zeros(4)
        mujoco.mju_euler2Quat(found, [RIGHT, RIGHT, 0], letters)
        print(f"mujoco {letters}: {told(Rotation.from_quat(found, scalar_first=True))}", file=seen)
        print(f"scipy {letters}: {told(Rotation.from_euler(letters, [RIGHT, RIGHT, 0]))}", file=seen)
    for name, xml in (("MJCF", MJCF), ("URDF", URDF)):
        found = mujoco.MjModel.from_xml_string(xml).body("hand").quat
        print(f"mujoco's {name}: {told(Rotation.from_quat(found, scalar_first=True))}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
mujoco xyz: along y
scipy xyz: along -z
mujoco XYZ: along -z
scipy XYZ: along y
mujoco's MJCF: along y
mujoco's URDF: along -z
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
