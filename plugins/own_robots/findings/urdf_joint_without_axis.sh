#!/bin/sh
# A joint of a URDF that names no axis turns about x in six readers, and about z in a seventh.
#
# Setting: an arm that turns on a base by a revolute joint without an <axis>, as files written by hand have it. The
# format's page gives a default, (1, 0, 0) (wiki.ros.org/urdf/XML/joint). Each reader is asked how the arm is turned at
# 0.5 rad.
# Guess: all take the default, but for MuJoCo, whose own files have z as the default of an axis.
# Seen, with the versions below, from the Python Package Index: MuJoCo takes x in a URDF, as pinocchio, pybullet,
# yourdfpy, urchin and ikpy do. kinpy turns the arm about z: its parser leaves the axis empty, and a joint without one
# turns about (0, 0, 1) (kinpy/frame.py). pybullet alone warns.
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile yourdfpy==0.0.60 pin==4.1.0 mujoco==4.0.0 urchin==0.0.30 \
    ikpy==4.2.1 kinpy==0.6.1 pybullet==3.2.7 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys
import warnings

import numpy as np

warnings.simplefilter("ignore")
PATH = sys.argv[1] + "/robot.urdf"
BODY = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
XML = f"""<robot name="arm"><link name="base">{BODY}</link><link name="arm">{BODY}</link>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
AT = {"turn": 0.5}
with open(PATH, "w") as file:
    file.write(XML)


def mujoco():
    import mujoco

    model = mujoco.MjModel.from_xml_path(PATH)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.5
    mujoco.mj_kinematics(model, data)
    return data.xmat[-1].reshape(3, 3)


def pinocchio():
    import pinocchio

    model = pinocchio.buildModelFromUrdf(PATH)
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, np.array([0.5]))
    return data.oMf[model.getFrameId("arm")].rotation


def pybullet():
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    robot = pybullet.loadURDF(PATH, useFixedBase=True)
    pybullet.resetJointState(robot, 0, 0.5)
    turn = pybullet.getLinkState(robot, 0, computeForwardKinematics=True)[5]
    return np.reshape(pybullet.getMatrixFromQuaternion(turn), (3, 3))


def yourdfpy():
    import yourdfpy

    robot = yourdfpy.URDF.load(PATH)
    robot.update_cfg(AT)
    return robot.get_transform("arm", "base")[:3, :3]


def urchin():
    import urchin

    return urchin.URDF.load(PATH).link_fk(cfg=AT, link="arm")[:3, :3]


def ikpy():
    from ikpy.chain import Chain

    return Chain.from_urdf_file(PATH, base_elements=["base"]).forward_kinematics([0.0, 0.5])[:3, :3]


def kinpy():
    import kinpy

    return kinpy.build_chain_from_urdf(XML).forward_kinematics(AT)["arm"].matrix()[:3, :3]


with open(sys.argv[1] + "/seen", "w") as seen:
    for reader in (mujoco, pinocchio, pybullet, yourdfpy, urchin, ikpy, kinpy):
        turned = np.asarray(reader())
        about = "xyz"[int(np.argmax(np.diag(turned)))]  # what a turn leaves in its place is its axis
        print(f"{reader.__name__}: about {about}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
mujoco: about x
pinocchio: about x
pybullet: about x
yourdfpy: about x
urchin: about x
ikpy: about x
kinpy: about z
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
