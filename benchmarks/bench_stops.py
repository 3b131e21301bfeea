"""Measure what moves after a commander is lost, and how soon a stop is answered beside a flood.

`kills`: a commander, in a separate process, moves a simulated robot in one of several ways. At a moment drawn
from the seed it is killed or ends, or the robot is stopped and its server killed. Motion is a change of a
setpoint of a joint, or a velocity of the walk. The figures are the seconds for which something moved without
a commander, or after a stop that nobody reset. A way into a posture may go on, and has another limit.

The doors are those of Zenoh, of the editor's page and of NAOqi: how soon a stop is answered, alone and while
others flood that door. They are processes that send calls, as many at once as their link takes; at the page
they are viewers, who ask as fast as they can. Here they yield the processor to the robot, since they would
have another one elsewhere. Each stop goes over a link that exists, or over one that is made for it, which
counts.

    python benchmarks/bench_stops.py [--runs 100] [--stops 300] [--fresh 60] [kills] [zenoh] [page] [naoqi]
"""

from __future__ import annotations

import argparse
import http.client
import itertools
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple
from unittest.mock import patch
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect

from benchmarks.common import parts, percentile
from interfaces.jderobot import MotorsPrx
from interfaces.nao import ActionStatus, JointsPrx, JointState, PosturesPrx, SafetyPrx
from plugins.naoqi.tests.support.naoqi import connected
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import Communicator, SystemException, ZenohIceError, initialize

COMMANDER: Final = """
import random, sys, time
from interfaces.jderobot import MotorsPrx
from interfaces.nao import JointsPrx, MotionsPrx, PoseHeadPrx, PosturesPrx, WalkPrx
from zenoh_ice import initialize
endpoint, way, seconds = sys.argv[1:]
with initialize(connect=[endpoint], clock="wall") as communicator:
    def proxy(kind, identity):
        return kind.checkedCast(communicator.stringToProxy(identity))
    if way == "position":
        proxy(JointsPrx, "Body").setJointPositions({"LShoulderPitch": -1.5, "HeadYaw": 1.5}, 0.02)
    elif way == "play":
        proxy(MotionsPrx, "Motions").play("wave", 0.5)
    elif way == "posture":
        proxy(PosturesPrx, "Postures").goToPosture("Crouch", 0.3)
    elif way == "walk to":
        proxy(WalkPrx, "Walk").walkTo(2.0, 0.0, 0.0)
    print("commanding", flush=True)
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        if way == "velocity":
            proxy(PoseHeadPrx, "Head").setSpeed(0.1, 0.05)
        elif way == "walk":
            proxy(MotorsPrx, "Motors").setV(0.05)
        elif way == "burst":
            body = proxy(JointsPrx, "Body")
            calls = [body.setJointPositions.begin({"RShoulderPitch": -1.5}, 0.02) for _ in range(40)]
            for call in calls:
                call.result()
        time.sleep(0.05)
"""
WAYS: Final = ("position", "velocity", "walk", "walk to", "play", "burst", "posture")
ENDS: Final = ("killed", "ends", "stop, server killed", "server killed")
LOOK: Final = 3.0  # s for which motion is watched
LIMIT: Final = 1.0  # s that it may last
SETTLED: Final = 0.3  # s without motion after which the robot rests
LONG: Final = 30.0
_MOVED: Final = 1e-6  # rad
ATTACKERS: Final = {"zenoh": 4, "page": 8, "naoqi": 4}
AT_ONCE: Final = {"zenoh": 64, "naoqi": 500}
"""Calls that an attacker has under way."""
APART: Final = 0.03  # s between two stops
WARM: Final = 3.0  # s of an attack before the first stop
ANSWER: Final = 60.0  # s
Stop = Callable[[], object]


def described(took: list[float]) -> str:
    """Return the median, the 99th percentile and the longest of some times."""
    return " / ".join(
        f"{1000 * each:.0f}" for each in (statistics.median(took), percentile(took, 0.99), max(took))
    )


@contextmanager
def serving(endpoint: str) -> Iterator[ComponentProcess]:
    with ComponentProcess(module("naoserver_sim", "--listen", endpoint), {"MUJOCO_GL": "disable"}) as server:
        server.wait_for("^ready")
        yield server


class Robot:
    """The simulated robot, whose server is started again whenever it was killed."""

    def __init__(self, communicator: Communicator) -> None:
        self.body = JointsPrx.uncheckedCast(communicator.stringToProxy("Body"))
        self.safety = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
        self.postures = PosturesPrx.uncheckedCast(communicator.stringToProxy("Postures"))
        self.walk = MotorsPrx.uncheckedCast(communicator.stringToProxy("Motors"))

    def answers(self) -> None:
        """Wait until the server can be called."""
        end = time.monotonic() + LONG
        while True:
            with suppress(ZenohIceError):
                self.safety.getSafetyState()
                return
            if time.monotonic() > end:
                raise AssertionError("the robot does not answer")
            time.sleep(0.05)

    def motion(self, seconds: float) -> float:
        """Return when something moved last within some seconds from now, in s; 0 if nothing did."""
        began, last = time.monotonic(), 0.0
        before = self._setpoints()
        while (now := time.monotonic() - began) < seconds:
            time.sleep(0.02)
            after = self._setpoints()
            moved = max(abs(a - b) for a, b in zip(after.commands, before.commands, strict=True)) > _MOVED
            if moved or any((self.walk.getV(), self.walk.getW(), self.walk.getL())):
                last = now
            before = after
        return last

    def rest(self) -> None:
        """Wait until nothing moves: the way of a lost commander into a posture goes on for a while."""
        end = time.monotonic() + LONG
        while self.motion(SETTLED) or self.postures.getPostureState().status is ActionStatus.Moving:
            if time.monotonic() > end:
                raise AssertionError("the robot does not come to rest")

    def _setpoints(self) -> JointState:
        return self.body.getJointState()


