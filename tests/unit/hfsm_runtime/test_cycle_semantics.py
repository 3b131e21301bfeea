"""The semantics of automata, sentence by sentence, in virtual time."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from hfsm_runtime import Automaton, Component, State, Transition, VirtualRun, run
from hfsm_runtime.errors import DefinitionError
from hfsm_runtime.tree import ChangeKind
from tests.support.automata import after, automaton, component, when
from zenoh_ice.data.exceptions import ConnectionLostException, ObjectNotExistException, TimeoutException

Code = Callable[[], object]


def two_states(*transitions: Transition, a: Code | None = None, b: Code | None = None) -> Automaton:
    return automaton(1, "root", [State(id=1, name="a", code=a), State(id=2, name="b", code=b)], transitions)


def dance_and_follow() -> Component:
    """The paper's third experiment: the root changes each 10 s, the child of followBall each 8 s."""
    follow = automaton(
        2,
        "followBall",
        [State(id=1, name="red"), State(id=2, name="green")],
        [after(8, 1, 2), after(8, 2, 1)],
    )
    reached = {"right": 0, "left": 0}

    def move(arm: str) -> Code:
        def code() -> None:
            reached[arm] += 1

        return code

    def ten(arm: str) -> Code:
        return lambda: reached[arm] > 0 and reached[arm] % 10 == 0

    dance = automaton(
        3,
        "dance",
        [State(id=1, name="right", code=move("right")), State(id=2, name="left", code=move("left"))],
        [when(ten("right"), 1, 2), when(ten("left"), 2, 1)],
    )
    return component(
        automaton(
            1,
            "root",
            [
                State(id=1, name="followBall", children=(follow,)),
                State(id=2, name="dance", children=(dance,)),
            ],
            [after(10, 1, 2), after(10, 2, 1)],
        )
    )


def test_the_timeline_of_dance_and_follow() -> None:
    virtual = run(dance_and_follow(), 60)
    assert virtual.changes("root") == [
        (0, "followBall"), (10, "dance"), (20, "followBall"), (30, "dance"), (40, "followBall"),
        (50, "dance"), (60, "followBall"),
    ]  # fmt: skip
    assert virtual.changes("followBall") == [(0, "red"), (8, "green"), (26, "red"), (44, "green")]
    ghosts = [
        (change.time, change.state, str(change.kind))
        for change in virtual.trace
        if change.automaton == "followBall" and change.kind is not ChangeKind.ENTERED
    ]
    assert ghosts == [
        (10, "green", "ghost"), (20, "green", "resumed"), (30, "red", "ghost"), (40, "red", "resumed"),
        (50, "green", "ghost"), (60, "green", "resumed"),
    ]  # fmt: skip
    assert virtual.changes("dance")[:3] == [(10, "right"), (11, "left"), (12, "right")]


def test_a_cycle_runs_each_period_from_the_start_on() -> None:
    times: list[float] = []
    virtual = VirtualRun(component(lambda c: automaton(1, "root", [State(id=1, name="a", code=lambda: times.append(c.clock.now()))])))  # fmt: skip
    virtual.advance(0.35)
    assert times == [0, 0.1, 0.2, 0.3]


def test_every_automaton_has_a_period_of_its_own() -> None:
    times: list[float] = []
    virtual: VirtualRun
    child = automaton(
        2, "child", [State(id=1, name="x", code=lambda: times.append(virtual.time))], period=0.25
    )
    virtual = VirtualRun(component(automaton(1, "root", [State(id=1, name="a", children=(child,))])))
    virtual.advance(1)
    assert times == [0, 0.25, 0.5, 0.75, 1.0]


def test_the_first_transition_that_holds_fires_in_document_order() -> None:
    asked: list[str] = []

    def guard(name: str, value: bool) -> Code:
        def code() -> bool:
            asked.append(name)
            return value

        return code

    root = automaton(
        1,
        "root",
        [State(id=1, name="a"), State(id=2, name="b"), State(id=3, name="c")],
        [when(guard("no", False), 1, 2), when(guard("yes", True), 1, 3), when(guard("late", True), 1, 2)],
    )
    virtual = run(component(root), 0)
    assert virtual.active == "c"
    assert asked == ["no", "yes"]


