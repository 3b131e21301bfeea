#!/bin/sh
# For pinocchio's reader of MJCF the range of a slide is in degrees, and a turn about the axis 1 1 0 is a stretch.
#
# Setting: three small models without a <compiler>, so that angles are in degrees. A lift has range="0 1", in meters as
# MuJoCo's documentation of <joint> says; a hinge has range="-90 90" ref="30"; a hand is turned by axisangle="1 1 0 90",
# whose axis MuJoCo's documentation does not ask to be of length 1.
# Guess: both read the same, as they do for ranges of hinges, Euler angles and quaternions.
# Seen, with the versions below, from the Python Package Index:
#   MuJoCo     the lift ends at 1 m; the hinge at -90 and 90 degrees, whatever its ref; the hand is turned
#   pinocchio  the lift ends at 0.0175 m, a degree in radians; the hinge at -120 and 60 degrees, as ref is taken off;
#              the rotation of the hand has the determinant 4, so that what it holds grows
# With <compiler angle="radian"/> the lift ends at 1 m for both; with an axis of length 1 the hand is the same.
# Fails if one of these changes. Needs Python 3.11 and some 40 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0 pin==4.1.0 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import math
import sys

import mujoco
import numpy as np
import pinocchio

PATH = sys.argv[1] + "/robot.xml"


def read(joint, place="", compiler=""):
    with open(PATH, "w") as file:
        file.write(f"""<mujoco>{compiler}<worldbody><body name="part" {place}><joint name="j" {joint}/>
          <geom size="0.1"/></body></worldbody></mujoco>""")
    mj = mujoco.MjModel.from_xml_path(PATH)
    state = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, state)
    yield "MuJoCo", mj.jnt_range[0], state.xmat[1].reshape(3, 3)
    model = pinocchio.buildModelFromMJCF(PATH)
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, mj.qpos0)
    limits = (model.lowerPositionLimit[0], model.upperPositionLimit[0])
    yield "pinocchio", limits, data.oMf[model.getFrameId("part")].rotation


with open(sys.argv[1] + "/seen", "w") as seen:
    for compiler in ("", '<compiler angle="radian"/>'):
        for name, (lower, upper), _ in read('type="slide" range="0 1"', compiler=compiler):
            print(f"{name}: {lower:.4f} to {upper:.4f} m{' beside radians' if compiler else ''}", file=seen)
    for name, limits, _ in read('type="hinge" range="-90 90" ref="30"'):
        print(f"{name}: {math.degrees(limits[0]):.0f} to {math.degrees(limits[1]):.0f} degrees", file=seen)
    for axis in ("1 1 0", "0 1 0"):
        for name, _, matrix in read('type="slide"', f'axisangle="{axis} 90"'):
            corner = " ".join(f"{round(value, 2) + 0.0:.2f}" for value in matrix @ (1.0, 0.0, 1.0))
            print(f"{name}, about {axis}: determinant {np.linalg.det(matrix):.2f}, 1 0 1 is at {corner}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
MuJoCo: 0.0000 to 1.0000 m
pinocchio: 0.0000 to 0.0175 m
MuJoCo: 0.0000 to 1.0000 m beside radians
pinocchio: 0.0000 to 1.0000 m beside radians
MuJoCo: -90 to 90 degrees
pinocchio: -120 to 60 degrees
MuJoCo, about 1 1 0: determinant 1.00, 1 0 1 is at 1.21 -0.21 -0.71
pinocchio, about 1 1 0: determinant 4.00, 1 0 1 is at 2.00 0.00 -1.00
MuJoCo, about 0 1 0: determinant 1.00, 1 0 1 is at 1.00 0.00 -1.00
pinocchio, about 0 1 0: determinant 1.00, 1 0 1 is at 1.00 0.00 -1.00
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
