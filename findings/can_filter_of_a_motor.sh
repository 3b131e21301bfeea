#!/bin/sh
# A filter of python-can for the 11 bits of a motor lets frames of 29 bits through whose last bits are the same.
#
# Setting: a bus within the process, and a motor with the identifier 0x181. The reader filters by it with the mask of
# all 11 bits. Three frames are sent: a Message with this arbitration_id alone, one with is_extended_id=False, too, and
# one with the 29 bits 0x10181, of another device.
# Guess: a Message with an identifier up to 0x7ff is a standard frame, and a filter of 11 bits passes standard frames.
# Seen, with python-can 4.6.1 from the Python Package Index:
#   all three come through, and two of them are extended: Message makes extended frames whatever the identifier
#   (can/message.py, is_extended_id=True), which a CANopen motor does not hear, and a filter without the key `extended`
#   looks at both kinds (can/bus.py, _matches_filters). With "extended": False the second one comes alone.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile python-can==4.6.1
cat >"$folder/tried.py" <<'PYTHON'
import sys

import can

MOTOR = {"can_id": 0x181, "can_mask": 0x7FF}


def heard(chosen):
    with (
        can.Bus(interface="virtual", channel="arm") as sender,
        can.Bus(interface="virtual", channel="arm", can_filters=[chosen]) as reader,
    ):
        sender.send(can.Message(arbitration_id=0x181))
        sender.send(can.Message(arbitration_id=0x181, is_extended_id=False))
        sender.send(can.Message(arbitration_id=0x10181))
        return list(iter(lambda: reader.recv(0.5), None))


with open(sys.argv[1] + "/seen", "w") as seen:
    for chosen in (MOTOR, MOTOR | {"extended": False}):
        frames = [
            f"{each.arbitration_id:#x} {'extended' if each.is_extended_id else 'standard'}" for each in heard(chosen)
        ]
        print(*chosen, "->", ", ".join(frames), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
can_id can_mask -> 0x181 extended, 0x181 standard, 0x10181 extended
can_id can_mask extended -> 0x181 standard
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
