"""Measure engines of state machines in Python, in virtual time: transitions and machines a second.

The scenarios are those of https://github.com/basiltt/xstate-statemachine/issues/64. An event is sent and
handled before the next one is sent; `queued` sends fifty at a time. `guard` has a guard and an action,
`nested` two states with two levels below each, `parallel` two regions that take turns, `timer` two timers of
1 ms, and `built` makes the machine of `nested`. Each engine runs in separate processes, all in turn, and
the best of many short measurements counts, in processor time: other programs slow all of them down.

    pip install -e '.[bench]'
    python benchmarks/bench_engines.py [--rounds 3] [--peers PYTHON]
"""

from __future__ import annotations

import argparse
import gc
import json
import logging
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from importlib.metadata import version
from itertools import permutations
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parents[1]
OURS: Final = "visualhfsm"
COUNT: Final = 200
"""Transitions of one measurement; a tenth as many machines are built."""
REPEATED: Final = 40

Run = Callable[[int], object]
"""Makes a number of transitions, or of machines."""
Makers = Mapping[str, Callable[[], Run]]
Peer = Any
"""An object of another library."""


def sender(send: Callable[[str], object], parallel: bool = False) -> Run:
    """Return what sends the event of a scenario a number of times."""

    def run(count: int) -> None:
        for number in range(count):
            send("t2" if parallel and number % 2 else "t1")

    return run


def repeated(action: Callable[[], object]) -> Run:
    """Return what does something a number of times."""

    def run(count: int) -> None:
        for _ in range(count):
            action()

    return run


# Ours: documents, whose generated components run as tests run them.


def state(number: int, below: str = "") -> str:
    """Return a state of a document, with the ids of the automata below it."""
    first = str(number == 1).lower()
    return f'<state id="{number}" initial="{first}"><name>s{number}</name>{below}</state>'


def transition(origin: int, destination: int, kind: str, value: str, more: str = "<transcode/>") -> str:
    """Return a transition of a document."""
    return (
        f'<transition id="{origin}"><origin>{origin}</origin><destiny>{destination}</destiny>'
        f'<name>t{origin}</name><trans type="{kind}">{value}</trans>{more}</transition>'
    )


def automaton(number: int, father: int, parts: str, variables: str = "") -> str:
    """Return an automaton of a document, with a period of 1 ms."""
    return (
        f'<SubAutomata id="{number}" idFather="{father}">{parts}<iteration_time>1</iteration_time>'
        f"<variables>{variables}</variables></SubAutomata>"
    )


def two(kind: str, value: str, first: str = "", second: str = "") -> str:
    """Return two states, and a transition from each to the other one."""
    ways = transition(1, 2, kind, value) + transition(2, 1, kind, value)
    return state(1, first) + state(2, second) + ways


def owned(*automata: int) -> str:
    """Return what names the automata that a state owns; they start again each time it is entered."""
    first, *others = automata
    others_too = "".join(f"<child>{each}</child>" for each in others)
    return f"<idSubautomataSon>{first}</idSubautomataSon>{others_too}<history>restart</history>"


DOCUMENTS: Final = {
    "flat": automaton(1, 0, two("event", "t1")),
    "guard": automaton(
        1, 0,
        state(1) + transition(1, 1, "event", "t1", "<guard>n >= 0</guard><transcode>n += 1</transcode>"),
        "n = 0",
    ),
    "nested": automaton(1, 0, two("event", "t1", owned(2), owned(4)))
    + "".join(
        automaton(number, number - 1 if number % 2 else 1, state(1, below))
        for number, below in ((2, owned(3)), (3, ""), (4, owned(5)), (5, ""))
    ),
    "parallel": automaton(1, 0, state(1, owned(2, 3)))
    + automaton(2, 1, two("event", "t1")) + automaton(3, 1, two("event", "t2")),
    "timer": automaton(1, 0, two("time", "1")),
}  # fmt: skip


