"""Measure the simulated G1 as its maker's programs see it; needs the extra unitree, and the maker's package.

Prints how many low states a program with the maker's package gets, how long it takes from a low command to
its torque in a low state, and how long an emergency stop takes beside a program that floods both doors.

    python plugins/makers/benchmarks/bench_unitree.py [--seconds 10] [--stops 100]
"""

from __future__ import annotations

import struct
import sys
import time
from collections.abc import Iterator
from typing import Final

import psutil
from cyclonedds._clayer import ddspy_take, ddspy_write
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from benchmarks.common import options
from interfaces.nao import SafetyPrx
from plugins.makers.tests.support.unitree import ELBOW, low_command, on_loopback
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.waiting import until
from visualhfsm_makers._unitree._types import LowCmd, LowState
from zenoh_ice import initialize

STARTS: Final = 60.0  # s
DOMAIN: Final = 97
HEADER: Final = b"\0\1\0\0"
TORQUE: Final = struct.Struct("<f")
TORQUE_AT: Final = 4 + 72 + 56 * ELBOW + 12
"""Where the torque of the elbow is in a low state."""
READER: Final = """
import sys, time
from unitree_sdk2py.core.channel import ChannelFactoryInitialize, ChannelSubscriber
from unitree_sdk2py.idl.unitree_hg.msg.dds_ import LowState_
ticks = []
ChannelFactoryInitialize(int(sys.argv[1]), "lo")
states = ChannelSubscriber("rt/lowstate", LowState_)
states.Init(lambda state: ticks.append((time.perf_counter(), state.tick)), 0)
time.sleep(float(sys.argv[2]))
(begin, first), *_, (end, last) = ticks = ticks[100:]
print("maker's package:", len(ticks), "states,", round(len(ticks) / (end - begin), 1), "a second,",
      (last - first) // 2 + 1 - len(ticks), "lost", flush=True)
"""


def percentile(values: list[float], share: float) -> float:
    """Return the value that a share of them does not exceed."""
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def shown(values: list[float]) -> str:
    """Return median and 99th percentile of some s in ms."""
    return f"median {1e3 * percentile(values, 0.5):.1f} ms, p99 {1e3 * percentile(values, 0.99):.1f} ms"


def latencies(seconds: float) -> Iterator[float]:
    """Yield the s from a command whose torque has another sign to the first state that has it, too."""
    keep = on_loopback(DOMAIN)
    participant = DomainParticipant(DOMAIN)
    writer = DataWriter(participant, Topic(participant, "rt/lowcmd", LowCmd))
    reader = DataReader(participant, Topic(participant, "rt/lowstate", LowState))
    until(lambda: writer.get_matched_subscriptions() and reader.get_matched_publications(), STARTS)
    push = [low_command(ELBOW, 0.0, torque=torque).serialize(use_version_2=False) for torque in (1.0, -1.0)]
    end, side, since = time.perf_counter() + seconds, 0, 0.0
    changed = due = time.perf_counter()
    while (now := time.perf_counter()) < end:
        if now >= due:
            due += 0.002
            ddspy_write(writer._ref, push[side])
        for data, info in ddspy_take(reader._ref, 0x7F, 20):
            if info.valid_data and since and (TORQUE.unpack_from(data, TORQUE_AT)[0] < 0.0) == bool(side):
                yield time.perf_counter() - since
                since, changed = 0.0, time.perf_counter()
        if not since and now - changed > 0.05 + 0.01 * (now % 1.0):
            side, since = 1 - side, time.perf_counter()
            ddspy_write(writer._ref, push[side])
        time.sleep(0.0002)
    del keep


def measure(safety: SafetyPrx, process: psutil.Process, seconds: float, stops: int) -> None:
    """Measure one robot."""
    with ComponentProcess([sys.executable, "-c", READER, str(DOMAIN), str(seconds)]) as reader:
        before = sum(process.cpu_times()[:2])
        print(reader.wait_for("maker's package.*", 2 * seconds + STARTS).group(), end="; ")
        print(f"server {(sum(process.cpu_times()[:2]) - before) / seconds:.0%} of a processor")
    print("low command to torque:", shown([*latencies(seconds)]))
    took = []
    with ComponentProcess(
        module("plugins.makers.tests.support.unitree", str(DOMAIN), "flood", "10")
    ) as flood:
        flood.wait_for("answered 0")
        for _ in range(stops):
            begun = time.perf_counter()
            safety.emergencyStop("a benchmark")
            took.append(time.perf_counter() - begun)
            time.sleep(0.02)
            safety.resetEmergencyStop()
            time.sleep(0.05)
    print("emergency stop beside a flood:", shown(took))


def main() -> None:
    """Start a robot, and measure."""
    given = options(__doc__, seconds=10.0, stops=100)
    endpoint = free_endpoint()
    server = module(
        "naoserver_sim", "--body", "G1", "--unitree", "--dds-domain", str(DOMAIN), "--listen", endpoint
    )
    with (
        ComponentProcess(server) as robot,
        initialize(connect=[endpoint], listen=[], clock="wall", timeout=STARTS) as communicator,
    ):
        safety = SafetyPrx.checkedCast(communicator.stringToProxy("Safety"))
        measure(safety, psutil.Process(robot.process.pid), given.seconds, given.stops)


if __name__ == "__main__":
    main()
