#!/bin/sh
# In an asynchronous machine of `transitions` a second event cuts entry code off in its middle; its sender gets False.
#
# Setting: `go` leads from idle to reach, whose entry code moves an arm for 0.2 s. After 0.05 s another task sends
# `halt`, which leads to stop.
# Guess: run to completion, as in statecharts and in the same library's synchronous machine: `halt` waits until the
# entry code has ended, or is refused; an entry code that is cut raises CancelledError where `go` was awaited.
# Seen, with transitions 0.9.3 from the Python Package Index:
#   AsyncMachine               the entry code ends at its await; the exit code of reach runs all the same; `go` returns
#                              False, as for a condition that does not hold, and nothing is raised or logged as an error
#   with queued=True           run to completion, but `halt` returns True at once, while the robot still reaches
# (transitions/extensions/asyncio.py: `process_context` makes False of CancelledError)
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile transitions==0.9.3
cat >"$folder/tried.py" <<'PYTHON'
import asyncio
import sys

from transitions.extensions.asyncio import AsyncMachine


class Robot:
    def __init__(self):
        self.did = []

    async def on_enter_reach(self):
        self.did.append("begins to reach")
        await asyncio.sleep(0.2)
        self.did.append("has reached")

    async def on_exit_reach(self):
        self.did.append("lets go")


async def tried(queued):
    robot = Robot()
    AsyncMachine(
        robot, ["idle", "reach", "stop"], initial="idle", auto_transitions=False, queued=queued,
        transitions=[["go", "idle", "reach"], ["halt", "*", "stop"]],
    )
    going = asyncio.create_task(robot.go())
    await asyncio.sleep(0.05)
    halted = await robot.halt()
    then = robot.state
    went = await going
    return f"queued={queued}: {', '.join(robot.did)}; halt {halted} in {then}, go {went}; ends in {robot.state}"


with open(sys.argv[1] + "/seen", "w") as seen:
    for queued in (False, True):
        print(asyncio.run(tried(queued)), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
queued=False: begins to reach, lets go; halt True in stop, go False; ends in stop
queued=True: begins to reach, has reached, lets go; halt True in reach, go True; ends in stop
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
