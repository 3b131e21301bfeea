#!/bin/sh
# A joint with effort="0", as CAD programs export it, is paralyzed for one reader and stronger than all for another.
#
# Setting: `<limit effort="0" velocity="0" .../>` is what an exporter fills in where nobody has entered a figure. Beside
# it is a joint of effort="2".
# Guess: everybody takes 0 for 0, and such a robot simply does not move; or all for "unknown".
# Seen, with the versions below, from the Python Package Index:
#   pinocchio   effort limits 0 and 2; velocity limits 0 and 3
#   MuJoCo      `jnt_actfrcrange` of 0 to 0, and `jnt_actfrclimited` false: a motor of 100 Nm on this joint acts with
#               100, on the joint beside it with 2
# A robot that is planned with the one and simulated with the other may do nothing there, and anything here.
# Fails if one of these changes. Needs Python 3.11 and some 40 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0 pin==4.1.0 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys

import mujoco
import pinocchio

INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def joint(name, parent, child, effort, velocity):
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="{effort}" velocity="{velocity}"/></joint>'
    )


urdf = (
    '<robot name="arm">'
    + "".join(f'<link name="{name}">{INERTIAL}</link>' for name in ("base", "upper", "lower"))
    + joint("exported", "base", "upper", 0, 0)
    + joint("entered", "upper", "lower", 2, 3)
    + "</robot>"
)
with open(sys.argv[1] + "/seen", "w") as seen:
    model = pinocchio.buildModelFromXML(urdf)
    print("pinocchio effort", *(f"{each:g}" for each in model.upperEffortLimit), file=seen)
    print("pinocchio velocity", *(f"{each:g}" for each in model.upperVelocityLimit), file=seen)
    spec = mujoco.MjSpec.from_string(urdf)
    for name in ("exported", "entered"):
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gainprm[0] = 1.0
    mj = spec.compile()
    data = mujoco.MjData(mj)
    data.ctrl[:] = 100.0
    mujoco.mj_forward(mj, data)
    print("MuJoCo ranges", *(f"{each:g}" for each in mj.jnt_actfrcrange.ravel()), file=seen)
    print("MuJoCo limited", *(bool(each) for each in mj.jnt_actfrclimited), file=seen)
    print("MuJoCo acts with", *(f"{each:g}" for each in data.qfrc_actuator), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
pinocchio effort 0 2
pinocchio velocity 0 3
MuJoCo ranges 0 0 -2 2
MuJoCo limited False True
MuJoCo acts with 100 2
TEXT
"$folder/venv/bin/python" -W ignore "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
