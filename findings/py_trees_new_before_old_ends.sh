#!/bin/sh
# Where a branch of higher priority takes over in py_trees, it drives before the one that it interrupts has stopped.
#
# Setting: a selector of a patrol and, before it, a flight that begins when something is seen. Both write down when
# they begin (`initialise`), drive (`update`) and stop (`terminate`, where behaviors let go of what they hold).
# Guess: the patrol ends first, then the flight begins, as in every state machine: exit, then entry.
# Seen, with py_trees 2.6.0 from the Python Package Index (py_trees/composites.py, Selector.tick): the flight begins and
# drives, and the patrol stops after that, in the same tick. A `terminate` that stops the motors so stops those of
# its successor; nothing stops them if the flight sends its command once, in `initialise`.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile py_trees==2.6.0
cat >"$folder/tried.py" <<'PYTHON'
import sys

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

speed = 0.0
seen = False
out = open(sys.argv[1] + "/seen", "w")


class Drives(Behaviour):
    def __init__(self, name, fast):
        super().__init__(name)
        self.fast = fast

    def initialise(self):
        global speed
        speed = self.fast
        print(f"{self.name} begins", file=out)

    def update(self):
        print(f"{self.name} drives", file=out)
        return Status.RUNNING

    def terminate(self, new_status):
        global speed
        speed = 0.0
        print(f"{self.name} stops the motors", file=out)


class Sees(Behaviour):
    def update(self):
        return Status.SUCCESS if seen else Status.FAILURE


flight = Sequence("flight", memory=False, children=[Sees("sees"), Drives("flight", 1.0)])
root = Selector("root", memory=False, children=[flight, Drives("patrol", 0.2)])
for seen in (False, True):
    root.tick_once()
    print(f"speed {speed}", file=out)
out.close()
PYTHON
cat >"$folder/expected" <<'TEXT'
patrol begins
patrol drives
speed 0.2
flight begins
flight drives
patrol stops the motors
speed 0.0
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