def test_the_state_changes_then_the_transition_runs_then_the_new_state_in_one_cycle() -> None:
    seen: list[tuple[str, str]] = []
    virtual: VirtualRun

    def note(what: str) -> Code:
        return lambda: seen.append((what, virtual.tree.root.current.name))

    root = two_states(
        when(lambda: len(seen) == 1, 1, 2, code=note("fired")), a=note("old"), b=note("new")
    )  # fmt: skip
    virtual = VirtualRun(component(root))
    virtual.advance(0.1)
    assert seen == [("old", "a"), ("fired", "b"), ("new", "b")]


def test_transitions_are_evaluated_before_the_code_of_a_state_runs_for_the_first_time() -> None:
    seen: list[str] = []
    run(
        component(
            two_states(when(lambda: True, 1, 2), a=lambda: seen.append("a"), b=lambda: seen.append("b"))
        ),
        0,
    )
    assert seen == ["b"]


def test_a_guard_holds_when_its_value_is_true_in_python() -> None:
    assert run(component(two_states(when(lambda: [0], 1, 2))), 0).active == "b"
    assert run(component(two_states(when(lambda: "", 1, 2))), 1).active == "a"


@pytest.mark.parametrize(
    ("seconds", "fires"), [(0.25, 0.3), (0.3, 0.3), (0.000000001, 0.1), (2.0, 2.0), (0.1, 0.1)]
)
def test_a_timer_fires_at_the_first_cycle_that_finds_it_over(seconds: float, fires: float) -> None:
    assert run(component(two_states(after(seconds, 1, 2))), 5).changes("root") == [(0, "a"), (fires, "b")]


def test_timers_do_not_drift() -> None:
    changes = run(component(two_states(after(0.7, 1, 2), after(0.7, 2, 1))), 700).changes("root")
    assert [time for time, _ in changes] == [pytest.approx(index * 0.7, abs=1e-9) for index in range(1001)]


def test_a_timer_counts_from_the_entry_and_leaving_by_another_way_resets_it() -> None:
    virtual: VirtualRun
    root = two_states(
        after(1, 1, 2), when(lambda: virtual.time == 0.9, 1, 2), when(lambda: virtual.time == 1.2, 2, 1)
    )
    virtual = VirtualRun(component(root))
    virtual.advance(3)
    assert virtual.changes("root") == [(0, "a"), (0.9, "b"), (1.2, "a"), (2.2, "b")]


def test_a_transition_to_the_same_state_restarts_its_timers() -> None:
    virtual: VirtualRun
    root = two_states(when(lambda: virtual.time == 0.5, 1, 1), after(1, 1, 2))
    virtual = VirtualRun(component(root))
    virtual.advance(3)
    assert virtual.changes("root") == [(0, "a"), (0.5, "a"), (1.5, "b")]


def test_timers_start_when_the_code_of_the_transition_has_run() -> None:
    def root(c: Component) -> Automaton:
        return two_states(when(lambda: True, 1, 2, code=lambda: c.sleep(1.05)), after(0.5, 2, 1))

    virtual = VirtualRun(component(root))
    virtual.advance(1.7)
    assert virtual.changes("root")[:3] == [(0, "a"), (0, "b"), (1.6, "a")]


def three_levels(code: Code = lambda: None) -> Automaton:
    grandchild = automaton(
        3, "grandchild", [State(id=1, name="p", code=code), State(id=2, name="q")], [after(1, 1, 2)]
    )
    child = automaton(
        2,
        "child",
        [State(id=1, name="m", children=(grandchild,)), State(id=2, name="n")],
        [after(5, 1, 2), after(5, 2, 1)],
    )
    return automaton(
        1,
        "root",
        [State(id=1, name="a", children=(child,)), State(id=2, name="b")],
        [after(0.5, 1, 2), after(2, 2, 1)],
    )


