#!/bin/sh
# A default value in a method of a libqi service in Python is none for its callers: they have to pass it.
#
# Setting: a service in Python, called over loopback by a second session, with a method walk(x, y=0.0) and one that
# takes the rest of its arguments by a star.
# Guess: walk(0.5) works, as methods of ALMotion have shorter forms, and the star takes what comes.
# Seen, with qi 3.1.5 from the Python Package Index: walk(0.5) is refused, "Arguments types did not match", with a
# candidate (mm), while walk(0.5, 0.1) is called. The method with a star takes one, two or no arguments.
# A number of NumPy's, though np.float64 is a float of Python, is refused by the caller's own side, as an object
# without the attribute __qi_objectuid__.
# Fails if one of these changes. Needs Python 3.11, a port of loopback and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile qi==3.1.5 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys

import numpy as np
import qi


class Motion:
    def walk(self, x, y=0.0):
        return [x, y]

    def any(self, *values):
        return list(values)


server, client = qi.Session(), qi.Session()
server.listenStandalone("tcp://127.0.0.1:0")
server.registerService("Motion", Motion())
client.connect(server.endpoints()[0])
motion = client.service("Motion")


def tried(method, *arguments):
    try:
        return method(*arguments)
    except RuntimeError as error:
        known = "Arguments types did not match", "__qi_objectuid__"
        return f"refused: {next((text for text in known if text in str(error)), str(error))}"


with open(sys.argv[1] + "/seen", "w") as seen:
    for what, found in (
        ("all given", tried(motion.walk, 0.5, 0.25)),
        ("default left out", tried(motion.walk, 0.5)),
        ("star, none", tried(motion.any)),
        ("star, two", tried(motion.any, 0.5, 0.25)),
        ("NumPy's float", tried(motion.walk, np.float64(0.5), 0.25)),
        ("is it a float", isinstance(np.float64(0.5), float)),
    ):
        print(f"{what}: {found}", file=seen)
client.close()
server.close()
PYTHON
cat >"$folder/expected" <<'TEXT'
all given: [0.5, 0.25]
default left out: refused: Arguments types did not match
star, none: []
star, two: [0.5, 0.25]
NumPy's float: refused: __qi_objectuid__
is it a float: True
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
