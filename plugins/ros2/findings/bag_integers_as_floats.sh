#!/bin/sh
# Whole numbers in an array of floats are written to a bag as their bits: a covariance of 1 is read as 0.0000...5.
#
# Setting: rosbags writes messages of ROS without ROS. An array of a message is a NumPy array, and `np.ones(36,
# dtype=int)`, `np.eye(6, dtype=int)` or counts of a sensor are arrays of int64.
# Guess: they are converted, as a single number is (`Point(1, 2, 3)` is read as 1.0, 2.0, 3.0), or refused.
# Seen, with rosbags 0.11.9 from the Python Package Index:
#   int64 for float64[]    taken, and written bit by bit: 1, 2, 3 are read as 4.9e-324, 9.9e-324, 1.5e-323
#   int64 for float64[36]  the same: the covariance of a pose says that it is known exactly
#   int64 for int32[], float32 for float64[], 6 x 6 floats for float64[36]   refused
#   floats, and integers for a single float64                                as they should be
# Only the size of an element is looked at (the array is viewed as bytes), so that what is refused on one line passes
# on the next.
# Fails if one of these changes. Needs Python 3.11 and some 10 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile rosbags==0.11.9 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys

import numpy as np
from rosbags.typesys import Stores, get_typestore

store = get_typestore(Stores.ROS2_HUMBLE)
kinds = store.types
Point, Pose = kinds["geometry_msgs/msg/Point"], kinds["geometry_msgs/msg/Pose"]
Quaternion = kinds["geometry_msgs/msg/Quaternion"]
layout = kinds["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)


def read(name, **fields):
    try:
        written = store.serialize_cdr(kinds[name](**fields), name)
    except Exception as error:
        return type(error).__name__
    return store.deserialize_cdr(written, name)


def numbers(kind, given):
    message = read(f"std_msgs/msg/{kind}MultiArray", layout=layout, data=given)
    return message if isinstance(message, str) else " ".join(f"{each:g}" for each in message.data)


def covariance(given):
    pose = Pose(position=Point(1, 2, 3), orientation=Quaternion(0, 0, 0, 1))
    message = read("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=given)
    return message if isinstance(message, str) else f"{message.covariance[0]:g}"


whole = np.array([1, 2, 3], np.int64)
with open(sys.argv[1] + "/seen", "w") as seen:
    for line in (
        f"floats for float64[]: {numbers('Float64', whole.astype(float))}",
        f"int64 for float64[]: {numbers('Float64', whole)}",
        f"float32 for float64[]: {numbers('Float64', whole.astype(np.float32))}",
        f"int64 for int32[]: {numbers('Int32', whole)}",
        f"floats for float64[36]: {covariance(np.ones(36))}",
        f"int64 for float64[36]: {covariance(np.ones(36, np.int64))}",
        f"6 x 6 for float64[36]: {covariance(np.ones((6, 6)))}",
        f"integers for float64: {read('geometry_msgs/msg/Point', x=1, y=2, z=3).z:g}",
    ):
        print(line, file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
floats for float64[]: 1 2 3
int64 for float64[]: 4.94066e-324 9.88131e-324 1.4822e-323
float32 for float64[]: ValueError
int64 for int32[]: ValueError
floats for float64[36]: 1
int64 for float64[36]: 4.94066e-324
6 x 6 for float64[36]: SerdeError
integers for float64: 3
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
