"""Measure the cost of serving a real robot over NAOqi, compared with NAOqi itself.

A robot without physics is served as NAOqi in one process, and `naoserver-naoqi` runs in another; this process
is the client of both, over loopback. Required are less than 0.5 ms added to a plain call of libqi, less than
5 % lost images of 640x480 at 30 images/s, and that a lost robot is reported within 1 s.

    python plugins/naoqi/benchmarks/bench_naoqi.py [--calls 1000] [--seconds 10]
"""

from __future__ import annotations

import argparse
import random
import signal
import statistics
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from typing import Final, TypeVar

import qi
from rich.console import Console
from rich.table import Table

from interfaces.jderobot import CameraPrx
from interfaces.nao import HealthPrx, JointsPrx, PoseHeadPrx, Severity
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm_naoqi.programs import serve_as_naoqi
from visualhfsm_naoqi.robot._libqi_link import connect
from visualhfsm_naoqi.robot._link import RobotAddress
from visualhfsm_naoqi.robot.calls import CallLink, call
from zenoh_ice import Communicator, ObjectPrx, WallClock, initialize

P = TypeVar("P", bound=ObjectPrx)

CONSOLE: Final = Console(width=100)
ADDED: Final = 0.5
"""The largest time in ms that a call may add to a plain one."""
LOST: Final = 0.05
"""The largest share of lost images."""
REPORTED: Final = 1.0
"""Seconds within which a lost robot must be reported."""
RATE: Final = 30.0
PAUSE: Final = 0.002
"""Seconds between two calls."""


class RecordingRobot(FakeRobot):
    """Prints when a command for HeadYaw arrives, by the monotonic clock, which all processes share."""

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        """Move, and print the target and the time."""
        now = time.monotonic()
        super().command_positions(targets, max_speeds)
        if "HeadYaw" in targets:
            print(f"{targets['HeadYaw']:.9f} {now:.9f}", flush=True)


def be_the_robot() -> None:
    """Serve the recording robot as NAOqi until the process is ended."""
    with closing(RecordingRobot()) as robot:
        assembly = Assembly(robot, ServerOptions(), WallClock())
        with serve_as_naoqi(robot, assembly, "tcp://127.0.0.1:0") as url:
            print(f"ready: {url}", flush=True)
            threading.Event().wait()


class Bench:
    """The processes, and the client's connections to them."""

    def __init__(self, robot: ComponentProcess, communicator: Communicator, link: CallLink) -> None:
        self.robot = robot
        self.communicator = communicator
        self.link = link

    def proxy(self, interface: type[P], identity: str) -> P:
        """Return a checked proxy."""
        return interface.checkedCast(self.communicator.stringToProxy(identity))

    def arrival_time(self, target: float) -> float:
        """Return the time in s at which the robot got a command."""
        return float(self.robot.wait_for(rf"^{target:.9f} ([\d.]+)$").group(1))


@contextmanager
def processes() -> Iterator[Bench]:
    """Start the robot and the server, and connect to both."""
    endpoint = free_endpoint()
    with ComponentProcess([sys.executable, __file__, "--robot"]) as robot:
        url = robot.wait_for(r"^ready: (\S+)").group(1)
        server = ComponentProcess(
            module("visualhfsm_naoqi.robot", "--robot", url, "--listen", endpoint, "--realm", "bench")
        )
        with (
            server,
            closing(connect(RobotAddress.parse(url), 5.0)) as link,
            initialize(
                realm="bench", listen=["tcp/127.0.0.1:0"], connect=[endpoint], clock="wall"
            ) as communicator,
        ):
            server.wait_for("^ready")
            yield Bench(robot, communicator, link)


