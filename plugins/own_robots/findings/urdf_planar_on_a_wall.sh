#!/bin/sh
# A robot that slides along a wall by a planar joint does so for one of five readers; the others have it on the floor.
#
# Setting: a planar joint of a URDF, whose <axis> is the normal of the plane (wiki.ros.org/urdf/XML/joint): 1 0 0 for a
# wall, 0 0 1 for a floor. Each reader is asked how many numbers the joint takes, and where the base is at 1 m and 2 m,
# with an angle of 0 where there is one.
# Guess: three numbers everywhere, two ways and an angle, or two without the angle; the axis is followed, as that of
# other joints is; a reader without planar joints says so, as kinpy and ikpy do by an error.
# Seen, with the versions below, from the Python Package Index:
#   MuJoCo      three; along the floor, and along the wall
#   pinocchio   three (four with cosine and sine); along the floor in both cases: the axis is not looked at
#   urchin      two; along the floor in both cases
#   yourdfpy    two in `num_dofs`, of which it refuses a list: it takes one for each joint, and stays where it is
#   pybullet    two, which it takes, and stays where it is; pulled along the floor, the base slides, and its state says
#               0 and 0
# No warning anywhere. The same file, so, is a robot that climbs, one that drives, and one that stands.
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile \
    mujoco==4.0.0 pin==4.1.0 yourdfpy==0.0.60 urchin==0.0.30 pybullet==3.2.7 numpy==2.4.6 lxml==6.1.3
cat >"$folder/tried.py" <<'PYTHON'
import logging
import sys
import warnings

import mujoco
import numpy as np
import pinocchio
import pybullet
import urchin
import yourdfpy

PLANES = {"floor": "0 0 1", "wall": "1 0 0"}
logged = []


class Kept(logging.Handler):
    def emit(self, record):
        logged.append(record.getMessage())


def text(place):
    return " ".join(f"{number:g}" for number in np.round(place, 3) + 0.0)


def by_mujoco(path):
    mj = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(mj)
    data.qpos[:2] = 1, 2
    mujoco.mj_kinematics(mj, data)
    return mj.nq, data.body("base").xpos


def by_pinocchio(path):
    model = pinocchio.buildModelFromUrdf(path)
    data = model.createData()
    where = pinocchio.neutral(model)
    where[:2] = 1, 2
    pinocchio.framesForwardKinematics(model, data, where)
    return model.nv, data.oMf[model.getFrameId("base")].translation


def by_urchin(path):
    return 2, urchin.URDF.load(path).link_fk({"slide": [1, 2]}, use_names=True)["base"][:3, 3]


def by_yourdfpy(path):
    robot = yourdfpy.URDF.load(path)
    try:
        robot.update_cfg([1, 2])
        taken = ""
    except ValueError:
        robot.update_cfg([1])
        taken = " of which it takes 1"
    return f"{robot.num_dofs}{taken}", robot.get_transform("base", "room")[:3, 3]


def by_pybullet(path):
    robot = pybullet.loadURDF(path, useFixedBase=True)
    assert pybullet.getJointInfo(robot, 0)[2] == pybullet.JOINT_PLANAR
    pybullet.resetJointStateMultiDof(robot, 0, [1, 2])
    count = len(pybullet.getJointStateMultiDof(robot, 0)[0])
    return count, pybullet.getLinkState(robot, 0, computeForwardKinematics=True)[4]


logging.getLogger().addHandler(Kept())
pybullet.connect(pybullet.DIRECT)
with warnings.catch_warnings(record=True) as noticed, open(sys.argv[1] + "/seen", "w") as seen:
    warnings.simplefilter("always")
    for plane, axis in PLANES.items():
        path = f"{sys.argv[1]}/{plane}.urdf"
        with open(path, "w") as file:
            file.write('<robot name="one"><link name="room"/><link name="base"><inertial><mass value="1"/>')
            file.write('<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>')
            file.write('<joint name="slide" type="planar"><parent link="room"/><child link="base"/>')
            file.write(f'<axis xyz="{axis}"/></joint></robot>')
        for told in (by_mujoco, by_pinocchio, by_urchin, by_yourdfpy, by_pybullet):
            count, place = told(path)
            print(f"{plane}, {told.__name__[3:]}: {count}, at {text(place)}", file=seen)
    pybullet.setGravity(3, 0, 0)
    for _ in range(240):
        pybullet.stepSimulation()
    robot = 0  # the one on the floor
    assert pybullet.getLinkState(robot, 0, computeForwardKinematics=True)[4][0] > 1
    state = pybullet.getJointStateMultiDof(robot, 0)[0]
    print(f"pulled along the floor by 1 m and more, pybullet: state {text(state)}", file=seen)
    words = logged + [str(each.message) for each in noticed]
    print(f"{sum('planar' in each.lower() or 'axis' in each.lower() for each in words)} warnings of it", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
floor, mujoco: 3, at 1 2 0
floor, pinocchio: 3, at 1 2 0
floor, urchin: 2, at 1 2 0
floor, yourdfpy: 2 of which it takes 1, at 0 0 0
floor, pybullet: 2, at 0 0 0
wall, mujoco: 3, at 0 2 -1
wall, pinocchio: 3, at 1 2 0
wall, urchin: 2, at 1 2 0
wall, yourdfpy: 2 of which it takes 1, at 0 0 0
wall, pybullet: 2, at 0 0 0
pulled along the floor by 1 m and more, pybullet: state 0 0
0 warnings of it
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
