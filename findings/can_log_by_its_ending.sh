#!/bin/sh
# What python-can keeps of a frame goes by the ending of the log: .csv forgets who sent it, and no ending keeps all.
#
# Setting: four frames of a bus of motors are written by can.Logger and read again by can.LogReader: a command that
# this computer sent (is_rx=False), a question (a remote frame) of 8 bytes, a frame of CAN FD with 20 bytes, and an
# error frame.
# Guess: the six formats differ in size and speed; what one cannot hold is refused.
# Seen, with the version below, from the Python Package Index:
#   .blf       all four
#   .asc       all four, at times that begin at 0; the error frame has an identifier of 29 bits
#   .log       the question is one of 0 bytes; the error frame as before
#   .csv, .db  our command is one that was received, the frame of CAN FD is none: 20 bytes that a classic bus refuses
#   .trc       the command alone: of the others a line in the log says that it is not implemented
# No exception anywhere.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile python-can==4.6.1
cat >"$folder/tried.py" <<'PYTHON'
import logging
import sys

import can

logging.disable(logging.CRITICAL)
BEGUN = 1_700_000_000.0


def frame_of(number, **more):
    return can.Message(timestamp=BEGUN + number, arbitration_id=number, is_extended_id=False, channel=0, **more)


FRAMES = [
    frame_of(0, data=[1, 2], is_rx=False),
    frame_of(1, is_remote_frame=True, dlc=8),
    frame_of(2, is_fd=True, data=bytes(20)),
    frame_of(3, is_error_frame=True),
]


def text(frame):
    words = [f"{frame.dlc} bytes"]
    for word in ("is_remote_frame", "is_fd", "is_error_frame", "is_extended_id"):
        if getattr(frame, word):
            words.append(word.split("_")[1])
    words.append("received" if frame.is_rx else "sent")
    try:
        remote = frame.is_remote_frame
        can.Message(is_fd=frame.is_fd, is_remote_frame=remote, data=frame.data, dlc=frame.dlc, check=True)
    except ValueError:
        words.append("impossible")
    return " ".join(words)


with open(sys.argv[1] + "/seen", "w") as seen:
    print("written:", ", ".join(map(text, FRAMES)), file=seen)
    for ending in ("blf", "asc", "log", "csv", "db", "trc"):
        path = f"{sys.argv[1]}/bus.{ending}"
        with can.Logger(path) as logger:
            for frame in FRAMES:
                logger(frame)
        with can.LogReader(path) as reader:
            found = list(reader)
        begun = "kept" if found[0].timestamp == BEGUN else f"{found[0].timestamp:g}"
        print(f".{ending}: {', '.join(map(text, found))}; begun {begun}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
written: 2 bytes sent, 8 bytes remote received, 20 bytes fd received, 0 bytes error received
.blf: 2 bytes sent, 8 bytes remote received, 20 bytes fd received, 0 bytes error received; begun kept
.asc: 2 bytes sent, 8 bytes remote received, 20 bytes fd received, 0 bytes error extended received; begun 0
.log: 2 bytes sent, 0 bytes remote received, 20 bytes fd received, 0 bytes error extended received; begun kept
.csv: 2 bytes received, 8 bytes remote received, 20 bytes received impossible, 0 bytes error received; begun kept
.db: 2 bytes received, 8 bytes remote received, 20 bytes received impossible, 0 bytes error received; begun kept
.trc: 2 bytes sent; begun kept
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
