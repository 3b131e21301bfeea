"""Measure what a client costs a simulated robot that commands all joints with gains 500 times a second.

Prints the processor time of the robot's server while nobody commands, and beside that client; how many
commands were answered in a second; and how long a call took.

    python benchmarks/bench_gains.py [--body G1] [--rate 500] [--seconds 10]
"""

from __future__ import annotations

import statistics
import time
from typing import Final

import psutil

from benchmarks.common import options
from interfaces.nao import JointCommand, JointsPrx
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import initialize

STARTS: Final = 60.0  # s


def percentile(values: list[float], share: float) -> float:
    """Return the value that a share of them does not exceed."""
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def measure(body: JointsPrx, process: psutil.Process, rate: float, seconds: float) -> None:
    """Measure one robot and print its row."""
    times = process.cpu_times
    before, begun = sum(times()[:2]), time.perf_counter()
    time.sleep(seconds)
    idle = (sum(times()[:2]) - before) / (time.perf_counter() - begun)
    state, names = body.getJointState(), body.getJointNames()
    commands = {
        name: JointCommand(position=at, kp=300.0, kd=5.0)
        for name, at in zip(names, state.positions, strict=True)
    }
    calls: list[float] = []
    before, begun = sum(times()[:2]), time.perf_counter()
    while time.perf_counter() - begun < seconds:
        called = time.perf_counter()
        body.setJointCommands(commands)
        calls.append(time.perf_counter() - called)
        time.sleep(max(0.0, len(calls) / rate - (time.perf_counter() - begun)))
    took = time.perf_counter() - begun
    busy = (sum(times()[:2]) - before) / took
    print(
        f"{len(names)} joints, {len(calls) / took:.0f} commands a second, a call took"
        f" {1e3 * statistics.median(calls):.2f} ms (p99 {1e3 * percentile(calls, 0.99):.2f});"
        f" server {busy:.1%} of a processor, {idle:.1%} without: {busy - idle:.1%}"
    )


def main() -> None:
    """Start a robot, and measure."""
    given = options(__doc__, body="G1", rate=500.0, seconds=10.0)
    endpoint = free_endpoint()
    server = module("naoserver_sim", "--body", given.body, "--listen", endpoint)
    with (
        ComponentProcess(server) as robot,
        initialize(connect=[endpoint], listen=[], clock="wall", timeout=STARTS) as communicator,
    ):
        body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
        measure(body, psutil.Process(robot.process.pid), given.rate, given.seconds)


if __name__ == "__main__":
    main()
