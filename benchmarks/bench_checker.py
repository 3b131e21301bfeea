"""Measure the model checker on documents of 200 states in several shapes, each with properties.

`flat` is one automaton; `deep` 20 automata of 10 states, each below the previous one; `parallel` 20 automata
below one state; `tree` 20 automata on three levels. `guards` has only conditions, `timers` timers, `mixed`
both. In `stops` automata restart each time the state above is entered. All periods are `100 ms`, or
`awkward`: five periods without a small common multiple. Five properties are about the first and the last
automata.

    python benchmarks/bench_checker.py [--limit 500000]
"""

from __future__ import annotations

import random
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.common import options
from codegen.hfsm.document import Automaton, Document, Interface, Property, Transition
from codegen.hfsm.model_checker import DEFAULT_LIMIT, Reachability, check_model
from tests.support.model_documents import after, automaton, document, state, stated, when

STATES = 200
ROUNDS = 3
PERIODS = (97, 101, 130, 50, 73)
"""Periods in ms without a small common multiple."""

Leave = Callable[[int, int], Iterator[Transition]]
"""Yields the transitions out of a state, by its number and the number of states."""


def guards(number: int, of: int) -> Iterator[Transition]:
    """Lead to the next state, and back to the first one."""
    yield when(f"g{number}", number, number % of + 1)
    yield when(f"h{number}", number, 1)


def timers(number: int, of: int) -> Iterator[Transition]:
    """Lead to the next state after some time."""
    yield after(700 + 131 * (number % 7), number, number % of + 1)


def mixed(number: int, of: int) -> Iterator[Transition]:
    """Lead to the next state after some time, or to another one by a condition."""
    yield when(f"g{number}", number, (number * 7) % of + 1)
    yield after(2000 + 300 * (number % 5), number, number % of + 1)


def build(shape: str, leave: Leave, periods: tuple[int, ...], history: str = "") -> Document:
    """Return a document of some shape, whose automata all command one servant in their third state."""
    chooser = random.Random(1)
    if shape == "flat":
        owners: list[tuple[int, int]] = [(0, 0)]
        size = STATES
    else:
        size = 10
        owners = [(0, 0)]
        for number in range(2, STATES // size + 1):
            father = {"deep": number - 1, "parallel": 1, "tree": (number + 2) // 4}[shape]
            owners.append((father, 2 if shape == "parallel" else chooser.randint(2, size)))
    children: dict[tuple[int, int], list[int]] = {}
    for number, owner in enumerate(owners, 1):
        children.setdefault(owner, []).append(number)
    automata: list[Automaton] = []
    for number, (father, _) in enumerate(owners, 1):
        states = [
            state(
                each,
                children=children.get((number, each), ()),
                history=history,
                code="self.Head.stop()" if each == 3 else "",
            )
            for each in range(1, size + 1)
        ]
        transitions = [transition for each in range(1, size + 1) for transition in leave(each, size)]
        period = periods[number % len(periods)]
        automata.append(automaton(number, states, transitions, father=father, period=period))
    last = len(owners)
    properties: list[Property] = [
        stated("never", f"#1/s{size} and #{last}/s{size}"),
        stated("always", f"#{last}/s2 -> active(#{last})"),
        stated("eventually", f"#1/s{size}", "60000"),
        stated("never", f"#{max(1, last - 1)}/s{size - 1} and #{last}/s{size - 2}"),
        stated("eventually", f"#{last}/s{size}", "3600000"),
    ]
    return document(*automata, properties=properties, interfaces=(Interface(name="Head", type="PoseHead"),))


def measure(doc: Document, limit: int) -> dict[str, Any]:
    """Return the median time of a check in s, and its results."""
    times = []
    for _ in range(ROUNDS):
        began = time.perf_counter()
        report = check_model(doc, Path("bench.xml"), limit=limit)
        times.append(time.perf_counter() - began)
    states = Counter(result.reachability for result in report.states)
    return {
        "seconds": sorted(times)[ROUNDS // 2],
        "work": report.work,
        "states": len(report.states),
        "possible": states[Reachability.POSSIBLE],
        "impossible": states[Reachability.IMPOSSIBLE],
        "undecided": states[Reachability.UNDECIDED],
        "conflicts": len(report.conflicts),
        "properties": [str(result.verdict) for result in report.properties],
    }


def main() -> None:
    """Print a table."""
    given = options(__doc__, limit=DEFAULT_LIMIT)
    table = Table(title=f"{STATES} states, at most {given.limit} units of work")
    for column in (
        "document",
        "s",
        "work",
        "possible",
        "impossible",
        "undecided",
        "conflicts",
        "properties",
    ):
        table.add_column(column, justify="left" if column in ("document", "properties") else "right")
    found: dict[str, Any] = {}
    kinds: list[tuple[str, Leave, str]] = [
        ("guards", guards, ""),
        ("timers", timers, ""),
        ("mixed", mixed, ""),
        ("stops", mixed, "restart"),
    ]
    for shape in ("flat", "parallel", "tree", "deep"):
        for kind, leave, history in kinds:
            for name, periods in (("100 ms", (100,)), ("awkward", PERIODS)):
                if shape == "flat" and (name == "awkward" or kind == "stops"):
                    continue
                figures = measure(build(shape, leave, periods, history), given.limit)
                found[f"{shape} {kind} {name}"] = figures
                table.add_row(
                    f"{shape} {kind} {name}",
                    f"{figures['seconds']:.2f}",
                    str(figures["work"]),
                    *(str(figures[key]) for key in ("possible", "impossible", "undecided", "conflicts")),
                    " ".join(figures["properties"]),
                )
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
