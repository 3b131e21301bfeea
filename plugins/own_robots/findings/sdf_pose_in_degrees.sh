#!/bin/sh
# For pybullet's reader of SDF 90 degrees are 90 radians, and a quaternion that turns nothing turns by 57 degrees.
#
# Setting: models of SDFormat 1.9, whose <pose> may be in degrees, and may have a quaternion (rotation_format, x y z w;
# sdf/1.9/pose.sdf of the format). A box is turned by a quarter about z in radians and in degrees, and by quaternions of
# a quarter and of no turn.
# Guess: an older reader refuses a version that it does not know, or an attribute, or warns of them.
# Seen, with the versions below, from the Python Package Index:
#   Drake      as written: yaws of 90, 90, 90 and 0 degrees
#   pybullet   90 in radians. In degrees the box stands at 117, which is 90 radians. Of a quaternion the last three
#              numbers, y, z and w, are roll, pitch and yaw: a quarter about z is 41 degrees of pitch and of yaw, and
#              0 0 0 1 is a yaw of 1 radian, 57 degrees. No error; it says for each file that there is no world in it.
# Fails if one of these changes. Needs Python 3.11 and some 80 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile drake==1.51.1 pybullet==3.2.7 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import math
import sys

import pybullet
from pydrake.math import RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

HALF = math.sqrt(0.5)
POSES = {
    "radians": f"<pose>0 0 0 0 0 {math.pi / 2}</pose>",
    "degrees": '<pose degrees="true">0 0 0 0 0 90</pose>',
    "quarter": f'<pose rotation_format="quat_xyzw">0 0 0 0 0 {HALF} {HALF}</pose>',
    "none": '<pose rotation_format="quat_xyzw">0 0 0 0 0 0 1</pose>',
}
BOX = """<link name="box"><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz><ixy>0</ixy><ixz>0</ixz>
  <iyz>0</iyz></inertia></inertial></link>"""


def by_drake(path):
    plant = MultibodyPlant(0.001)
    (model,) = Parser(plant).AddModels(path)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    (body,) = plant.GetBodyIndices(model)
    return RollPitchYaw(plant.EvalBodyPoseInWorld(context, plant.get_body(body)).rotation()).vector()


def by_pybullet(path):
    (box,) = pybullet.loadSDF(path)
    return pybullet.getEulerFromQuaternion(pybullet.getBasePositionAndOrientation(box)[1])


pybullet.connect(pybullet.DIRECT)
with open(sys.argv[1] + "/seen", "w") as seen:
    for name, pose in POSES.items():
        path = f"{sys.argv[1]}/{name}.sdf"
        with open(path, "w") as file:
            file.write(f'<sdf version="1.9"><model name="one">{pose}{BOX}</model></sdf>')
        for told in (by_drake, by_pybullet):
            roll, pitch, yaw = (abs(round(math.degrees(angle))) for angle in told(path))
            print(f"{name}, {told.__name__[3:]}: roll {roll}, pitch {pitch}, yaw {yaw}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
radians, drake: roll 0, pitch 0, yaw 90
radians, pybullet: roll 0, pitch 0, yaw 90
degrees, drake: roll 0, pitch 0, yaw 90
degrees, pybullet: roll 0, pitch 0, yaw 117
quarter, drake: roll 0, pitch 0, yaw 90
quarter, pybullet: roll 0, pitch 41, yaw 41
none, drake: roll 0, pitch 0, yaw 0
none, pybullet: roll 0, pitch 0, yaw 57
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