def test_no_code_of_a_ghost_runs_at_any_depth() -> None:
    times: list[float] = []
    virtual: VirtualRun
    virtual = VirtualRun(component(three_levels(lambda: times.append(virtual.time))))
    virtual.advance(2.6)
    assert times == [0, 0.1, 0.2, 0.3, 0.4, 2.5, 2.6]


def test_timers_of_ghosts_stand_still_at_every_depth_and_go_on_with_what_they_had_left() -> None:
    virtual = run(component(three_levels()), 26)
    # Active for 0.5 s each 2.5 s. When 1 s and 5 s are over the root changes first, so both fire on resuming.
    assert virtual.changes("grandchild") == [(0, "p"), (5, "q")]
    assert virtual.changes("child") == [(0, "m"), (25, "n")]


def test_a_child_resumes_in_the_state_in_which_it_stopped() -> None:
    child = automaton(2, "child", [State(id=1, name="x"), State(id=2, name="y")], [after(0.3, 1, 2)])
    root = automaton(
        1,
        "root",
        [State(id=1, name="a", children=(child,)), State(id=2, name="b")],
        [after(1, 1, 2), after(1, 2, 1)],
    )
    virtual = VirtualRun(component(root))
    virtual.advance(1.5)
    assert virtual.active == "b"
    virtual.advance(1)
    assert virtual.active == "a/y"


def test_a_parent_that_enters_its_own_state_again_leaves_the_child_where_it_is() -> None:
    child = automaton(2, "child", [State(id=1, name="x"), State(id=2, name="y")], [after(2.5, 1, 2)])
    root = automaton(1, "root", [State(id=1, name="a", children=(child,))], [after(1, 1, 1)])
    virtual = run(component(root), 3)
    assert virtual.changes("root") == [(0, "a"), (1, "a"), (2, "a"), (3, "a")]
    assert virtual.changes("child") == [(0, "x"), (2.5, "y")]


def test_several_children_of_a_state_run_side_by_side() -> None:
    left = automaton(2, "left", [State(id=1, name="x"), State(id=2, name="y")], [after(1, 1, 2)])
    right = automaton(3, "right", [State(id=1, name="x"), State(id=2, name="y")], [after(2, 1, 2)])
    virtual = run(component(automaton(1, "root", [State(id=1, name="a", children=(left, right))])), 3)
    assert virtual.changes("left") == [(0, "x"), (1, "y")]
    assert virtual.changes("right") == [(0, "x"), (2, "y")]


def test_ancestors_run_first_in_virtual_time() -> None:
    order: list[str] = []
    grandchild = automaton(3, "g", [State(id=1, name="z", code=lambda: order.append("grandchild"))])
    child = automaton(
        2, "c", [State(id=1, name="y", code=lambda: order.append("child"), children=(grandchild,))]
    )
    root = automaton(1, "r", [State(id=1, name="x", code=lambda: order.append("root"), children=(child,))])
    run(component(root), 0.1)
    assert order == ["root", "child", "grandchild"] * 2


def test_a_cycle_that_takes_longer_than_its_period_is_counted_and_never_caught_up() -> None:
    began: list[float] = []

    def root(c: Component) -> Automaton:
        def slow() -> None:
            began.append(c.clock.now())
            if len(began) == 3:
                c.sleep(0.35)

        return automaton(1, "root", [State(id=1, name="a", code=slow)])

    virtual = VirtualRun(component(root))
    virtual.advance(1)
    assert began == [0, 0.1, 0.2, 0.6, 0.7, 0.8, 0.9, 1.0]
    assert (virtual.tree.root.cycle.overruns, virtual.tree.root.cycle.count) == (1, 8)


# Errors.


def test_an_exception_halts_the_component_by_default_and_names_its_state() -> None:
    ran: list[str] = []
    root = two_states(when(lambda: ran == ["a"], 1, 2), a=lambda: ran.append("a"), b=lambda: 1 / 0)
    virtual = run(component(root), 1)
    assert virtual.halted
    (error,) = virtual.errors
    assert (error.automaton, error.state, error.time) == (1, 2, 0.1)
    assert error.message == "ZeroDivisionError: division by zero"


