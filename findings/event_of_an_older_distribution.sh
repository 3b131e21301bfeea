#!/bin/sh
# A lifecycle event recorded before ROS 2 Lyrical is read with Lyrical's definitions without an error, in the year 1933.
#
# Setting: lifecycle_msgs/msg/TransitionEvent had `uint64 timestamp` until Kilted, and has `builtin_interfaces/Time
# stamp` since Lyrical. Bags in SQLite of Humble carry no definitions: who reads one chooses those of a distribution.
# Guess: a message of an older form is refused, since its length differs, or what follows the changed field is nonsense.
# Seen, with rosbags 0.11.9 from the Python Package Index, whose stores have the messages of each distribution:
#   TransitionEvent   accepted: both forms begin with 8 bytes, and all that follows is right; the low half of the ns is
#                     taken as seconds, the high half as ns, so that an event of May 2026 happened in August 1933
#   Range             one field more since Iron: refused in both directions
# and Stores.LATEST, "alias for latest ROS2 LTS", has the form of Kilted, which is none, though the package has Lyrical
# (rosbags/typesys/stores/__init__.py).
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile rosbags==0.11.9 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys
from datetime import datetime, timedelta, timezone

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

EVENT, RANGE = "lifecycle_msgs/msg/TransitionEvent", "sensor_msgs/msg/Range"
BEGIN = datetime(1970, 1, 1, tzinfo=timezone.utc)
humble, kilted, lyrical, latest = map(
    get_typestore, (Stores.ROS2_HUMBLE, Stores.ROS2_KILTED, Stores.ROS2_LYRICAL, Stores.LATEST)
)


def day(seconds):
    return (BEGIN + timedelta(seconds=seconds)).date()


def read(store, data, name):
    try:
        return store.deserialize_cdr(data, name)
    except SerdeError as error:
        return type(error).__name__


with open(sys.argv[1] + "/seen", "w") as seen:
    kinds = kilted.types
    event = kinds[EVENT](
        1_780_000_000_123_456_789,
        kinds["lifecycle_msgs/msg/Transition"](3, "activate"),
        kinds["lifecycle_msgs/msg/State"](2, "inactive"),
        kinds["lifecycle_msgs/msg/State"](3, "active"),
    )
    found = read(lyrical, kilted.serialize_cdr(event, EVENT), EVENT)
    print("recorded on", day(event.timestamp // 10**9), file=seen)
    print("read on", day(found.stamp.sec), found.transition.label, found.goal_state.label, file=seen)
    header = kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](1, 2), "sonar")
    old = humble.types[RANGE](header, 0, 0.1, 0.1, 2.0, 1.0)
    new = kinds[RANGE](header, 0, 0.1, 0.1, 2.0, 1.0, 0.5)
    print("older Range:", read(lyrical, humble.serialize_cdr(old, RANGE), RANGE), file=seen)
    print("newer Range:", read(humble, kilted.serialize_cdr(new, RANGE), RANGE), file=seen)
    print("the latest has", latest.fielddefs[EVENT][1][0][0], file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
recorded on 2026-05-28
read on 1933-08-12 activate active
older Range: SerdeError
newer Range: SerdeError
the latest has timestamp
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
