#!/bin/sh
# libqi delivers two bytes as a text of eleven characters, that of their Python repr, unless they are declared as raw.
#
# Setting: a service in Python, called over loopback by a second session, returns what it gets. Bytes are those of a
# picture or a sound, as ALVideoDevice returns them.
# Guess: bytes arrive as bytes or bytearray, as a picture of ALVideoDevice does; or they are refused.
# Seen, with qi 3.1.5 from the Python Package Index: bytes and bytearrays of ASCII arrive as str; all others as the text
# that Python's repr makes of bytes, b, quotes and escapes included, without an error, in both directions and within
# lists. A method whose `__qi_return_signature__` is "r", raw, returns a bytearray of the same bytes.
# Fails if one of these changes. Needs Python 3.11, a port of loopback and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile qi==3.1.5
cat >"$folder/tried.py" <<'PYTHON'
import sys

import qi


class Camera:
    def echo(self, value):
        return value

    def picture(self):
        return b"\xff\xd8"

    def raw(self):
        return b"\xff\xd8"

    raw.__qi_return_signature__ = "r"


server, client = qi.Session(), qi.Session()
server.listenStandalone("tcp://127.0.0.1:0")
server.registerService("Camera", Camera())
client.connect(server.endpoints()[0])
camera = client.service("Camera")

with open(sys.argv[1] + "/seen", "w") as seen:
    for what, found in (
        ("ASCII", camera.echo(b"ab")),
        ("given", camera.echo(b"\xff\xd8")),
        ("given as bytearray", camera.echo(bytearray(b"\xff\xd8"))),
        ("in a list", camera.echo([b"\xff\xd8"])[0]),
        ("returned", camera.picture()),
        ("returned as raw", camera.raw()),
    ):
        print(f"{what}: {type(found).__name__} of {len(found)}: {found}", file=seen)
client.close()
server.close()
PYTHON
cat >"$folder/expected" <<'TEXT'
ASCII: str of 2: ab
given: str of 11: b'\xff\xd8'
given as bytearray: str of 11: b'\xff\xd8'
in a list: str of 11: b'\xff\xd8'
returned: str of 11: b'\xff\xd8'
returned as raw: bytearray of 2: bytearray(b'\xff\xd8')
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
