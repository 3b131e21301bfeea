#!/bin/sh
# A queryable of Zenoh that replies with the three entries of its log is heard with the last one alone.
#
# Setting: one session without any network. A queryable on arm/log replies three times to each question, with its own
# key and a time stamp each; two queryables, of the same key, reply once each. A session asks by get() as it is.
# Guess: a question returns what was replied, three entries in their order, and a reply of each arm; what is newer does
# not replace what is older, since a log is no state.
# Seen, with eclipse-zenoh 1.10.2 from the Python Package Index:
#   get("arm/log")                          the third entry
#   the same, _time=[now(-1h)..] added      all three, though the queryable does not look at the time
#   the same, consolidation=NONE            all three
#   two queryables of the same key          one of two, as if one arm had not answered
# For questions without a range of times the default, AUTO, keeps the newest reply for each key. The package says of it
# "based on queryable's preferences", and declare_queryable has no argument for one. With a key for each entry, such as
# arm/log/1, all three come.
# Fails if one of these changes. Needs Python 3.11 and some 15 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile eclipse-zenoh==1.10.2
cat >"$folder/tried.py" <<'PYTHON'
import sys

import zenoh

config = zenoh.Config()
config.insert_json5("listen/endpoints", "[]")
config.insert_json5("scouting/multicast/enabled", "false")


def heard(session, question, **more):
    return [reply.ok.payload.to_string() for reply in session.get(question, **more)]


with zenoh.open(config) as session, open(sys.argv[1] + "/seen", "w") as seen:

    def log(query):
        for entry in ("first", "second", "third"):
            query.reply("arm/log", entry, timestamp=session.new_timestamp())

    def log_by_number(query):
        for number, entry in enumerate(("first", "second", "third")):
            query.reply(f"arm/log/{number}", entry)

    queryable = session.declare_queryable("arm/log", log)
    print("as it is:", *heard(session, "arm/log"), file=seen)
    print("a range of times:", *heard(session, "arm/log?_time=[now(-1h)..]"), file=seen)
    none = zenoh.ConsolidationMode.NONE
    print("no consolidation:", *heard(session, "arm/log", consolidation=none), file=seen)
    queryable.undeclare()
    with session.declare_queryable("arm/log/*", log_by_number):
        print("a key for each:", *sorted(heard(session, "arm/log/*")), file=seen)
    with (
        session.declare_queryable("arm/state", lambda query: query.reply("arm/state", "left")),
        session.declare_queryable("arm/state", lambda query: query.reply("arm/state", "right")),
    ):
        print("two queryables:", len(heard(session, "arm/state")), file=seen)
        print("two queryables, no consolidation:", len(heard(session, "arm/state", consolidation=none)), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
as it is: third
a range of times: first second third
no consolidation: first second third
a key for each: first second third
two queryables: 1
two queryables, no consolidation: 2
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
