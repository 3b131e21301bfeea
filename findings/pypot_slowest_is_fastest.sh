#!/bin/sh
# A servo that pypot is to move more slowly than 0.34 degrees a second moves as fast as it can.
#
# Setting: an MX-28, which a pseudo terminal plays here: it answers a ping and names its model. DxlIO of pypot sends it
# slower and slower to its place; speeds are in degrees a second. In a servo's register of speed 1 is the slowest, 0.114
# revolutions a minute, and 0 is none: "the maximum rpm of the motor is used without controlling the speed" (ROBOTIS's
# manuals of the MX series, Moving Speed).
# Guess: who converts degrees a second to this register knows its 0, and sends 1 for what is slower than the slowest, or
# refuses it.
# Seen, with pypot 5.0.2 from the Python Package Index (pypot/dynamixel/conversion.py, speed_to_dxl, rounds to the
# nearest number):
#   100 -> 146, 1 -> 1, 0.35 -> 1, and 0.34 -> 0, 0.1 -> 0
# So does Motor.goto_position with the control "dummy", which divides the way by the time: one degree in three seconds
# is 0.33 degrees a second. A robot that is to turn its head unnoticed jerks.
# Fails if one of these changes. Needs Python 3.11 and some 60 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile pypot==5.0.2 pyserial==3.5 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import os
import queue
import sys
import threading
import tty

from pypot.dynamixel import DxlIO

SERVO, MODEL, SPEED = 1, 29, 32
PING, READ, SYNC_WRITE = 1, 2, 0x83
bus, name = os.openpty()
tty.setraw(bus)
speeds = queue.Queue()


def answer(data):
    body = bytes([SERVO, len(data) + 2, 0]) + data
    os.write(bus, b"\xff\xff" + body + bytes([~sum(body) & 0xFF]))


def servo():
    """Answer pings and questions, and keep what is written to the register of speed."""
    heard = b""
    while True:
        heard += os.read(bus, 64)
        while len(heard) >= 4 and len(heard) >= 4 + heard[3]:
            packet, heard = heard[: 4 + heard[3]], heard[4 + heard[3] :]
            what, first = packet[4:6]
            if what == PING:
                answer(b"")
            elif what == READ:
                register = MODEL.to_bytes(2, "little") + bytes(64)
                answer(register[first : first + packet[6]])
            elif what == SYNC_WRITE and first == SPEED:
                speeds.put(int.from_bytes(packet[8:10], "little"))


threading.Thread(target=servo, daemon=True).start()
with DxlIO(os.ttyname(name), timeout=5) as io, open(sys.argv[1] + "/seen", "w") as seen:
    print(*io.get_model([SERVO]), file=seen)
    for speed in (100, 1, 0.35, 0.34, 0.1):
        io.set_moving_speed({SERVO: speed})
        print(f"{speed} degrees a second: {speeds.get(timeout=5)}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
MX-28
100 degrees a second: 146
1 degrees a second: 1
0.35 degrees a second: 1
0.34 degrees a second: 0
0.1 degrees a second: 0
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
