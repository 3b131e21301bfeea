"""Measure how long the reload of a running component takes, and whether automata miss cycles.

A component of 50 states in several active automata is generated and run. Repeatedly one of its automata is
edited and the component is reloaded through its monitor, over Zenoh on loopback. `call` is the duration of
the whole call for its caller, `held` the time in which no cycle could start. A cycle is missed if a slot of
an automaton's schedule has none.

    python benchmarks/bench_reload.py [--states 50] [--automata 5] [--period 0.02] [--reloads 30]
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from hfsm_runtime._runtime import Runtime
from hfsm_runtime.debugger.monitor import Monitor
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from interfaces.hfsm import HfsmMonitorPrx
from tests.support.documents import compile_to, document, load, state, sub, transition
from tests.support.processes import free_endpoint
from zenoh_ice import WallClock, initialize

LIMIT = 0.1
"""The longest time of a reload in s."""


class Slots(Observer):
    """Counts the cycles of each automaton, and the slots without a cycle."""

    def __init__(self) -> None:
        self.cycles: dict[int, int] = defaultdict(int)
        self.missed: dict[int, int] = defaultdict(int)
        self._last: dict[int, int] = {}

    def cycle_began(self, run: Actor, at: int) -> None:
        """Compare with the slot of the previous cycle."""
        number = run.automaton.id
        last = self._last.get(number)
        if last is not None:
            self.missed[number] += round((at - last) / run.automaton.interval) - 1
        self._last[number] = at
        self.cycles[number] += 1


def text(states: int, automata: int, period: float, version: int) -> str:
    """Return a document whose root has one state that owns all other automata; the first one is edited."""
    below = automata - 1
    each = [states // below + (number < states % below) for number in range(below)]
    root_state = state(1, "all", initial=True, child=2).replace(
        "<code>", "".join(f"<child>{number}</child>" for number in range(3, automata + 1)) + "<code>"
    )
    parts = [sub(1, 0, root_state, period=f"{period * 1000:g}")]
    for number, count in enumerate(each, 2):
        edited = f"total += {version}" if number == 2 else "total += 1"
        code = f"count += 1\n{edited}\nhistory.append(count)\ndel history[:-10]"
        found = [
            state(which, f"state {which}", code, initial=which == 1)
            + transition(which, which, which % count + 1, "count % 7 == 0 and total >= 0")
            for which in range(1, count + 1)
        ]
        variables = "count = 0\ntotal = 0\nhistory = []\nlimits = [0.1, 0.2, 0.3]\nname = 'x'"
        parts.append(sub(number, 1, *found, variables=variables, period=f"{period * 1000:g}"))
    return document(*parts)


def measure(states: int, automata: int, period: float, reloads: int, directory: Path) -> bool:
    """Reload a component repeatedly and print the figures; return whether it was fast enough."""
    versions: list[str] = []
    compiles: list[float] = []
    for version in range(reloads, 0, -1):  # in advance, as another process compiles them
        began = time.perf_counter()
        file = compile_to(directory, text(states, automata, period, version), "many")
        compiles.append(time.perf_counter() - began)
        versions.insert(0, file.read_text(encoding="utf-8"))
    lines = len(file.read_text(encoding="utf-8").splitlines())
    endpoint = free_endpoint()
    slots = Slots()
    with (
        initialize(listen=[endpoint], connect=[], clock="wall") as server,
        initialize(connect=[endpoint], clock="wall") as client,
    ):
        runtime = Runtime(load(file), WallClock())
        runtime.tree.observers.append(slots)
        with Monitor(runtime, server):
            runtime.start()
            proxy = HfsmMonitorPrx.checkedCast(client.stringToProxy("Hfsm.many"))
            time.sleep(1.0)
            before = sum(slots.missed.values())
            calls, holds, not_kept = [], [], 0
            for source in versions:
                file.write_text(source, encoding="utf-8")
                began = time.perf_counter()
                report = proxy.reload()
                calls.append(time.perf_counter() - began)
                holds.append(report.held)
                not_kept += len(report.notKept)
                time.sleep(3.3 * period)
            missed = sum(slots.missed.values()) - before
            cycles = sum(slots.cycles.values())
            runtime.stop()
    print(f"{states} states in {automata} automata of {1 / period:g} Hz, {lines} lines; {reloads} reloads")
    for label, values in (("call", calls), ("held", holds), ("compile", compiles)):
        middle, worst = 1000 * statistics.median(values), 1000 * max(values)
        print(f"  {label:8} median {middle:7.2f} ms   worst {worst:7.2f} ms")
    print(f"  {cycles} cycles, {missed} missed during reloads, {before} before; {not_kept} values lost")
    return max(calls) < LIMIT and missed == 0


def main() -> None:
    """Parse the options and measure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--states", type=int, default=50)
    parser.add_argument("--automata", type=int, default=6)
    parser.add_argument("--period", type=float, default=0.02)
    parser.add_argument("--reloads", type=int, default=30)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        fine = measure(options.states, options.automata, options.period, options.reloads, Path(directory))
    print("within the limits" if fine else f"NOT within the limits: {LIMIT:g} s, no missed cycle")
    sys.exit(not fine)


if __name__ == "__main__":
    main()
