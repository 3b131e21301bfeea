#!/bin/sh
# A position of infinity is sent to a motor as "no position", and four turns as 3.28, where resolution saves bytes.
#
# Setting: moteus drives a motor over CAN. A command has NaN for a position that is not asked for: then the motor keeps
# its own. `PositionResolution` chooses how many bytes a number takes; with int16 a position has steps of 0.0001 turns.
# Guess: what does not fit is refused, as `struct` would, or cut at the largest position.
# Seen, with moteus 1.1.1 from the Python Package Index, in the bytes of the command (no motor is needed):
#   position    float              int16
#   3.0         40400000           7530: 3.0
#   3.3         40533333           7fff: 3.2767
#   4.0         40800000           7fff: 3.2767, without a word
#   NaN         7fc00000           8000: no position
#   infinity    7f800000           8000: no position, too; neither the largest one nor an error
#   -infinity   ff800000           8000
# So a program that asks for `float("inf")`, or for more turns than 3.2767, sends something else as soon as somebody
# chooses the smaller resolution, and hears of it from the motor alone.
# Fails if one of these changes. Needs Python 3.11 and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile moteus==1.1.1
cat >"$folder/tried.py" <<'PYTHON'
import math
import sys

import moteus


def sent(position, resolution, size):
    """The bytes of the number, which are the last ones of the command, from the highest."""
    asked = moteus.PositionResolution()
    asked.position = resolution
    command = moteus.Controller(id=1, position_resolution=asked).make_position(position=position)
    return command.data[-size:][::-1].hex()


with open(sys.argv[1] + "/seen", "w") as seen:
    for position in (3.0, 3.3, 4.0, math.nan, math.inf, -math.inf):
        print(position, sent(position, moteus.F32, 4), sent(position, moteus.INT16, 2), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
3.0 40400000 7530
3.3 40533333 7fff
4.0 40800000 7fff
nan 7fc00000 8000
inf 7f800000 8000
-inf ff800000 8000
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
