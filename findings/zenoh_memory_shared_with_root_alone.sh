#!/bin/sh
# Pictures of a camera that Zenoh shares by memory go through the network instead, without a word, for ordinary users.
#
# Setting: two processes of one machine, both with transport/shared_memory/enabled, which is the default; one puts
# pictures of 640x480, the other one asks each sample as_shm() whether it came by memory. Both may lock 8 MiB of memory,
# as systemd lets users and services by default, and have no right to lock more (CAP_IPC_LOCK), as root has.
# Guess: the pictures are shared, or the log says why they are not.
# Seen, with eclipse-zenoh 1.10.2 from the Python Package Index:
#   as it is                                no picture is shared
#   pool_size 4 MiB instead of 16 MiB       all are, once the first have gone through the network
# The pool is locked into memory as a whole when the first large message is sent. Where that fails, messages go through
# the network as before: a picture of 1280x960 in 16 ms instead of 3. With the right CAP_IPC_LOCK, as in a container of
# root, both share. The defaults of the package and of the system do not meet.
# Fails if one of these changes. Needs Linux, Python 3.11 and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile eclipse-zenoh==1.10.2
cat >"$folder/tried.py" <<'PYTHON'
import ctypes
import os
import resource
import signal
import socket
import subprocess
import sys
import time

PICTURE = bytes(640 * 480 * 3)
PICTURES = 40
IPC_LOCK = 14
PR_CAPBSET_DROP = 24


def opened(endpoint, pool, side):
    import zenoh

    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5(f"{side}/endpoints", f'["{endpoint}"]')
    config.insert_json5("transport/shared_memory/enabled", "true")
    if pool:
        config.insert_json5("transport/shared_memory/transport_optimization/pool_size", pool)
    return zenoh.open(config)


def camera(endpoint, pool):
    with opened(endpoint, pool, "listen") as session:
        publisher = session.declare_publisher("camera")
        while not publisher.matching_status.matching:
            time.sleep(0.05)
        for _ in range(PICTURES):
            publisher.put(PICTURE)
            time.sleep(0.05)
        sys.stdin.read()


def shared(pool):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    command = [sys.executable, __file__, endpoint, pool]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as process:
        time.sleep(2.0)
        with opened(endpoint, pool, "connect") as session:
            with session.declare_subscriber("camera") as subscriber:
                came = [subscriber.recv().payload.as_shm() is not None for _ in range(PICTURES)]
        process.communicate(timeout=30)
    return "all" if all(came[PICTURES // 2 :]) else "none" if not any(came) else "some"


def without_the_right():
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (8 << 20, resource.getrlimit(resource.RLIMIT_MEMLOCK)[1]))
    ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, IPC_LOCK, 0, 0, 0)


if __name__ == "__main__":
    signal.alarm(60)
    if sys.argv[1:] == ["begin"]:
        without_the_right()
        os.execv(sys.executable, [sys.executable, __file__])
    elif sys.argv[1:]:
        camera(*sys.argv[1:])
    else:
        print("as it is:", shared(""))
        print("a pool of 4 MiB:", shared(str(4 << 20)))
PYTHON
cat >"$folder/expected" <<'TEXT'
as it is: none
a pool of 4 MiB: all
TEXT
"$folder/venv/bin/python" "$folder/tried.py" begin >"$folder/seen"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
