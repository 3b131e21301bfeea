#!/bin/sh
# Two servo buses in a program share one byte order in Feetech's package: who is made last decides for both.
#
# Setting: the package asks which byte order servos have, 0 for those of the STS series and 1 for those of the SCS
# series: PacketHandler(0). A program drives an arm of the one series and a gripper of the other. The arm, at a port
# that is a pseudo terminal here, is sent to 512; then the gripper's handler is made, and the arm is sent to 512 again.
# Guess: a handler keeps what it was made with.
# Seen, with the versions below, from the Python Package Index:
#   before  the arm is told 00 02, which is 512
#   after   the arm is told 02 00, which is 2: it goes to its end
# The order is a variable of a module, which PacketHandler sets; no warning.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile feetech-servo-sdk==1.0.0 pyserial==3.5
cat >"$folder/tried.py" <<'PYTHON'
import os
import sys
import tty

from scservo_sdk import PacketHandler, PortHandler

ARM, GOAL = 1, 42
bus, name = os.openpty()
tty.setraw(bus)
port = PortHandler(os.ttyname(name))
assert port.setBaudRate(115200)


def told(handler):
    """Send the arm to 512; return the two bytes of the position on the bus."""
    port.is_using = False
    handler.write2ByteTxOnly(port, ARM, GOAL, 512)
    packet = os.read(bus, 64)  # ff ff, servo, length, instruction, address, two bytes, check
    return packet[6:8]


with open(sys.argv[1] + "/seen", "w") as seen:
    arm = PacketHandler(0)
    low, high = told(arm)
    print(f"before: told {low:02x} {high:02x}, which is {low + 256 * high}", file=seen)
    gripper = PacketHandler(1)
    low, high = told(arm)
    print(f"after: told {low:02x} {high:02x}, which is {low + 256 * high}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
before: told 00 02, which is 512
after: told 02 00, which is 2
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
