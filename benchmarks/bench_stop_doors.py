"""Measure how soon a stop is answered at each door of a robot, alone and while others flood that door.

The doors are those of Zenoh, of the editor's page and of NAOqi. The others are processes that send calls, as
many at once as their link takes; at the page they are viewers, who ask as fast as they can. Here they yield
the processor to the robot, since they would have another one elsewhere. Each stop goes over a link that
exists, or over one that is made for it, which counts.

    python benchmarks/bench_stop_doors.py [--stops 300] [--fresh 60] [DOOR...]
"""

from __future__ import annotations

import argparse
import http.client
import itertools
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import urlsplit

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from websockets.sync.client import ClientConnection, connect

from interfaces.nao import JointsPrx, SafetyPrx
from tests.support.naoqi import connected
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import SystemException, initialize

ATTACKERS: Final = {"zenoh": 4, "page": 8, "naoqi": 4}
AT_ONCE: Final = {"zenoh": 64, "naoqi": 500}
"""Calls that an attacker has under way."""
APART: Final = 0.03  # s between two stops
WARM: Final = 3.0  # s of an attack before the first stop
LIMIT: Final = 60.0  # s

Stop = Callable[[], object]


class Door(NamedTuple):
    """A door: how a link to it is made, which returns the way to stop, and what its attackers are given."""

    link: Callable[[], AbstractContextManager[Stop]]
    given: str


@contextmanager
def zenoh_door(_: Path) -> Iterator[Door]:
    """Serve a fake robot."""
    endpoint = free_endpoint()

    @contextmanager
    def link() -> Iterator[Stop]:
        with initialize(connect=[endpoint], clock="wall") as communicator:
            safety = SafetyPrx.checkedCast(communicator.stringToProxy("Safety"))
            yield lambda: safety.emergencyStop("bench")

    with ComponentProcess(module("naoserver.fake", "--listen", endpoint)) as robot:
        robot.wait_for("^ready")
        yield Door(link, endpoint)


@contextmanager
def page_door(folder: Path) -> Iterator[Door]:
    """Serve the editor beside a fake robot."""
    with zenoh_door(folder) as robot:
        command = module("visualhfsm", "edit", "--no-browser", "--connect", robot.given)
        state = {"XDG_STATE_HOME": str(folder / "state")}
        with ComponentProcess(command, state, folder) as editor:
            address = editor.wait_for(r"http://\S+")[0]
            cookie = cookie_of(address)

            @contextmanager
            def link() -> Iterator[Stop]:
                with page(address, cookie, "/ws") as window:
                    yield lambda: ask(window, "emergencyStop")

            with page(address, cookie, "/ws") as window:
                shared = ask(window, "share")["address"]
                yield Door(link, f"http://{urlsplit(address).netloc}/{shared}")


@contextmanager
def naoqi_door(_: Path) -> Iterator[Door]:
    """Serve a fake robot to programs of NAOqi."""
    with ComponentProcess(module("visualhfsm_naoqi_programs", "--qi", "tcp://127.0.0.1:0")) as robot:
        url = robot.wait_for(r"^ready: (\S+)")[1]

        @contextmanager
        def link() -> Iterator[Stop]:
            with connected(url) as session:
                yield session.service("ALMotion").killAll

        yield Door(link, url)


def cookie_of(address: str) -> str:
    """Return the cookie with which an address of the page lets in."""
    parts = urlsplit(address)
    client = http.client.HTTPConnection(parts.netloc, timeout=LIMIT)
    client.request("GET", f"{parts.path}?{parts.query}")
    cookie = client.getresponse().getheader("set-cookie") or ""
    client.close()
    return cookie.partition(";")[0]


@contextmanager
def page(address: str, cookie: str, path: str) -> Iterator[ClientConnection]:
    """Open a window of the page."""
    place = urlsplit(address).netloc
    headers = {"Cookie": cookie, "Origin": f"http://{place}"}
    with connect(f"ws://{place}{path}", additional_headers=headers, max_size=None) as window:
        ask(window, "hello")
        yield window


def ask(window: ClientConnection, op: str, **fields: object) -> Any:  # noqa: ANN401
    """Send a request of the page, and return its answer."""
    window.send(json.dumps({"id": 1, "op": op, **fields}))
    while (answer := json.loads(window.recv(LIMIT))).get("re") != 1:
        pass
    if "error" in answer:
        raise SystemExit(answer["error"])
    return answer["ok"]


def attack(door: str, given: str) -> None:
    """Flood a door until this process is killed."""
    if door == "page":
        with page(given, cookie_of(given), "/view/ws") as viewer:
            for number in itertools.count(2):
                viewer.send(json.dumps({"id": number, "op": "hello"}))
    elif door == "zenoh":
        with initialize(connect=[given], clock="wall") as communicator:
            body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
            calls = deque(body.getJointState.begin() for _ in range(AT_ONCE[door]))
            while True:
                try:
                    calls.popleft().result(LIMIT)
                except SystemException:  # the robot refuses some of a flood
                    time.sleep(0.001)
                calls.append(body.getJointState.begin())
    else:
        with connected(given) as session:
            motion = session.service("ALMotion")
            running = deque(motion.getAngles("Body", True, _async=True) for _ in range(AT_ONCE[door]))
            while True:
                running.popleft().wait()
                running.append(motion.getAngles("Body", True, _async=True))


def measure(name: str, door: Door, attackers: int, stops: int, fresh: int) -> None:
    """Print a row of the table."""
    command = ["nice", "-n", "19", sys.executable, __file__, "--attack", name, door.given]
    with ExitStack() as attack:
        for _ in range(attackers):
            process = attack.enter_context(subprocess.Popen(command, stdin=subprocess.DEVNULL))
            attack.callback(process.kill)
        time.sleep(WARM if attackers else 0.0)
        old, new = [], []
        with door.link() as stop:
            for _ in range(stops):
                began = time.monotonic()
                stop()
                old.append(time.monotonic() - began)
                time.sleep(APART)
        for _ in range(fresh):
            began = time.monotonic()
            with door.link() as stop:
                stop()
                new.append(time.monotonic() - began)
    print(f"| {name} | {attackers} | {described(old)} | {described(new)} |", flush=True)


def described(took: list[float]) -> str:
    """Return the median, the 99th percentile and the longest of some times."""
    most = sorted(took)[int(0.99 * (len(took) - 1))]
    return " / ".join(f"{1000 * each:.0f}" for each in (statistics.median(took), most, max(took)))


def main() -> None:
    """Measure the named doors, by default all of them."""
    doors = {"zenoh": zenoh_door, "page": page_door, "naoqi": naoqi_door}
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("doors", nargs="*", metavar="DOOR", help=", ".join(doors))
    parser.add_argument("--stops", type=int, default=300)
    parser.add_argument("--fresh", type=int, default=60)
    parser.add_argument("--attack", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.attack:
        attack(*options.attack)
    print("Times in ms: median / 99 % / longest.\n")
    print("| door | attackers | existing link | new link |\n|---|---|---|---|")
    for name in options.doors or doors:
        with tempfile.TemporaryDirectory() as folder, doors[name](Path(folder)) as door:
            for attackers in (0, ATTACKERS[name]):
                measure(name, door, attackers, options.stops, options.fresh)


if __name__ == "__main__":
    main()
