#!/bin/sh
# None of four URDF readers follows a joint that mimics one that mimics a third, and only an option makes one say so.
#
# Setting: three slides in a row, along x, y and z. The second mimics the first, times 2 plus 0.1 m, and the third
# mimics the second in the same way. The first is set to 1 m; so the second is at 2.1 m and the third at 4.3 m by the
# rule of the format's page, value = multiplier * other_joint_value + offset (wiki.ros.org/urdf/XML/joint).
# Guess: a reader with mimic joints follows the row, or refuses it; one without them says so.
# Seen, with the versions below, from the Python Package Index:
#   yourdfpy               the third is at its offset alone; a line in the log, nothing in the result
#   urchin                 the third does not move, and has not even its offset; no word
#   pinocchio              neither mimics, without a word: three free joints, unless mimic=True is given
#   pinocchio, mimic=True  ValueError: a mimic of a mimic is refused
#   kinpy                  neither mimics, without a word
# Fails if one of these changes. Needs Python 3.11 and some 40 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile yourdfpy==0.0.60 pin==4.1.0 urchin==0.0.30 kinpy==0.6.1 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import logging
import sys
import warnings

warnings.simplefilter("ignore")
logging.disable(logging.CRITICAL)
PATH = sys.argv[1] + "/robot.urdf"
BODY = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
LINKS = ("palm", "first", "second", "third")
AXES = ("1 0 0", "0 1 0", "0 0 1")


def joint(number):
    name, other = f"j{number}", f"j{number - 1}"
    mimic = f'<mimic joint="{other}" multiplier="2" offset="0.1"/>' if number else ""
    return f"""<joint name="{name}" type="prismatic"><parent link="{LINKS[number]}"/>
      <child link="{LINKS[number + 1]}"/><origin xyz="0 0 0"/><axis xyz="{AXES[number]}"/>{mimic}
      <limit lower="0" upper="5" effort="1" velocity="1"/></joint>"""


XML = '<robot name="gripper">' + "".join(f'<link name="{name}">{BODY}</link>' for name in LINKS)
XML += "".join(map(joint, range(3))) + "</robot>"
with open(PATH, "w") as file:
    file.write(XML)


def with_yourdfpy():
    from yourdfpy import URDF

    robot = URDF.load(PATH)
    robot.update_cfg({"j0": 1.0})
    return robot.get_transform("third", "palm")[:3, 3]


def with_urchin():
    from urchin import URDF

    places = URDF.load(PATH).link_fk(cfg={"j0": 1.0})
    return {link.name: place for link, place in places.items()}["third"][:3, 3]


def with_pinocchio(**options):
    import pinocchio

    model = pinocchio.buildModelFromXML(XML, **options)
    data = model.createData()
    place = pinocchio.neutral(model)
    place[model.joints[model.getJointId("j0")].idx_q] = 1.0
    pinocchio.framesForwardKinematics(model, data, place)
    return data.oMf[model.getFrameId("third")].translation


def with_pinocchio_and_mimic():
    return with_pinocchio(mimic=True)


def with_kinpy():
    import kinpy

    return kinpy.build_chain_from_urdf(XML).forward_kinematics({"j0": 1.0, "j1": 0.0, "j2": 0.0})["third"].pos


with open(sys.argv[1] + "/seen", "w") as seen:
    for ask in (with_yourdfpy, with_urchin, with_pinocchio, with_pinocchio_and_mimic, with_kinpy):
        try:
            found = " ".join(f"{value:.1f}" for value in ask())
        except ValueError as error:
            found = type(error).__name__
        print(f"{ask.__name__[5:]}: {found}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
yourdfpy: 1.0 2.1 0.1
urchin: 1.0 2.1 0.0
pinocchio: 1.0 0.0 0.0
pinocchio_and_mimic: ValueError
kinpy: 1.0 0.0 0.0
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
