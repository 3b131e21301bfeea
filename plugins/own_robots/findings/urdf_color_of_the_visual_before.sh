#!/bin/sh
# A part of a robot without a color takes that of the part before it in the same link, in MuJoCo.
#
# Setting: a link of a URDF with three visuals: a red one, one without `<material>`, and a blue one; and a second link
# with a visual without `<material>`.
# Guess: what has no color gets the reader's default.
# Seen, with the versions below, from the Python Package Index:
#   MuJoCo     the second visual is red, as the one before it; in the second link it is gray, the default
#   yourdfpy   the second visual has no material
# Whoever changes the order of two visuals in a file so paints a hand in the color of a boot.
# Fails if one of these changes. Needs Python 3.11 and some 30 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0 yourdfpy==0.0.60 numpy==2.4.6 lxml==6.1.3
cat >"$folder/tried.py" <<'PYTHON'
import sys

import mujoco
import yourdfpy

folder = sys.argv[1]


def visual(color=""):
    material = f'<material name="{color}"><color rgba="{color}"/></material>' if color else ""
    return f'<visual><geometry><sphere radius="0.1"/></geometry>{material}</visual>'


urdf = (
    '<robot name="doll"><mujoco><compiler discardvisual="false" fusestatic="false"/></mujoco><link name="body">'
    + visual("1 0 0 1")
    + visual()
    + visual("0 0 1 1")
    + '</link><link name="head">'
    + visual()
    + "</link>"
    '<joint name="neck" type="fixed"><parent link="body"/><child link="head"/></joint></robot>'
)
with open(folder + "/doll.urdf", "w") as file:
    file.write(urdf)
with open(folder + "/seen", "w") as seen:
    mj = mujoco.MjModel.from_xml_string(urdf)
    colors = [" ".join(f"{each:g}" for each in color) for color in mj.geom_rgba]
    print("MuJoCo:", ", ".join(colors), file=seen)
    links = yourdfpy.URDF.load(folder + "/doll.urdf").robot.links
    found = [each.material and each.material.name for link in links for each in link.visuals]
    print("yourdfpy:", ", ".join(map(str, found)), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
MuJoCo: 1 0 0 1, 1 0 0 1, 0 0 1 1, 0.5 0.5 0.5 1
yourdfpy: 1 0 0 1, None, 0 0 1 1, None
TEXT
"$folder/venv/bin/python" -W ignore "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
