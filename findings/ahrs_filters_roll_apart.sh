#!/bin/sh
# Of six filters of one package, which are given the same accelerometer at rest, one rolls to the other side.
#
# Setting: a torso that lies still, rolled by 30 degrees, so that its accelerometer reads (0, g sin 30, g cos 30). Its
# gyroscope reads 0. Each filter of AHRS takes the same two arrays, and has the same attribute Q with its quaternions.
# Guess: all say a roll of 30 degrees, or all -30, as frames go; they are in one package to be exchanged.
# Seen, with AHRS 0.4.0 from the Python Package Index:
#   Tilt, Madgwick, Mahony, EKF, Complementary   30 degrees
#   AQUA                                         -30 degrees: its quaternion is the conjugate of the others', which its
#                                                class says nowhere (ahrs/filters/aqua.py); no argument turns it
# A balance that changes its filter so falls to the side from which it should rise.
# Fails if one of these changes. Needs Python 3.11 and some 25 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile AHRS==0.4.0 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import math
import sys

import numpy as np
from ahrs import filters

ROLL, COUNT = math.radians(30), 1000
acc = np.tile([0.0, 9.81 * math.sin(ROLL), 9.81 * math.cos(ROLL)], (COUNT, 1))
gyr = np.zeros((COUNT, 3))

with open(sys.argv[1] + "/seen", "w") as seen:
    for name in ("Tilt", "Madgwick", "Mahony", "EKF", "Complementary", "AQUA"):
        given = {"acc": acc} if name == "Tilt" else {"acc": acc, "gyr": gyr}
        w, x, y, z = getattr(filters, name)(**given).Q[-1]
        roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        print(f"{name}: {math.degrees(roll):.0f}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
Tilt: 30
Madgwick: 30
Mahony: 30
EKF: 30
Complementary: 30
AQUA: -30
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
