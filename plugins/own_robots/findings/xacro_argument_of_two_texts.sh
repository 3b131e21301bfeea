#!/bin/sh
# One argument of xacro has two texts: 007 is `arm_007` by $(arg id), and `arm_7` by a property that holds $(arg id).
#
# Setting: a robot's serial number, or a name such as 3e5, is an argument that becomes part of names. One file puts it
# there by $(arg id), the other by a property of that value, as most descriptions do for short names.
# Guess: arguments are text, as the command line is; numbers arise where something is calculated.
# Seen, with xacro 2.1.1 from the Python Package Index (xacro/__init__.py, `Table._eval_literal`): the value of a
# property is a number, or a boolean, wherever Python reads one without an underscore, and is written as Python does:
#   007 -> 7, 3e5 -> 300000.0, 0.10 -> 0.1, true -> True; 1_2 and 0x10 stay as they are
# So the parent of a joint is a link that is not there, and enabled="${flag}" says True, which XML's booleans have not.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile xacro==2.1.1
cat >"$folder/tried.py" <<'PYTHON'
import sys
from pathlib import Path

import xacro

SOURCE = """<robot name="robot" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="id" default=""/>
  <xacro:property name="id" value="$(arg id)"/>
  <link name="arm_$(arg id)"/>
  <link name="arm_${id}"/>
</robot>"""
path = Path(sys.argv[1], "robot.xacro")
path.write_text(SOURCE)

with open(sys.argv[1] + "/seen", "w") as seen:
    for value in ("left", "007", "3e5", "0.10", "true", "1_2", "0x10"):
        document = xacro.process_file(str(path), mappings={"id": value})
        names = [link.getAttribute("name") for link in document.getElementsByTagName("link")]
        print(value, "->", *names, file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
left -> arm_left arm_left
007 -> arm_007 arm_7
3e5 -> arm_3e5 arm_300000.0
0.10 -> arm_0.10 arm_0.1
true -> arm_true arm_True
1_2 -> arm_1_2 arm_1_2
0x10 -> arm_0x10 arm_0x10
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
