#!/bin/sh
# The same list of five angles lifts a robot's left arm, its right arm or its head, by who reads its URDF.
#
# Setting: a torso with a right arm, a left arm and a head, in this order in the file; each arm has a wrist. Six readers
# name the joints in the order in which they take and give angles.
# Guess: the file's order, or that of a walk through the tree with branches as in the file; for a single arm, as most
# examples are, these are the same.
# Seen, with the versions below, from the Python Package Index, four orders:
#   yourdfpy, urchin   the file's: both shoulders and the head, then the wrists
#   MuJoCo, pybullet   arm by arm, with branches as in the file: right, left, head
#   pinocchio          arm by arm, with branches in the order of the alphabet: left, head, right; urdfdom keeps joints
#                      in a map by name, so that a joint that is renamed changes the places of others
#   iDynTree           neither: head, left shoulder, right shoulder, right wrist, left wrist
# A pose that one of them recorded without names is another pose for the next one, of as many numbers.
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile \
    mujoco==4.0.0 pin==4.1.0 yourdfpy==0.0.60 urchin==0.0.30 pybullet==3.2.7 idyntree==15.1.0 numpy==2.4.6 lxml==6.1.3
cat >"$folder/tried.py" <<'PYTHON'
import sys

import idyntree.bindings
import mujoco
import pinocchio
import pybullet
import urchin
import yourdfpy

LINKS = ("torso", "right_arm", "left_arm", "head", "right_hand", "left_hand")
JOINTS = {
    "right_shoulder": ("torso", "right_arm"),
    "left_shoulder": ("torso", "left_arm"),
    "neck": ("torso", "head"),
    "right_wrist": ("right_arm", "right_hand"),
    "left_wrist": ("left_arm", "left_hand"),
}
INERTIA = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
path = sys.argv[1] + "/two_arms.urdf"
with open(path, "w") as file:
    print('<robot name="two_arms">', file=file)
    for link in LINKS:
        print(f'<link name="{link}">{INERTIA}</link>', file=file)
    for joint, (parent, child) in JOINTS.items():
        print(f'<joint name="{joint}" type="revolute"><parent link="{parent}"/><child link="{child}"/>', file=file)
        print('<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>', file=file)
    print("</robot>", file=file)

mj = mujoco.MjModel.from_xml_path(path)
loader = idyntree.bindings.ModelLoader()
assert loader.loadModelFromFile(path)
tree = loader.model()
pybullet.connect(pybullet.DIRECT)
body = pybullet.loadURDF(path)
orders = {
    "yourdfpy": yourdfpy.URDF.load(path).actuated_joint_names,
    "urchin": [joint.name for joint in urchin.URDF.load(path).actuated_joints],
    "mujoco": [mj.joint(number).name for number in range(mj.njnt)],
    "pybullet": [pybullet.getJointInfo(body, number)[1].decode() for number in range(pybullet.getNumJoints(body))],
    "pinocchio": list(pinocchio.buildModelFromUrdf(path).names)[1:],
    "idyntree": [tree.getJointName(number) for number in range(tree.getNrOfDOFs())],
}
with open(sys.argv[1] + "/seen", "w") as seen:
    for reader, order in orders.items():
        print(f"{reader}: {' '.join(order)}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
yourdfpy: right_shoulder left_shoulder neck right_wrist left_wrist
urchin: right_shoulder left_shoulder neck right_wrist left_wrist
mujoco: right_shoulder right_wrist left_shoulder left_wrist neck
pybullet: right_shoulder right_wrist left_shoulder left_wrist neck
pinocchio: left_shoulder left_wrist neck right_shoulder right_wrist
idyntree: neck left_shoulder right_shoulder right_wrist left_wrist
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
