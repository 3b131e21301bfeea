#!/bin/sh
# A geom that names the class "main", where all defaults are anyway, loses them when dm_control writes the model again.
#
# Setting: the defaults of a model make geoms red, and those of a class "grip" larger. A body has the class "grip"; one
# of its geoms goes back to the outermost class, which MuJoCo calls "main" unless a model names it. dm_control reads
# the model and writes it.
# Guess: the same model; dm_control renames classes so that models can be attached, and keeps who refers to them.
# Seen, with the versions below, from the Python Package Index:
#   MuJoCo, the model              both geoms are red
#   MuJoCo, what dm_control wrote  the one of "main" is gray and of another mass: the defaults have the class "/" now,
#                                  and "main" is one without any
# No error, and no warning.
# Fails if one of these changes. Needs Python 3.11 and some 40 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0 dm_control==1.0.50 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import os
import sys
import warnings

os.environ["MUJOCO_GL"] = "disable"
import mujoco
from dm_control import mjcf

XML = """<mujoco><default><geom rgba="1 0 0 1" mass="3"/><default class="grip"><geom size="0.3"/></default></default>
  <worldbody><body childclass="grip"><joint/><geom/><geom class="main" size="0.1"/></body></worldbody></mujoco>"""


def told(name, xml, seen):
    mj = mujoco.MjModel.from_xml_string(xml)
    for number, word in enumerate(("grip", "main")):
        red, green, blue, _ = mj.geom_rgba[number]
        color = "red" if (red, green, blue) == (1, 0, 0) else f"{red} {green} {blue}"
        print(f"{name}: {word} is {color}", file=seen)
    print(f"{name}: {mj.body_mass[1]:.2f} kg", file=seen)


with warnings.catch_warnings(record=True) as noticed, open(sys.argv[1] + "/seen", "w") as seen:
    warnings.simplefilter("always")
    told("read", XML, seen)
    written = mjcf.from_xml_string(XML).to_xml_string()
    told("written", written, seen)
    print('class="main"' in written, '<default class="/">' in written, file=seen)
    print(f"{sum('main' in str(each.message) for each in noticed)} warnings of it", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
read: grip is red
read: main is red
read: 6.00 kg
written: grip is red
written: main is 0.5 0.5 0.5
written: 7.19 kg
True True
0 warnings of it
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