def test_nothing_runs_after_the_component_has_halted() -> None:
    ran: list[str] = []
    child = automaton(2, "child", [State(id=1, name="x", code=lambda: ran.append("child"))])
    root = automaton(1, "root", [State(id=1, name="a", code=lambda: 1 / 0, children=(child,))])
    virtual = run(component(root), 1)
    assert (virtual.halted, ran) == (True, [])


def test_with_on_error_continue_a_guard_that_fails_does_not_hold_and_the_rest_goes_on() -> None:
    ran: list[str] = []
    root = two_states(
        when(lambda: 1 / 0, 1, 2), after(0.2, 1, 2, code=lambda: 1 / 0), b=lambda: ran.append("b")
    )
    virtual = run(component(root, on_error="continue"), 0.3)
    assert not virtual.halted
    assert virtual.changes("root") == [(0, "a"), (0.2, "b")]
    assert ran == ["b", "b"]
    assert len(virtual.errors) == 4


def test_a_guard_whose_value_is_neither_true_nor_false_is_an_error_in_the_code() -> None:
    virtual = run(component(two_states(when(lambda: np.array([True, False]), 1, 2))), 1)
    assert virtual.halted
    assert "truth value of an array" in virtual.errors[0].message


@pytest.mark.parametrize("kind", [ConnectionLostException, ObjectNotExistException, TimeoutException])
def test_a_lost_server_leaves_the_cycle_and_is_tried_again(
    kind: type[Exception], caplog: pytest.LogCaptureFixture
) -> None:
    ran: list[float] = []
    virtual: VirtualRun

    def call() -> None:
        if 0.2 <= virtual.time < 0.6:
            raise kind("the server of Head is offline")
        ran.append(virtual.time)

    virtual = VirtualRun(component(two_states(a=call)))
    virtual.advance(0.8)
    assert ran == [0, 0.1, 0.6, 0.7, 0.8]
    assert not virtual.halted
    reported = [record.getMessage() for record in caplog.records if record.name == "written"]
    assert [message.split(";")[-1].strip() for message in reported[:1]] == ["waiting for the server"]
    assert len(reported) == 2
    assert reported[1].startswith("the server is back")


def test_a_guard_that_loses_its_server_keeps_the_state_from_running() -> None:
    def lost() -> None:
        raise ConnectionLostException("gone")

    ran: list[str] = []
    run(component(two_states(when(lost, 1, 2), a=lambda: ran.append("a"))), 1)
    assert ran == []


# Definitions.


def test_an_automaton_runs_ten_cycles_a_second_unless_it_says_otherwise() -> None:
    assert Automaton(id=1, name="root", states=(State(id=1, name="a", initial=True),)).period == 0.1


@pytest.mark.parametrize("initial", [(), (1, 2)])
def test_one_state_is_the_initial_one(initial: tuple[int, ...]) -> None:
    states = tuple(State(id=number, name=str(number), initial=number in initial) for number in (1, 2))
    with pytest.raises(DefinitionError, match="exactly one initial state"):
        Automaton(id=1, name="root", states=states)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: automaton(1, "r", [State(id=1, name="a"), State(id=1, name="b")]), "two states with one id"),
        (lambda: automaton(1, "r", [State(id=1, name="a")], [after(1, 1, 9)]), "do not exist"),
        (lambda: automaton(1, "r", [State(id=1, name="a")], [after(0, 1, 1)]), "positive"),
        (lambda: automaton(1, "r", [State(id=1, name="a")], [after(math.nan, 1, 1)]), "positive"),
        (lambda: automaton(1, "r", [State(id=1, name="a")], period=0), "positive"),
        (lambda: automaton(1, "r", [State(id=1, name="a")], period=math.nan), "positive"),
    ],
)
def test_automata_that_make_no_sense_are_refused(build: Code, words: str) -> None:
    with pytest.raises(DefinitionError, match=words):
        build()
