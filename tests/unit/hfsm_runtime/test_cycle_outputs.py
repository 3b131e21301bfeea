"""The semantics of outputs, sentence by sentence: what the state above sees of its automata, and when."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hfsm_runtime import Automaton, Output, State, VirtualRun, run
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.errors import DefinitionError
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from tests.support.automata import Code, after, automaton, component, finished, when
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.waiting import until
from zenoh_ice import WallClock
from zenoh_ice.data.exceptions import ConnectionLostException

N = Output(name="n", type=int, default=0)


class Child:
    """An automaton with outputs: its `values` are what its code has assigned."""

    def __init__(self, *outputs: Output, id: int = 2) -> None:
        self.outputs = outputs or (N,)
        self.values: dict[str, object] = {each.name: each.default for each in self.outputs}
        self.id = id

    def of(
        self, *states: State, transitions: tuple[Any, ...] = (), period: float = 0.1, **others: Any
    ) -> Automaton:
        return automaton(
            self.id,
            f"child {self.id}",
            states,
            transitions,
            period,
            outputs=self.outputs,
            set_outputs=self.values.update,
            get_outputs=lambda: dict(self.values),
            **others,
        )

    def counting(self, **others: Any) -> Automaton:
        """Return one whose output `n` is the number of its cycles."""
        return self.of(State(id=1, name="count", code=self.count), **others)

    def count(self) -> None:
        value = self.values["n"]
        assert isinstance(value, int)
        self.values["n"] = value + 1

    def let(self, **values: object) -> Code:
        """Return code that assigns outputs."""
        return lambda: self.values.update(values)


class Above:
    """What the automaton above has taken, and what its code and conditions saw of it."""

    def __init__(self) -> None:
        self.taken: Any = None
        self.seen: list[Any] = []

    def state(self, *children: Automaton, **others: Any) -> State:
        given = {"code": self.look, **others}
        return State(id=1, name="a", children=children, results=self.take, **given)

    def take(self, outputs: Mapping[Any, Any]) -> None:
        self.taken = {
            key: dict(value) if isinstance(value, dict) else value for key, value in outputs.items()
        }

    def look(self) -> None:
        self.seen.append(self.taken)


def ran(root: Automaton, seconds: float, on_error: str = "stop") -> VirtualRun:
    return run(component(root, on_error), seconds)


def test_each_cycle_begins_with_what_the_last_cycle_below_has_left() -> None:
    above = Above()
    ran(automaton(1, "root", [above.state(Child().counting())]), 0.3)
    assert above.seen == [{"n": 0}, {"n": 1}, {"n": 2}, {"n": 3}]


def test_a_condition_sees_it_in_the_cycle_in_which_it_is_taken() -> None:
    above = Above()
    reached = when(lambda: above.taken["n"] == 2, 1, 2)
    virtual = ran(
        automaton(1, "root", [above.state(Child().counting()), State(id=2, name="b")], [reached]), 1
    )
    assert virtual.changes("root") == [(0, "a"), (0.2, "b")]


def test_the_last_outputs_come_with_the_end() -> None:
    child, above = Child(), Above()
    states = [State(id=1, name="x"), State(id=2, name="end", final=True, entry=child.let(n=7))]
    below = child.of(*states, transitions=(after(0.3, 1, 2),))
    done = finished(1, 2, guard=lambda: above.taken["n"] == 7)
    failed = finished(1, 3)
    root = automaton(
        1, "root", [above.state(below), State(id=2, name="b"), State(id=3, name="c")], [done, failed]
    )
    assert ran(root, 1).changes("root") == [(0, "a"), (0.4, "b")]


def entered_again(below: Automaton, above: Above, **others: Any) -> Automaton:
    """Return an automaton that is in `a` for 0.3 s, in `b` for 0.3 s, and so on."""
    states = [above.state(below, **others), State(id=2, name="b")]
    return automaton(1, "root", states, [after(0.3, 1, 2), after(0.3, 2, 1)])


def test_an_automaton_that_resumes_keeps_its_outputs() -> None:
    above = Above()
    ran(entered_again(Child().counting(), above), 0.7)
    assert above.seen == [{"n": n} for n in (0, 1, 2, 3, 4)]


def test_an_automaton_that_starts_again_begins_with_the_defaults() -> None:
    above = Above()
    ran(entered_again(Child().counting(), above, restart=True), 0.7)
    assert above.seen == [{"n": n} for n in (0, 1, 2, 0, 1)]


def test_a_default_is_a_new_value_each_time() -> None:
    child, above = Child(Output(name="way", default=[])), Above()

    def go() -> None:
        way = child.values["way"]
        assert isinstance(way, list)
        way.append(len(way))

    ran(entered_again(child.of(State(id=1, name="x", code=go)), above, restart=True), 0.6)
    assert above.seen[-1] == {"way": []}


def test_the_outputs_of_several_automata_come_by_their_ids() -> None:
    above = Above()
    ran(automaton(1, "root", [above.state(Child().counting(), Child(id=3).counting(period=0.05))]), 0.2)
    assert above.seen[-1] == {2: {"n": 2}, 3: {"n": 4}}


def test_a_grandchild_is_handed_on_cycle_by_cycle() -> None:
    child, above = Child(), Above()
    inner = State(
        id=1,
        name="m",
        children=(Child(id=3).counting(),),
        results=lambda outputs: child.values.update(n=outputs["n"]),  # type: ignore[index]
    )
    ran(automaton(1, "root", [above.state(child.of(inner))]), 0.4)
    assert above.seen == [{"n": n} for n in (0, 0, 1, 2, 3)]


def test_a_cycle_that_fails_hands_nothing_up() -> None:
    child, above = Child(), Above()

    def fail() -> None:
        child.count()
        if child.values["n"] == 2:
            raise ConnectionLostException("gone")  # the cycle ends, and is tried again

    ran(automaton(1, "root", [above.state(child.of(State(id=1, name="x", code=fail)))]), 0.4)
    assert [seen["n"] for seen in above.seen] == [0, 1, 1, 3, 4]


def test_code_that_fails_leaves_what_it_has_assigned_when_errors_are_ignored() -> None:
    child, above = Child(), Above()

    def fail() -> None:
        child.count()
        raise ValueError("no")

    root = automaton(1, "root", [above.state(child.of(State(id=1, name="x", code=fail)))])
    ran(root, 0.2, on_error="continue")
    assert [seen["n"] for seen in above.seen] == [0, 1, 2]


@pytest.mark.parametrize(
    ("type", "value", "taken"),
    [
        (int, np.int64(3), 3),
        (float, 3, 3.0),
        (bool, np.True_, True),
        (str, "red", "red"),
        (object, None, None),
    ],
)
def test_a_value_of_the_right_type_is_taken(type: type, value: object, taken: object) -> None:
    child, above = Child(Output(name="n", type=type, default=value)), Above()
    below = child.of(State(id=1, name="x", code=child.let(n=value)))
    ran(automaton(1, "root", [above.state(below)]), 0.1)
    assert above.seen[-1] == {"n": taken}
    assert above.seen[-1]["n"].__class__ is taken.__class__


@pytest.mark.parametrize(("type", "value"), [(int, 3.0), (bool, 1), (str, None), (float, "3")])
def test_a_value_of_another_type_is_an_error_of_the_automaton_that_assigned_it(
    type: type, value: object
) -> None:
    child, above = Child(Output(name="n", type=type, default=0)), Above()
    below = child.of(State(id=4, name="x", code=child.let(n=value)))
    virtual = ran(automaton(1, "root", [above.state(below)]), 1)
    assert virtual.halted
    (error,) = virtual.errors
    assert (error.automaton, error.state) == (2, 4)
    wanted = f"the output 'n' of automaton 2 ('child 2') is {type.__name__}, not {value.__class__.__name__}: "
    assert wanted in error.message
    assert repr(value) in error.message


def test_a_number_that_is_too_large_for_a_float_is_such_an_error() -> None:
    child, above = Child(Output(name="n", type=float, default=0.0)), Above()
    below = child.of(State(id=4, name="x", code=child.let(n=10**400)))
    (error,) = ran(automaton(1, "root", [above.state(below)]), 1).errors
    assert error.message.startswith(
        "ValueTypeError: the output 'n' of automaton 2 ('child 2') is too large for a float: 1000"
    )


def test_a_wrong_value_is_reported_where_the_code_that_ran_last_assigns_it() -> None:
    value: object = 0

    def other() -> None:
        nonlocal value
        value = "another"

    def fired() -> None:
        nonlocal value
        value = "one"

    states = [State(id=1, name="x"), State(id=2, name="y")]
    transitions = [when(lambda: False, 1, 2, other), when(lambda: True, 1, 2, fired)]
    below = automaton(
        2,
        "child",
        states,
        transitions,
        outputs=(Output(name="value", type=int, default=0),),
        set_outputs=lambda _: None,
        get_outputs=lambda: {"value": value},
    )
    virtual = ran(automaton(1, "root", [Above().state(below)]), 0.2)
    (error,) = virtual.errors
    assert error.location == f"{Path(__file__).name}:{fired.__code__.co_firstlineno + 2}"


def test_the_value_before_stays_when_errors_are_ignored() -> None:
    child, above = Child(), Above()
    values = iter([1, "two", 3, 4])
    below = child.of(State(id=1, name="x", code=lambda: child.values.update(n=next(values))))
    ran(automaton(1, "root", [above.state(below)]), 0.3, on_error="continue")
    assert [seen["n"] for seen in above.seen] == [0, 1, 1, 3]


def test_nobody_looks_at_outputs_that_are_not_taken() -> None:
    child = Child()
    below = child.of(State(id=1, name="x", code=child.let(n="no number")))
    virtual = ran(automaton(1, "root", [State(id=1, name="a", children=(below,))]), 0.2)
    assert virtual.errors == ()


def test_a_cycle_that_pauses_in_between_hands_nothing_up() -> None:
    child, above = Child(), Above()

    class Pause(Observer):
        def entered(self, run: Actor, transition: object) -> bool:
            if run.current.name == "y":
                virtual.pause()
            return run.current.name == "y"

    states = [State(id=1, name="x"), State(id=2, name="y", entry=child.let(n=1), code=child.let(n=2))]
    below = child.of(*states, transitions=(after(0.1, 1, 2),))
    root = automaton(1, "root", [above.state(below)])
    virtual = VirtualRun(component(root), observers=[Pause()])
    virtual.advance(0.1)
    assert virtual.status.name == "Paused"
    virtual.step(1)
    assert above.seen[-1] == {"n": 0}
    virtual.resume()
    virtual.advance(0.3)
    assert above.seen[-1] == {"n": 2}
    assert {"n": 1} not in above.seen


def test_a_step_of_all_automata_takes_what_the_step_before_has_left() -> None:
    above = Above()
    virtual = VirtualRun(component(automaton(1, "root", [above.state(Child().counting())])))
    virtual.advance(0.1)
    virtual.pause()
    for _ in range(2):
        virtual.step(0)
    assert above.seen == [{"n": n} for n in (0, 1, 2, 3)]


def test_outputs_without_the_functions_for_them_are_refused() -> None:
    with pytest.raises(DefinitionError, match=r"automaton 1 .* has outputs, and needs"):
        automaton(1, "root", [State(id=1, name="a")], outputs=(N,))


class Watch(Observer):
    """Notes the times of cycles, and what one automaton saw in its own."""

    def __init__(self, above: Above) -> None:
        self._above = above
        self.below: list[int] = []
        """The times of the cycles of automaton 2."""
        self.seen: list[tuple[int, int]] = []
        """The time of each cycle of automaton 1, and how many of automaton 2 it knew of."""

    def cycle_ended(self, run: Actor, at: int) -> None:
        if run.automaton.id == 2:
            self.below.append(at)
        else:
            self.seen.append((at, self._above.taken["n"]))

    def wrong(self) -> list[tuple[int, int]]:
        """Return the cycles of automaton 1 that did not know of all earlier ones, or of later ones."""
        return [(at, known) for at, known in self.seen if sum(each < at for each in self.below) != known]


@pytest.mark.slow
def test_threads_hand_up_in_the_order_of_the_times_however_long_code_takes() -> None:
    child, above = Child(), Above()

    def slowly() -> None:
        time.sleep(0.015)  # until after the time of the next cycle above
        child.count()

    below = child.of(State(id=1, name="x", code=slowly), period=0.02)
    runtime = Runtime(component(automaton(1, "root", [above.state(below)], period=0.01)), WallClock())
    watch = Watch(above)
    runtime.tree.observers.append(watch)
    runtime.start()
    try:
        until(lambda: len(watch.below) > 20)
    finally:
        runtime.stop()
    # Nobody waits longer than 0.1 s for a thread that the machine does not let run.
    was_stopped = any(later - at > 0.09e9 for (at, _), (later, _) in pairwise(watch.seen))
    assert watch.wrong() == [] or was_stopped


def test_nobody_waits_for_the_outputs_of_code_that_hangs() -> None:
    child, above = Child(), Above()
    hangs, release = threading.Event(), threading.Event()

    def hang() -> None:
        hangs.set()
        release.wait(FOREVER)

    below = child.of(State(id=1, name="x", code=hang), period=0.02)
    runtime = Runtime(component(automaton(1, "root", [above.state(below)], period=0.02)), WallClock())
    runtime.start()
    try:
        assert hangs.wait(EVENT_LIMIT)
        known = len(above.seen)
        until(lambda: len(above.seen) > known + 3)
    finally:
        release.set()
        runtime.stop()


def test_an_end_is_not_seen_before_the_last_outputs_even_while_a_condition_hangs() -> None:
    child, above = Child(), Above()
    ended: list[Any] = []

    def until_the_end() -> bool:
        if above.taken == {"n": 0}:  # so long that the automaton below does not wait any more
            until(lambda: runtime.actor(2).finished)
        return False

    states = [State(id=1, name="x"), State(id=2, name="end", final=True, entry=child.let(n=1))]
    below = child.of(*states, transitions=(after(0.03, 1, 2),), period=0.02)
    left = State(id=2, name="b", entry=lambda: ended.append(above.taken))
    ways = [when(until_the_end, 1, 2), finished(1, 2)]
    runtime = Runtime(
        component(automaton(1, "root", [above.state(below), left], ways, period=0.02)), WallClock()
    )
    runtime.start()
    try:
        until(lambda: bool(ended))
    finally:
        runtime.stop()
    assert ended == [{"n": 1}]