def run(runs: int, seed: int) -> int:
    """Run trials; print a table; return how many broke the promise."""
    draw = random.Random(seed)
    figures: dict[tuple[str, str], list[float]] = {}
    endpoint = free_endpoint()
    with initialize(connect=[endpoint], clock="wall") as communicator:
        robot = Robot(communicator)
        number = 0
        while number < runs:
            with serving(endpoint) as server:
                robot.answers()
                if robot.safety.getSafetyState().stopped:
                    check_still(robot, figures, ("restarted", "nobody"))
                    robot.safety.resetEmergencyStop()
                while number < runs and server.process.poll() is None:
                    trial(robot, server, endpoint, draw, figures)
                    number += 1
    broken = 0
    print(f"{'end':22} {'motion':10} {'runs':>5} {'median s':>9} {'longest s':>10}")
    for (end, way), times in sorted(figures.items()):
        limit = LOOK if way == "posture" else 0.0 if end in {"restarted", "after a stop"} else LIMIT
        broken += sum(each > limit for each in times)
        print(f"{end:22} {way:10} {len(times):5} {statistics.median(times):9.2f} {max(times):10.2f}")
    print(f"{broken} of {sum(map(len, figures.values()))} broke the promise")
    return broken


def check_still(robot: Robot, figures: dict[tuple[str, str], list[float]], key: tuple[str, str]) -> None:
    figures.setdefault(key, []).append(robot.motion(LOOK))


def trial(
    robot: Robot,
    server: ComponentProcess,
    endpoint: str,
    draw: random.Random,
    figures: dict[tuple[str, str], list[float]],
) -> None:
    """Let a commander move the robot, and end it, or the server, at a random moment."""
    robot.rest()
    way, end = draw.choice(WAYS), draw.choices(ENDS, (6, 2, 2, 1))[0]
    moment = draw.uniform(0.1, 1.5)
    lasts = moment if end == "ends" else LONG
    command = [sys.executable, "-c", COMMANDER, endpoint, way, str(lasts)]
    with ComponentProcess(command) as commander:
        commander.wait_for("commanding")
        time.sleep(moment)
        if end == "ends":
            commander.wait()
        elif end == "killed":
            commander.process.send_signal(signal.SIGKILL)
        if "server killed" not in end:
            figures.setdefault((end, way), []).append(robot.motion(LOOK))
            return
        if end.startswith("stop"):
            robot.safety.emergencyStop("a hand in the way")
            figures.setdefault(("after a stop", way), []).append(max(0.0, robot.motion(1.5) - 1.0))
        server.process.kill()
        server.wait()
        commander.process.kill()


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
    with ComponentProcess(module("visualhfsm_naoqi.programs", "--qi", "tcp://127.0.0.1:0")) as robot:
        url = robot.wait_for(r"^ready: (\S+)")[1]

        @contextmanager
        def link() -> Iterator[Stop]:
            with connected(url) as session:
                yield session.service("ALMotion").killAll

        yield Door(link, url)


def cookie_of(address: str) -> str:
    """Return the cookie with which an address of the page lets in."""
    parts = urlsplit(address)
    client = http.client.HTTPConnection(parts.netloc, timeout=ANSWER)
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
    while (answer := json.loads(window.recv(ANSWER))).get("re") != 1:
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
                    calls.popleft().result(ANSWER)
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


def kill(given: argparse.Namespace) -> bool:
    """Return whether the promise was kept."""
    with tempfile.TemporaryDirectory() as state, patch.dict(os.environ, {"XDG_STATE_HOME": state}):
        return not run(given.runs, given.seed)


def main() -> None:
    """Print the figures; exit with 1 if a promise was broken."""
    if "--attack" in sys.argv:
        attack(*sys.argv[2:])
    doors = {"zenoh": zenoh_door, "page": page_door, "naoqi": naoqi_door}

    def flooded(name: str, given: argparse.Namespace) -> bool:
        print("Times in ms: median / 99 % / longest.\n")
        print("| door | attackers | existing link | new link |\n|---|---|---|---|")
        with tempfile.TemporaryDirectory() as folder, doors[name](Path(folder)) as door:
            for attackers in (0, ATTACKERS[name]):
                measure(name, door, attackers, given.stops, given.fresh)
        return True

    measured = {"kills": kill} | {name: partial(flooded, name) for name in doors}
    sys.exit(not all(parts(__doc__, measured, runs=100, seed=1, stops=300, fresh=60)))


if __name__ == "__main__":
    main()
