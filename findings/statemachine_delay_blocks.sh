#!/bin/sh
# An event that python-statemachine is to send in half a second holds who sends it for that half second.
#
# Setting: a chart of two states, used without asyncio as in the package's first example; `send("go", delay=500)`. In
# the second run two events are sent: a late one first, then one for now.
# Guess: send returns at once, as <send delay="500ms"> of SCXML does, and the event comes later; or, as there is no
# loop, it is refused.
# Seen, with python-statemachine 3.2.2 from the Python Package Index (statemachine/engines/sync.py): send returns after
# half a second, when the event has been handled. A caller that sends a timeout and then listens to its sensors
# hears them when the timeout is over: what it sends after the late event comes after it.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile python-statemachine==3.2.2
cat >"$folder/tried.py" <<'PYTHON'
import sys
import time

from statemachine import State, StateChart


class Wait(StateChart):
    waiting = State(initial=True)
    gone = State(final=True)
    safe = State(final=True)
    go = waiting.to(gone)
    stop = waiting.to(safe)


def state(chart):
    return next(iter(chart.configuration)).id


with open(sys.argv[1] + "/seen", "w") as seen:
    chart = Wait()
    began = time.monotonic()
    chart.send("go", delay=500)
    lasted = time.monotonic() - began
    print(f"returns {'late' if lasted >= 0.45 else 'at once'}, then it is {state(chart)}", file=seen)

    chart = Wait()
    chart.send("go", delay=500)
    if not chart.is_terminated:
        chart.send("stop")
    print(f"with a stop after it, it is {state(chart)}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
returns late, then it is gone
with a stop after it, it is gone
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
