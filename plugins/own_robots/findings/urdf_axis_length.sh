#!/bin/sh
# An axis of length 2 in a URDF lets four of eight readers slide a joint twice as far, and one stretches what it turns.
#
# Setting: a carriage on a rail, and an arm of 1 m that turns on it. Both joints have <axis xyz="0 0 2"/>. Each reader
# is asked where the hand is when the carriage is at 1 m and the arm at 0.5 rad.
# Guess: the axis is a direction, so all normalize it: the format's page says that the vector should be normalized
# (wiki.ros.org/urdf/XML/joint), and a reader that minds would refuse the file.
# Seen, with the versions below, from the Python Package Index: nobody refuses it or warns.
#   mujoco, pinocchio, urchin, pytransform3d   the carriage is at 1 m, the hand 1 m from its axis
#   yourdfpy, kinpy, pybullet                  the carriage is at 2 m (yourdfpy: `q * joint.axis` in urdf.py)
#   ikpy                                       the carriage is at 2 m, and the hand 1.3 m from its axis: what it turns
#                                              by is no rotation any more
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile yourdfpy==0.0.60 pin==4.1.0 mujoco==4.0.0 urchin==0.0.30 \
    ikpy==4.2.1 pytransform3d==3.17.0 kinpy==0.6.1 pybullet==3.2.7 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys
import warnings

import numpy as np

warnings.simplefilter("ignore")
PATH = sys.argv[1] + "/robot.urdf"
BODY = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
XML = '<robot name="crane">' + "".join(
    f'<link name="{name}">{BODY}</link>' for name in ("base", "carriage", "arm", "hand")
) + """
<joint name="slide" type="prismatic"><parent link="base"/><child link="carriage"/><origin xyz="0 0 0"/>
  <axis xyz="0 0 2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="turn" type="revolute"><parent link="carriage"/><child link="arm"/><origin xyz="0 0 0"/>
  <axis xyz="0 0 2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="grip" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="1 0 0"/></joint>
</robot>"""
AT = {"slide": 1.0, "turn": 0.5}
with open(PATH, "w") as file:
    file.write(XML)


def with_mujoco():
    import mujoco

    spec = mujoco.MjSpec.from_string(XML)
    spec.compiler.fusestatic = False
    model = spec.compile()
    data = mujoco.MjData(model)
    for name, value in AT.items():
        data.joint(name).qpos[0] = value
    mujoco.mj_forward(model, data)
    return data.body("hand").xpos


def with_pinocchio():
    import pinocchio

    model = pinocchio.buildModelFromXML(XML)
    data = model.createData()
    place = pinocchio.neutral(model)
    for name, value in AT.items():
        place[model.joints[model.getJointId(name)].idx_q] = value
    pinocchio.framesForwardKinematics(model, data, place)
    return data.oMf[model.getFrameId("hand")].translation


def with_urchin():
    from urchin import URDF

    places = URDF.load(PATH).link_fk(cfg=AT)
    return {link.name: place for link, place in places.items()}["hand"][:3, 3]


def with_pytransform3d():
    from pytransform3d.urdf import UrdfTransformManager

    manager = UrdfTransformManager()
    manager.load_urdf(XML)
    for name, value in AT.items():
        manager.set_joint(name, value)
    return manager.get_transform("hand", "base")[:3, 3]


def with_yourdfpy():
    from yourdfpy import URDF

    robot = URDF.load(PATH)
    robot.update_cfg(AT)
    return robot.get_transform("hand", "base")[:3, 3]


def with_kinpy():
    import kinpy

    return kinpy.build_chain_from_urdf(XML).forward_kinematics(AT)["hand"].pos


def with_pybullet():
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    body = pybullet.loadURDF(PATH, useFixedBase=True)
    joints = {pybullet.getJointInfo(body, each)[1].decode(): each for each in range(3)}
    for name, value in AT.items():
        pybullet.resetJointState(body, joints[name], value)
    place = pybullet.getLinkState(body, joints["grip"], computeForwardKinematics=True)[4]
    pybullet.disconnect()
    return place


def with_ikpy():
    from ikpy.chain import Chain

    chain = Chain.from_urdf_file(PATH, base_elements=["base"])
    return chain.forward_kinematics([AT.get(link.name, 0.0) for link in chain.links])[:3, 3]


with open(sys.argv[1] + "/seen", "w") as seen:
    for ask in (
        with_mujoco, with_pinocchio, with_urchin, with_pytransform3d,
        with_yourdfpy, with_kinpy, with_pybullet, with_ikpy,
    ):
        x, y, z = np.asarray(ask(), float)
        print(f"{ask.__name__[5:]}: carriage at {z:.2f} m, hand {np.hypot(x, y):.2f} m from its axis", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
mujoco: carriage at 1.00 m, hand 1.00 m from its axis
pinocchio: carriage at 1.00 m, hand 1.00 m from its axis
urchin: carriage at 1.00 m, hand 1.00 m from its axis
pytransform3d: carriage at 1.00 m, hand 1.00 m from its axis
yourdfpy: carriage at 2.00 m, hand 1.00 m from its axis
kinpy: carriage at 2.00 m, hand 1.00 m from its axis
pybullet: carriage at 2.00 m, hand 1.00 m from its axis
ikpy: carriage at 2.00 m, hand 1.30 m from its axis
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
