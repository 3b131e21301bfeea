#!/bin/sh
# Pinocchio's reader of MJCF leaves out the bodies that stand in a <frame>, and says nothing: half an arm is missing.
#
# Setting: MJCF's <frame> places what stands in it, and is itself no part of the model. An upper arm of 2 kg carries a
# frame, which turns a lower arm of 1 kg. Three readers get the same file.
# Guess: the frame is applied, as by MuJoCo; or there is an error, as a part of the format that is not known.
# Seen, with the versions below, from the Python Package Index:
#   MuJoCo      two joints, 3 kg
#   pinocchio   one joint, 2 kg: half an arm, without a word
#   dm_control  KeyError: "Line 1: error while parsing element <frame>: 'frame'"
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0 pin==4.1.0 dm_control==1.0.50 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import os
import sys

os.environ["MUJOCO_GL"] = "disable"
import mujoco
import pinocchio
from dm_control import mjcf

XML = """<mujoco><worldbody><body name="upper"><joint name="shoulder" axis="0 1 0"/><geom size="0.1" mass="2"/>
  <frame pos="0 0 0.5" euler="0 0 90"><body name="lower"><joint name="elbow" axis="0 1 0"/><geom size="0.1" mass="1"/>
  </body></frame></body></worldbody></mujoco>"""
PATH = sys.argv[1] + "/arm.xml"
with open(PATH, "w") as file:
    file.write(XML)
with open(sys.argv[1] + "/seen", "w") as seen, open(sys.argv[1] + "/said", "w") as said:
    mj = mujoco.MjModel.from_xml_path(PATH)
    print(f"MuJoCo: {mj.njnt} joints, {mj.body_mass.sum():.0f} kg", file=seen)
    before = os.dup(1), os.dup(2)
    os.dup2(said.fileno(), 1), os.dup2(said.fileno(), 2)
    model = pinocchio.buildModelFromMJCF(PATH)
    os.dup2(before[0], 1), os.dup2(before[1], 2)
    kilograms = pinocchio.computeTotalMass(model)
    print(f"pinocchio: {model.njoints - 1} joint, {kilograms:.0f} kg", file=seen)
    print(f"pinocchio says {os.path.getsize(sys.argv[1] + '/said')} bytes", file=seen)
    try:
        print(f"dm_control: {len(mjcf.from_xml_string(XML).find_all('joint'))} joints", file=seen)
    except KeyError as error:
        print(f"dm_control: KeyError: {error.args[0].partition(':')[2].strip()}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
MuJoCo: 2 joints, 3 kg
pinocchio: 1 joint, 2 kg
pinocchio says 0 bytes
dm_control: KeyError: error while parsing element <frame>: 'frame'
TEXT
"$folder/venv/bin/python" -W ignore "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
