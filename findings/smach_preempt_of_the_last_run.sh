#!/bin/sh
# A preempt that comes too late for one run of a SMACH machine ends its next run, which nobody preempts.
#
# Setting: a machine of two states. LOOK looks for a preempt and serves it, as states should; WORK, the last one, takes
# 0.2 s and does not look. The machine is preempted while WORK runs, and executed again afterwards.
# Guess: execute() begins anew, since a request belongs to the run in which it was made; at the latest the end of a run
# forgets it.
# Seen, with standalone-smach 0.0.9 from the Python Package Index (smach/state_machine.py): the first run ends as
# finished, whoever asked hears nothing, and the request stays. The second run ends at once as preempted, where LOOK
# serves the old request; the third one is as the first.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile standalone-smach==0.0.9
cat >"$folder/tried.py" <<'PYTHON'
import sys
import threading
import time

import smach

smach.set_loggers(*[lambda *_: None] * 4)
working = threading.Event()


class Look(smach.State):
    def __init__(self):
        super().__init__(outcomes=["calm", "preempted"])

    def execute(self, userdata):
        if self.preempt_requested():
            self.service_preempt()
            return "preempted"
        return "calm"


class Work(smach.State):
    def __init__(self):
        super().__init__(outcomes=["done"])

    def execute(self, userdata):
        working.set()
        time.sleep(0.2)
        return "done"


machine = smach.StateMachine(outcomes=["finished", "preempted"])
with machine:
    smach.StateMachine.add("LOOK", Look(), {"calm": "WORK", "preempted": "preempted"})
    smach.StateMachine.add("WORK", Work(), {"done": "finished"})


def preempt():
    assert working.wait(10)
    machine.request_preempt()


with open(sys.argv[1] + "/seen", "w") as seen:
    preempter = threading.Thread(target=preempt)
    preempter.start()
    print("preempted late:", machine.execute(), file=seen)
    preempter.join()
    for _ in range(2):
        print("not preempted:", machine.execute(), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
preempted late: finished
not preempted: preempted
not preempted: finished
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
