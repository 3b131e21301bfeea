"""Measure tests of behaviors: virtual seconds per second of processor time, and the cost of a call.

python benchmarks/bench_testing.py [--seconds 40]
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.common import options
from naoserver.errors import HardwareFailure
from visualhfsm.simulation._loading import load_component, read
from visualhfsm.testing import Behavior, check_properties
from visualhfsm.testing._abstraction import abstract_component
from visualhfsm.testing._coverage import Hits
from visualhfsm.testing._lines import Lines

ROOT = Path(__file__).resolve().parents[1]
BEHAVIORS = ("follow_ball", "dance", "dance_and_follow")
CALLS = 2000
LINES = Lines()
EXAMPLES = 100


def document(name: str) -> Path:
    """Return a behavior's document."""
    return ROOT / "behaviors" / f"{name}.xml"


def abstract(name: str) -> Behavior:
    """Return a behavior without its code."""
    path = document(name)
    return Behavior(abstract_component(read(path), path)(), document=path)


def fake(name: str) -> Behavior:
    """Return a behavior with the fake robot."""
    return Behavior(load_component(document(name))(), robot="fake", document=document(name))


def covered(name: str) -> Behavior:
    """Return a behavior with the fake robot, with coverage."""
    b = fake(name)
    Hits().watch(lambda: b.document, b.tree)
    return b


def lined(name: str) -> Behavior:
    """Return a behavior with the fake robot, with the lines of its code measured."""
    LINES.begin(None)
    return fake(name)


def drawn(name: str) -> Behavior:
    """Return a behavior with the simulation and drawn images."""
    return Behavior(load_component(document(name))(), robot="sim", camera="drawn", skin=False)


def drawn_lined(name: str) -> Behavior:
    """Return a behavior with the simulation and drawn images, with lines."""
    LINES.begin(None)
    return drawn(name)


def rendered(name: str) -> Behavior:
    """Return a behavior with the simulation and rendered images."""
    return Behavior(load_component(document(name))(), robot="sim", camera="rendered")


KINDS: dict[str, Callable[[str], Behavior]] = {
    "no code": abstract,
    "fake": fake,
    "fake, coverage": covered,
    "fake, lines": lined,
    "sim, drawn": drawn,
    "sim, lines": drawn_lined,
    "sim, rendered": rendered,
}


def pace(make: Callable[[str], Behavior], name: str, seconds: float) -> float:
    """Return the virtual seconds per second, the best of three; of processor time unless GL is involved."""
    clock = time.perf_counter if make is rendered else time.process_time
    best = 0.0
    for _ in range(3):
        b = make(name)
        try:
            if make is rendered:
                b.robot.look()  # GL is set up by the first image
            began = clock()
            b.advance(seconds)
            best = max(best, seconds / (clock() - began))
        finally:
            b.close()
            LINES.pytest_runtest_logstart()  # measures no longer
    return best


def call_cost() -> float:
    """Return the cost of Head.getPose in us."""
    b = fake("follow_ball")
    head = b.component.Head
    began = time.process_time()
    for _ in range(CALLS):
        head.getPose()
    return (time.process_time() - began) / CALLS * 1e6


def property_cost() -> float:
    """Return the cost of a random run of up to 30 steps in ms."""
    began = time.process_time()
    check_properties(document("dance_and_follow"), lambda b: b.time >= 0, examples=EXAMPLES)
    return (time.process_time() - began) / EXAMPLES * 1e3


def main() -> None:
    """Measure and print."""
    arguments = options(__doc__, seconds=40.0)
    table = Table(title="virtual seconds per second")
    table.add_column("behavior")
    for kind in KINDS:
        table.add_column(kind, justify="right")
    figures: dict[str, dict[str, float | None]] = {}
    for name in BEHAVIORS:
        figures[name] = {}
        for kind, make in KINDS.items():
            try:
                figures[name][kind] = pace(make, name, arguments.seconds)
            except HardwareFailure:  # no GL on this machine
                figures[name][kind] = None
        table.add_row(name, *("-" if f is None else f"{f:.0f}" for f in figures[name].values()))
    console = Console()
    console.print(table)
    call, run = call_cost(), property_cost()
    console.print(f"a call within the process: {call:.0f} us; a random run of a document: {run:.1f} ms")


if __name__ == "__main__":
    main()
