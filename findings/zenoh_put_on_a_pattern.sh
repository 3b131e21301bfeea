#!/bin/sh
# A Zenoh put on `robot/*/stop` is taken, and reaches who subscribes to `robot/left/stop` under the key with the star.
#
# Setting: one session without any network. Subscribers have the keys robot/left/stop and robot/right/stop; a sample is
# put, and one deleted, on a key with a wildcard.
# Guess: patterns are for those who subscribe and query; a put on one is refused, as MQTT refuses to publish on a filter
# (MQTT 5, 3.3.2.1). If it comes through, then under the key of the subscriber.
# Seen, with eclipse-zenoh 1.10.2 from the Python Package Index:
#   put, delete and a declared publisher are accepted, and all subscribers whose keys the pattern meets are called. The
#   key of the sample is robot/*/stop, which none of them has: who looks up the robot by its key finds none. A put on **
#   reaches everybody.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile eclipse-zenoh==1.10.2
cat >"$folder/tried.py" <<'PYTHON'
import sys
import threading

import zenoh

config = zenoh.Config()
config.insert_json5("listen/endpoints", "[]")
config.insert_json5("scouting/multicast/enabled", "false")
heard, changed = [], threading.Condition()


def keep(place):
    def receive(sample):
        with changed:
            heard.append(f"{place} hears {str(sample.kind).removeprefix('SampleKind.')} of {sample.key_expr}")
            changed.notify()

    return receive


def tried(seen, what, act):
    with changed:
        heard.clear()
    act()
    with changed:
        assert changed.wait_for(lambda: len(heard) == 2, timeout=10), heard
        print(what, *sorted(heard), sep="\n  ", file=seen)


with zenoh.open(config) as session, open(sys.argv[1] + "/seen", "w") as seen:
    for place in ("left", "right"):
        session.declare_subscriber(f"robot/{place}/stop", keep(place))
    tried(seen, "put", lambda: session.put("robot/*/stop", "now"))
    tried(seen, "delete", lambda: session.delete("robot/*/stop"))
    tried(seen, "publisher", lambda: session.declare_publisher("robot/**").put("now"))
    tried(seen, "put on everything", lambda: session.put("**", "now"))
PYTHON
cat >"$folder/expected" <<'TEXT'
put
  left hears PUT of robot/*/stop
  right hears PUT of robot/*/stop
delete
  left hears DELETE of robot/*/stop
  right hears DELETE of robot/*/stop
publisher
  left hears PUT of robot/**
  right hears PUT of robot/**
put on everything
  left hears PUT of **
  right hears PUT of **
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
