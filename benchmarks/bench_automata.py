"""Measure automata: jitter of many threads, and the cost of a cycle.

Jitter is the difference between the time from one cycle of an automaton to the next and its period. Each row
is measured in a separate process. `leaves`: a root and its children, all of them active. `ghosts`: a root and
two halves of the other automata, which alternate every 0.5 s. Steps beside those of other libraries are in
`bench_engines.py`.

    python benchmarks/bench_automata.py [--automata 10,100,1000] [--seconds 10]
"""

from __future__ import annotations

import itertools
import multiprocessing
import statistics
import time
from array import array
from collections.abc import Callable, Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.common import options
from codegen.logic import PROOFS
from hfsm_runtime import Automaton, State, Transition, VirtualRun
from hfsm_runtime._cycle import run_cycle
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from tests.support.automata import after, automaton, component, on, when
from zenoh_ice import WallClock

Proofs = tuple[tuple[Any, ...], ...]

PERIOD = 0.1
WARM_UP = 1.0
ROUNDS = 15
STEPS = 20_000


class CycleStarts(Observer):
    """Records when each automaton's cycles start."""

    def __init__(self, runs: tuple[Actor, ...]) -> None:
        self.times: dict[Actor, array[int]] = {run: array("q") for run in runs}

    def cycle_began(self, run: Actor, at: int) -> None:  # noqa: ARG002
        """Record the time."""
        self.times[run].append(time.perf_counter_ns())

    def jitter(self) -> list[float]:
        """Return the deviation of each interval from the period in ms, except pauses as a ghost."""
        found: list[float] = []
        for times in self.times.values():
            intervals = [b - a for a, b in itertools.pairwise(times)]
            found += [abs(i / 1e6 - PERIOD * 1e3) for i in intervals if i < 4 * PERIOD * 1e9]
        return found


def leaves(count: int) -> Automaton:
    children = tuple(leaf(number) for number in range(2, count + 1))
    return automaton(1, "root", [State(id=1, name="a", children=children)], period=PERIOD)


def ghosts(count: int) -> Automaton:
    below = [leaf(number) for number in range(2, count + 1)]
    half = len(below) // 2
    states = [
        State(id=1, name="a", children=tuple(below[:half])),
        State(id=2, name="b", children=tuple(below[half:])),
    ]
    return automaton(1, "root", states, [after(0.5, 1, 2), after(0.5, 2, 1)], period=PERIOD)


def leaf(number: int) -> Automaton:
    """Return an automaton that alternates between two states every second."""
    states = [State(id=1, name="x", code=nothing), State(id=2, name="y", code=nothing)]
    return automaton(number, f"leaf {number}", states, [after(1, 1, 2), after(1, 2, 1)], period=PERIOD)


def nothing() -> None:
    pass


SHAPES: Mapping[str, Callable[[int], Automaton]] = {"leaves": leaves, "ghosts": ghosts}


def measure_jitter(shape: str, count: int, seconds: float) -> dict[str, float]:
    runtime = Runtime(component(SHAPES[shape](count)), WallClock())
    watcher = CycleStarts(runtime.tree.actors)
    runtime.start()
    time.sleep(WARM_UP)
    with runtime.tree.lock:
        runtime.tree.observers.append(watcher)
    cpu, wall = time.process_time(), time.perf_counter()
    cycles = sum(run.cycle.count for run in runtime.tree.actors)
    time.sleep(seconds)
    cycles = sum(run.cycle.count for run in runtime.tree.actors) - cycles
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    runtime.stop()
    jitter = sorted(watcher.jitter())
    active = count if shape == "leaves" else 1 + (count - 1) / 2
    return {
        "p50": jitter[len(jitter) // 2],
        "p99": jitter[len(jitter) * 99 // 100],
        "max": jitter[-1],
        "cycles": cycles / (active * wall / PERIOD),
        "core": cpu / wall,
    }


def measure_cycles() -> dict[str, float]:
    """Return the cost of one cycle in us for several states."""

    def cost(states: list[State], *transitions: Transition, proofs: Proofs = ()) -> float:
        written = component(automaton(1, "root", states, transitions))
        vars(written)[PROOFS] = proofs
        virtual = VirtualRun(written)
        return per_step(lambda: run_cycle(virtual.tree, virtual.tree.root, 0, virtual._supervision))

    here, there = State(id=1, name="a"), State(id=2, name="b")
    both = [when(lambda: False, 1, 2), when(lambda: False, 1, 2)]
    kept: Proofs = (
        ("sent", "go", ()),
        *(("guard", 1, 1, each.id, (("x", True),)) for each in both),
        ("unentered", 1, 2),
        ("property", "stays", "never", 0, False, (1,), ("in", (1, 2))),
    )
    return {
        "two guards": cost([here, there], *both),
        "two guards, and a look at what proofs rely on": cost([here, there], *both, proofs=kept),
        "no transition, no code": cost([here]),
        "one timed transition": cost([here, there], after(10, 1, 2)),
        "a timed transition, an event, three guards": cost(
            [here, there], after(10, 1, 2), on("go", 1, 2), *(when(lambda: False, 1, 2) for _ in range(3))
        ),
    }


def per_step(step: Callable[[], object]) -> float:
    """Return the median time of a step in us."""
    rounds: list[float] = []
    for _ in range(ROUNDS):
        started = time.perf_counter()
        for _ in range(STEPS // 10):
            step()
        rounds.append((time.perf_counter() - started) / (STEPS // 10) * 1e6)
    return statistics.median(rounds)


def main() -> None:
    given = options(__doc__, automata="10,100,300,1000,2000", seconds=10.0)
    console = Console()
    table = Table("what", "us", title="One cycle of one automaton")
    for name, cost in measure_cycles().items():
        table.add_row(name, f"{cost:.2f}")
    console.print(table)
    table = Table(
        "automata", "shape", "p50 ms", "p99 ms", "max ms", "cycles run", "core", title="Jitter at 10 Hz"
    )
    spawn = multiprocessing.get_context("spawn")
    for count in map(int, given.automata.split(",")):
        for shape in SHAPES:
            with spawn.Pool(1) as pool:
                found = pool.apply(measure_jitter, (shape, count, given.seconds))
            table.add_row(
                str(count), shape, *(f"{found[key]:.2f}" for key in ("p50", "p99", "max")),
                f"{found['cycles']:.1%}", f"{found['core']:.0%}",
            )  # fmt: skip
    console.print(table)


if __name__ == "__main__":
    main()