def measured(count: int, run: Callable[[], object]) -> list[float]:
    """Return the times in ms of many calls."""
    times = []
    for number in range(count + count // 10):
        begin = time.perf_counter()
        run()
        if number >= count // 10:  # the first calls are a warm-up
            times.append((time.perf_counter() - begin) * 1000)
        time.sleep(PAUSE)
    return times


def row(table: Table, name: str, bare: list[float], through: list[float]) -> None:
    """Add a comparison of times in ms to a table."""
    added = statistics.median(through) - statistics.median(bare)
    cells = [
        f"{statistics.median(times):.3f} / {sorted(times)[len(times) * 95 // 100]:.3f}"
        for times in (bare, through)
    ]
    table.add_row(name, *cells, f"{added:+.3f}", f"< {ADDED:g}")


def calls(bench: Bench, count: int) -> None:
    """Compare calls of the server with those of libqi."""
    head, body = bench.proxy(PoseHeadPrx, "Head"), bench.proxy(JointsPrx, "Body")
    table = Table(title="Calls over NAOqi, and through naoserver-naoqi: median / 95 % in ms")
    for column in ("", "libqi", "through the server", "added", "required"):
        table.add_column(column, justify="right" if column else "left")
    angle = random.Random(1).uniform
    row(
        table,
        "send the head: until the call returns",
        measured(
            count,
            lambda: call(
                bench.link, "ALMotion.setAngles", ["HeadYaw", "HeadPitch"], [angle(-1, 1), 0.0], 0.1
            ),
        ),
        measured(count, lambda: head.setPose(angle(-1, 1), 0.0, 0.1)),
    )
    row(
        table,
        "read two joints",
        measured(count, lambda: call(bench.link, "ALMotion.getAngles", ["HeadYaw", "HeadPitch"], True)),
        measured(count, head.getPose),
    )
    keys = [f"Device/SubDeviceList/{name}/Position/Sensor/Value" for name in body.getJointNames()]
    row(
        table,
        "read all joints",
        measured(count, lambda: call(bench.link, "ALMemory.getListData", keys)),
        measured(count, body.getJointState),
    )

    def until_it_arrives(send: Callable[[float], object]) -> list[float]:
        begun = {}
        for number in range(count // 4):
            target = round(angle(-1, 1), 6) + number * 1e-9
            begun[target] = time.monotonic()
            send(target)
            time.sleep(0.01)
        return [(bench.arrival_time(target) - begin) * 1000 for target, begin in begun.items()]

    row(
        table,
        "send the head: until the robot has the command",
        until_it_arrives(
            lambda target: call(
                bench.link, "ALMotion.setAngles", ["HeadYaw", "HeadPitch"], [target, 0.0], 0.1
            )
        ),
        until_it_arrives(lambda target: head.setPose(target, 0.0, 0.1)),
    )
    CONSOLE.print(table)


def pictures(bench: Bench, seconds: float) -> None:
    """Count the images of a stream."""
    camera = bench.proxy(CameraPrx, "Camera")
    description = camera.getCameraDescription()
    description.width, description.height, description.rate = 640, 480, RATE
    camera.setCameraDescription(description)
    taken: set[float] = set()
    ages: list[float] = []
    arrived = 0
    end = None
    for sample in camera.getImageData.samples(timeout=10.0):
        now = time.monotonic()
        end = end or now + 1.0 + seconds
        if now > end:
            break
        if now > end - seconds:
            arrived += 1
            taken.add(sample.time)
            ages.append(now - sample.time)
    lost = max(0.0, 1.0 - len(taken) / (RATE * seconds))
    CONSOLE.print(
        f"images of 640x480 in {seconds:g} s at {RATE:g}/s: {arrived} arrived, {len(taken)} different,"
        f" {lost:.1%} lost (required: < {LOST:.0%}); {statistics.median(ages) * 1000:.1f} ms old"
    )


def loss(bench: Bench) -> None:
    """Freeze the robot, and measure when the server reports it."""
    health = bench.proxy(HealthPrx, "Health")
    bench.robot.freeze()
    frozen = time.monotonic()
    try:
        for sample in health.getHealth.samples(timeout=10.0):
            lost = [e for e in sample.value.events if e.level == Severity.Error and "lost" in e.message]
            if lost:
                CONSOLE.print(
                    f"a silent robot was reported as lost after {lost[-1].time - frozen:.2f} s,"
                    f" and was in the health report after {time.monotonic() - frozen:.2f} s"
                    f" (required: < {REPORTED:g} s)"
                )
                return
    finally:
        bench.robot.process.send_signal(signal.SIGCONT)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description="Measure what naoserver-naoqi adds to NAOqi.")
    parser.add_argument("--calls", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--robot", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.robot:
        be_the_robot()
        return
    qi.logging.setLevel(qi.logging.ERROR)
    with processes() as bench:
        calls(bench, options.calls)
        pictures(bench, options.seconds)
        loss(bench)


if __name__ == "__main__":
    main()