def ours() -> Makers:
    """Return the scenarios of this project."""
    sys.path.insert(0, str(ROOT))
    from hfsm_runtime import Component
    from visualhfsm.simulation import Behavior, load_component

    def component(name: str) -> type[Component]:
        text = DOCUMENTS[name].replace(">=", "&gt;=")
        events = "".join(f"<event><name>{event}</name></event>" for event in ("t1", "t2"))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"machine_{name}.xml"
            path.write_text(f"<VisualHFSM><events>{events}</events>{text}</VisualHFSM>", encoding="utf-8")
            return load_component(path)

    def started(name: str) -> Behavior:
        b = Behavior(component(name)())
        b.advance(0.01)
        return b

    def sends(name: str, parallel: bool = False) -> Run:
        b = started(name)

        def send(event: str) -> None:
            b.send(event)
            b.advance(0.001)

        return sender(send, parallel)

    def queued() -> Run:
        b = started("flat")

        def run(count: int) -> None:
            for _ in range(count // 50):
                for _ in range(50):
                    b.send("t1")
                b.advance(0.05)

        return run

    def timer() -> Run:
        b = started("timer")
        return lambda count: b.advance(count / 1000)

    def built() -> Run:
        made = component("nested")
        return repeated(lambda: Behavior(made()).close())

    return {
        "flat": lambda: sends("flat"),
        "queued": queued,
        "guard": lambda: sends("guard"),
        "nested": lambda: sends("nested"),
        "parallel": lambda: sends("parallel", parallel=True),
        "timer": timer,
        "built": built,
    }


# The peers.


class Counter:
    """The model of `guard`."""

    n = 0

    def may(self) -> bool:
        """Return True."""
        return self.n >= 0

    def count(self) -> None:
        """Count a transition."""
        self.n += 1


def transitions() -> Makers:
    """Return the scenarios of transitions."""
    from transitions import Machine
    from transitions.extensions import HierarchicalMachine

    def level(name: str) -> dict[str, Any]:
        below = {"name": "x", "initial": "y", "children": ["y"]}
        return {"name": name, "initial": "x", "children": [below]}

    def region(name: str, event: str) -> dict[str, Any]:
        ways = [[event, "a", "b"], [event, "b", "a"]]
        return {"name": name, "initial": "a", "children": ["a", "b"], "transitions": ways}

    def nested() -> Peer:
        model: Any = Counter()
        ways = [["t1", "a", "b"], ["t1", "b", "a"]]
        HierarchicalMachine(model, states=[level("a"), level("b")], transitions=ways, initial="a")
        return model

    def flat() -> Run:
        model: Any = Counter()
        Machine(model, states=["a", "b"], transitions=[["t1", "a", "b"], ["t1", "b", "a"]], initial="a")
        return repeated(model.t1)

    def guard() -> Run:
        model: Any = Counter()
        way = {"trigger": "t1", "source": "a", "dest": "a", "conditions": "may", "after": "count"}
        Machine(model, states=["a"], transitions=[way], initial="a")
        return repeated(model.t1)

    def parallel() -> Run:
        model: Any = Counter()
        both = {"name": "p", "parallel": [region("l", "t1"), region("r", "t2")]}
        HierarchicalMachine(model, states=[both], initial="p")
        return sender(lambda event: getattr(model, event)(), parallel=True)

    return {
        "flat": flat,
        "guard": guard,
        "nested": lambda: repeated(nested().t1),
        "parallel": parallel,
        "built": lambda: repeated(nested),
    }


def python_statemachine() -> Makers:
    """Return the scenarios of python-statemachine."""
    from statemachine import State, StateChart

    class Flat(StateChart):  # type: ignore[misc]
        a = State(initial=True)
        b = State()
        t1 = a.to(b) | b.to(a)

    class Guard(StateChart):  # type: ignore[misc]
        a = State(initial=True)
        t1 = a.to.itself(cond="may", on="count")
        n, may, count = 0, Counter.may, Counter.count

    class Nested(StateChart):  # type: ignore[misc]
        class a(State.Compound):  # type: ignore[misc]  # noqa: N801
            class ax(State.Compound):  # type: ignore[misc]  # noqa: N801
                ay = State(initial=True)

        class b(State.Compound):  # type: ignore[misc]  # noqa: N801
            class bx(State.Compound):  # type: ignore[misc]  # noqa: N801
                by = State(initial=True)

        t1 = a.to(b) | b.to(a)

    class Parallel(StateChart):  # type: ignore[misc]
        class p(State.Parallel):  # type: ignore[misc]  # noqa: N801
            class left(State.Compound):  # type: ignore[misc]  # noqa: N801
                la = State(initial=True)
                lb = State()
                t1 = la.to(lb) | lb.to(la)

            class right(State.Compound):  # type: ignore[misc]  # noqa: N801
                ra = State(initial=True)
                rb = State()
                t2 = ra.to(rb) | rb.to(ra)

    return {
        "flat": lambda: sender(Flat().send),
        "guard": lambda: sender(Guard().send),
        "nested": lambda: sender(Nested().send),
        "parallel": lambda: sender(Parallel().send, parallel=True),
        "built": lambda: repeated(Nested),
    }


def sismic() -> Makers:
    """Return the scenarios of Sismic."""
    from sismic.interpreter import Interpreter
    from sismic.io import import_from_yaml

    def ways(event: str, names: str = "ab") -> list[dict[str, Any]]:
        return [
            {"name": name, "transitions": [{"target": other, "event": event}]}
            for name, other in permutations(names)
        ]

    def timed(name: str, other: str) -> dict[str, Any]:
        return {"name": name, "transitions": [{"target": other, "guard": "after(0.001)"}]}

    def level(name: str, other: str) -> dict[str, Any]:
        below = {"name": f"{name}x", "initial": f"{name}y", "states": [{"name": f"{name}y"}]}
        to = {"target": other, "event": "t1"}
        return {"name": name, "initial": f"{name}x", "transitions": [to], "states": [below]}

    loop = {"target": "a", "event": "t1", "guard": "n >= 0", "action": "n += 1"}
    roots: dict[str, dict[str, Any]] = {
        "flat": {"initial": "a", "states": ways("t1")},
        "guard": {"initial": "a", "states": [{"name": "a", "transitions": [loop]}]},
        "nested": {"initial": "a", "states": [level("a", "b"), level("b", "a")]},
        "parallel": {
            "parallel states": [
                {"name": "l", "initial": "a", "states": ways("t1")},
                {"name": "r", "initial": "c", "states": ways("t2", "cd")},
            ]
        },
        "timer": {"initial": "a", "states": [timed("a", "b"), timed("b", "a")]},
    }

    def started(name: str) -> Peer:
        chart = {"name": name, "preamble": "n = 0", "root state": {"name": "root", **roots[name]}}
        interpreter = Interpreter(import_from_yaml(json.dumps({"statechart": chart})))
        interpreter.execute()
        return interpreter

    def sends(name: str, parallel: bool = False) -> Run:
        interpreter = started(name)
        return sender(lambda event: interpreter.queue(event).execute(), parallel)

    def timer() -> Run:
        interpreter = started("timer")

        def move() -> None:
            interpreter.clock.time += 0.0011
            interpreter.execute()

        return repeated(move)

    return {
        "flat": lambda: sends("flat"),
        "guard": lambda: sends("guard"),
        "nested": lambda: sends("nested"),
        "parallel": lambda: sends("parallel", parallel=True),
        "timer": timer,
        "built": lambda: repeated(lambda: started("nested")),
    }


def xstate_statemachine() -> Makers:
    """Return the scenarios of xstate-statemachine."""
    from xstate_statemachine import MachineLogic, SimulatedClock, SyncInterpreter, create_machine

    def ways(event: str) -> dict[str, Any]:
        return {"initial": "a", "states": {"a": {"on": {event: "b"}}, "b": {"on": {event: "a"}}}}

    def level(other: str) -> dict[str, Any]:
        below = {"x": {"initial": "y", "states": {"y": {}}}}
        return {"initial": "x", "on": {"t1": other}, "states": below}

    def count(_interpreter: Peer, context: dict[str, int], *_: object) -> None:
        context["n"] += 1

    loop = {"target": "a", "guard": "may", "actions": "count"}
    machines: dict[str, dict[str, Any]] = {
        "flat": ways("t1"),
        "guard": {"initial": "a", "context": {"n": 0}, "states": {"a": {"on": {"t1": loop}}}},
        "nested": {"initial": "a", "states": {"a": level("b"), "b": level("a")}},
        "parallel": {"type": "parallel", "states": {"l": ways("t1"), "r": ways("t2")}},
        "timer": {"initial": "a", "states": {"a": {"after": {1: "b"}}, "b": {"after": {1: "a"}}}},
    }
    logic = MachineLogic(guards={"may": lambda context, _: context["n"] >= 0}, actions={"count": count})

    def started(name: str, **options: Peer) -> Peer:
        machine = create_machine({"id": "m", **machines[name]}, logic=logic if name == "guard" else None)
        return SyncInterpreter(machine, **options).start()

    def timer() -> Run:
        clock = SimulatedClock()
        interpreter = started("timer", clock=clock)

        def move() -> None:
            clock.increment(2)
            interpreter.tick()

        return repeated(move)

    return {
        "flat": lambda: sender(started("flat").send),
        "guard": lambda: sender(started("guard").send),
        "nested": lambda: sender(started("nested").send),
        "parallel": lambda: sender(started("parallel").send, parallel=True),
        "timer": timer,
        "built": lambda: repeated(lambda: started("nested")),
    }


ENGINES: Final[Mapping[str, Callable[[], Makers]]] = {
    "transitions": transitions,
    "python-statemachine": python_statemachine,
    "sismic": sismic,
    "xstate-statemachine": xstate_statemachine,
    OURS: ours,
}


def measure(makers: Makers) -> dict[str, float]:
    """Return how often each scenario of an engine happens in a second of processor time."""
    rates = {}
    for name, make in makers.items():
        run, count = make(), COUNT // 10 if name == "built" else COUNT
        run(50)
        best = float("inf")
        for _ in range(REPEATED):
            gc.collect()
            gc.disable()
            began = time.process_time()
            run(count)
            best = min(best, time.process_time() - began)
            gc.enable()
        rates[name] = count / best
    return rates


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=3, help="processes of each engine, in turn")
    parser.add_argument("--peers", default=sys.executable, help="the Python that has the other libraries")
    parser.add_argument("--engine", choices=ENGINES, help="measure only this one, in this process")
    arguments = parser.parse_args()
    if arguments.engine:
        logging.disable()
        print(json.dumps([version(arguments.engine), measure(ENGINES[arguments.engine]())]))
        return
    from rich.console import Console
    from rich.table import Table

    found: dict[str, dict[str, float]] = {name: {} for name in ENGINES}
    versions = {}
    for _ in range(arguments.rounds):
        for engine in tuple(found):
            python = sys.executable if engine == OURS else arguments.peers
            command = [python, __file__, "--engine", engine]
            done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=600)
            if done.returncode:
                why = done.stderr.strip().splitlines()[-1]
                print(f"{engine} is skipped: {why}: pip install -e '.[bench]'", file=sys.stderr)
                del found[engine]
                continue
            versions[engine], rates = json.loads(done.stdout)
            for name, rate in rates.items():
                found[engine][name] = max(rate, found[engine].get(name, 0.0))
    our = found.pop(OURS)
    heads = [f"{name} {versions[name]}" for name in found]
    table = Table("", *heads, OURS, "ours / best", title="Transitions, or machines built, a CPU second")
    for name, rate in our.items():
        rates = [peer.get(name, 0.0) for peer in found.values()]
        ratio = f"{rate / max(rates):.2f}" if any(rates) else "-"
        table.add_row(name, *(f"{each:,.0f}" if each else "-" for each in [*rates, rate]), ratio)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
