"""Kill commanders and robot servers at random moments, and measure what moves afterwards.

A commander, in a separate process, moves a simulated robot in one of several ways. At a moment drawn from
the seed it is killed or ends, or the robot is stopped and its server killed. Motion is a change of a setpoint
of a joint, or a velocity of the walk. The figures are the seconds for which something moved without a
commander, or after a stop that nobody reset. A way into a posture may go on, and has another limit.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Final

from interfaces.jderobot import MotorsPrx
from interfaces.nao import ActionStatus, JointsPrx, JointState, PosturesPrx, SafetyPrx
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import Communicator, ZenohIceError, initialize

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


def main() -> None:
    """Print the figures; exit with 1 if the promise was broken."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as state:
        os.environ["XDG_STATE_HOME"] = state
        sys.exit(bool(run(given.runs, given.seed)))


if __name__ == "__main__":
    main()
