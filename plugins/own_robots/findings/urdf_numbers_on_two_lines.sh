#!/bin/sh
# Three numbers of a URDF on two lines are no numbers for ROS: its reader refuses what all others read.
#
# Setting: `xyz="1 2` and, on the next line, `3"`, as an editor wraps a long line; or a tab between the numbers. XML
# says that a line break or a tab in an attribute is a space before a program gets to see it (section 3.3.3).
# Guess: nobody notices.
# Seen, with the versions below, from the Python Package Index:
#   MuJoCo, yourdfpy, ikpy     read 1, 2, 3
#   pinocchio (urdfdom 4)      refuses the file: "Unable to parse component [2\n3] to a double". TinyXML leaves the line
#                              break in the attribute, and urdfdom splits at spaces alone
# The error names a line of urdfdom's source, not of the file.
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile \
  mujoco==4.0.0 pin==4.1.0 ikpy==4.2.1 yourdfpy==0.0.60 numpy==2.4.6 lxml==6.1.3
cat >"$folder/tried.py" <<'PYTHON'
import sys

import ikpy.chain
import mujoco
import pinocchio
import yourdfpy

folder = sys.argv[1]
INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
)
URDF = f"""<robot name="arm">
  <link name="base">{INERTIAL}</link><link name="arm">{INERTIAL}</link>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="arm"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="2" velocity="1"/>
    <origin xyz="1 2%s3"/>
  </joint>
</robot>"""


def places(written):
    text, path = URDF % written, folder + "/arm.urdf"
    with open(path, "w") as file:
        file.write(text)
    yield "MuJoCo", mujoco.MjModel.from_xml_string(text).body_pos[-1]
    yield "yourdfpy", yourdfpy.URDF.load(path).robot.joints[0].origin[:3, 3]
    chain = ikpy.chain.Chain.from_urdf_file(path, base_elements=["base"])
    yield "ikpy", chain.forward_kinematics([0.0] * len(chain.links))[:3, 3]
    try:
        yield "pinocchio", pinocchio.buildModelFromXML(text).jointPlacements[1].translation
    except ValueError:
        yield "pinocchio", None


with open(folder + "/seen", "w") as seen:
    for name, written in (("space", " "), ("line break", "\n    "), ("tab", "\t")):
        for reader, place in places(written):
            found = "refuses it" if place is None else " ".join(f"{each:g}" for each in place)
            print(f"{name}: {reader} {found}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
space: MuJoCo 1 2 3
space: yourdfpy 1 2 3
space: ikpy 1 2 3
space: pinocchio 1 2 3
line break: MuJoCo 1 2 3
line break: yourdfpy 1 2 3
line break: ikpy 1 2 3
line break: pinocchio refuses it
tab: MuJoCo 1 2 3
tab: yourdfpy 1 2 3
tab: ikpy 1 2 3
tab: pinocchio refuses it
TEXT
"$folder/venv/bin/python" -W ignore "$folder/tried.py" "$folder" 2>"$folder/errors" || { cat "$folder/errors"; exit 1; }
cat "$folder/seen"
grep -q "Unable to parse component" "$folder/errors"
diff "$folder/expected" "$folder/seen"
echo "as found"
