#!/bin/sh
# The finger of a gripper whose limit is written as upper="0.04" has three different ranges in five readers of URDF.
#
# Setting: a prismatic joint with `<limit upper="0.04" effort="2" velocity="1"/>`. The XML specification of URDF says of
# `lower` and `upper`: optional, "defaults to 0". So the finger moves from 0 to 0.04 m.
# Guess: 0 to 0.04 everywhere, or an error.
# Seen, with the versions below, from the Python Package Index:
#   pinocchio (urdfdom)   0 to 0.04
#   MuJoCo                a range of 0 to 0.04 in `jnt_range`, but `jnt_limited` is false: the finger slides off
#   ikpy, pytransform3d   -inf to 0.04
#   yourdfpy              None to 0.04
# With lower="0" written out, all say 0 to 0.04, and MuJoCo limits the joint. With lower="0" upper="0", as exporters
# write it where nobody has entered a range, the joint is locked for pinocchio, ikpy and pytransform3d, and has no
# limits for MuJoCo.
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile \
  mujoco==4.0.0 pin==4.1.0 ikpy==4.2.1 pytransform3d==3.17.0 yourdfpy==0.0.60 numpy==2.4.6 lxml==6.1.3
cat >"$folder/tried.py" <<'PYTHON'
import sys

import ikpy.chain
import mujoco
import pinocchio
import yourdfpy
from pytransform3d.urdf import UrdfTransformManager

folder = sys.argv[1]
URDF = """<robot name="gripper">
  <link name="hand">{inertial}</link><link name="finger">{inertial}</link>
  <joint name="slide" type="prismatic">
    <parent link="hand"/><child link="finger"/><axis xyz="0 0 1"/>
    <limit {range} effort="2" velocity="1"/>
  </joint>
</robot>"""
INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def ranges(written):
    text = URDF.format(inertial=INERTIAL, range=written)
    path = folder + "/gripper.urdf"
    with open(path, "w") as file:
        file.write(text)
    model = pinocchio.buildModelFromXML(text)
    yield "pinocchio", model.lowerPositionLimit[0], model.upperPositionLimit[0]
    mj = mujoco.MjModel.from_xml_string(text)
    yield "MuJoCo", *mj.jnt_range[0], "limited" if mj.jnt_limited[0] else "not limited"
    yield "ikpy", *ikpy.chain.Chain.from_urdf_file(path, base_elements=["hand"]).links[-1].bounds
    manager = UrdfTransformManager()
    manager.load_urdf(text)
    yield "pytransform3d", *manager.get_joint_limits("slide")
    limit = yourdfpy.URDF.load(path).robot.joints[0].limit
    yield "yourdfpy", limit.lower, limit.upper


with open(folder + "/seen", "w") as seen:
    for written in ('upper="0.04"', 'lower="0" upper="0.04"', 'lower="0" upper="0"'):
        print(written, file=seen)
        for name, *found in ranges(written):
            print(" ", name, *(each if isinstance(each, str | None) else f"{each:g}" for each in found), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
upper="0.04"
  pinocchio 0 0.04
  MuJoCo 0 0.04 not limited
  ikpy -inf 0.04
  pytransform3d -inf 0.04
  yourdfpy None 0.04
lower="0" upper="0.04"
  pinocchio 0 0.04
  MuJoCo 0 0.04 limited
  ikpy 0 0.04
  pytransform3d 0 0.04
  yourdfpy 0 0.04
lower="0" upper="0"
  pinocchio 0 0
  MuJoCo 0 0 not limited
  ikpy 0 0
  pytransform3d 0 0
  yourdfpy 0 0
TEXT
"$folder/venv/bin/python" -W ignore "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
