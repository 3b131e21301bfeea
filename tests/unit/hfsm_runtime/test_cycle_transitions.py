"""The semantics of transitions, sentence by sentence: priorities, guards, events, and those that are forced."""

from __future__ import annotations

import logging
from collections import deque

import pytest

from hfsm_runtime import Automaton, Component, Event, State, Transition, VirtualRun, run
from hfsm_runtime._actor import CAPACITY, DropReason
from hfsm_runtime.errors import DefinitionError, EventError
from tests.support.automata import Code, after, automaton, component, on, when
from zenoh_ice.data.exceptions import ConnectionLostException


def states(*names: str) -> list[State]:
    return [State(id=number, name=name) for number, name in enumerate(names, 1)]


def always() -> bool:
    return True


# Priorities and guards.


@pytest.mark.parametrize(
    ("priorities", "reached"),
    [((None, None), "b"), ((None, 5), "c"), ((2, 1), "c"), ((1, 1), "b"), ((1, None), "b")],
)
def test_transitions_are_tried_by_priority_and_those_without_one_after_them(
    priorities: tuple[int | None, int | None], reached: str
) -> None:
    first, second = priorities
    transitions = [when(always, 1, 2, priority=first), when(always, 1, 3, priority=second)]
    assert run(component(automaton(1, "root", states("a", "b", "c"), transitions)), 0).active == reached


def test_a_timed_transition_with_a_guard_asks_it_once_its_time_is_over() -> None:
    asked: list[float] = []
    virtual: VirtualRun

    def guard() -> bool:
        asked.append(virtual.time)
        return virtual.time >= 0.5

    virtual = VirtualRun(component(automaton(1, "root", states("a", "b"), [after(0.3, 1, 2, guard=guard)])))
    virtual.advance(1)
    assert asked == [0.3, 0.4, 0.5]
    assert virtual.changes("root") == [(0, "a"), (0.5, "b")]


def test_a_forced_transition_fires_whatever_its_guard_says_and_whatever_comes_before_it() -> None:
    seen: list[Event] = []
    transitions = [
        when(always, 1, 2),
        on("go", 1, 3, guard=lambda event: False, code=seen.append),
    ]
    virtual = VirtualRun(component(automaton(1, "root", states("a", "b", "c"), transitions)))
    virtual.tree.root.forced = transitions[1]
    virtual.advance(0)
    assert virtual.active == "c"
    assert seen == [Event("go")]


def test_a_forced_transition_out_of_another_state_is_forgotten() -> None:
    transitions = [when(always, 1, 2), when(lambda: False, 3, 1)]
    virtual = VirtualRun(component(automaton(1, "root", states("a", "b", "c"), transitions)))
    virtual.tree.root.forced = transitions[1]
    virtual.advance(0)
    assert virtual.active == "b"


# Events.


def listener(*transitions: Transition, period: float = 0.1) -> VirtualRun:
    return VirtualRun(component(automaton(1, "root", states("a", "b", "c"), transitions, period)))


def test_an_event_fires_one_transition_in_the_next_cycle() -> None:
    virtual = listener(on("go", 1, 2), on("go", 2, 3))
    virtual.advance(0.05)
    virtual.send("go")
    virtual.advance(1)
    assert virtual.changes("root") == [(0, "a"), (0.1, "b")]


def test_events_that_are_sent_in_a_row_fire_one_transition_a_cycle_in_their_order() -> None:
    seen: list[object] = []
    virtual = listener(
        on("foo", 1, 2, code=lambda event: seen.append(event.data)),
        on("bar", 2, 3, code=lambda event: seen.append(event.data)),
        on("bar", 1, 3, priority=1),
    )
    virtual.advance(0)
    for number, name in enumerate(("foo", "bar")):
        virtual.send(name, number)
    virtual.advance(1)
    assert virtual.changes("root") == [(0, "a"), (0.1, "b"), (0.2, "c")]
    assert seen == [0, 1]


def test_events_that_no_transition_of_the_state_takes_do_not_delay_those_behind_them() -> None:
    virtual = listener(on("refused", 1, 3, guard=lambda event: False), on("go", 1, 2), on("elsewhere", 2, 1))
    virtual.advance(0)
    for name in ("elsewhere", "refused", "elsewhere", "go"):
        virtual.send(name)
    virtual.advance(0.1)
    assert virtual.changes("root") == [(0, "a"), (0.1, "b")]
    assert virtual.tree.root.events.dropped == 3


def test_guards_without_an_event_are_asked_once_a_cycle_however_many_events_wait() -> None:
    asked: list[float] = []

    def guard() -> bool:
        asked.append(virtual.time)
        return False

    virtual: VirtualRun
    virtual = listener(when(guard, 1, 2), on("go", 1, 2, guard=lambda event: bool(event.data == 3)))
    for number in range(1, 4):
        virtual.send("go", number)
    virtual.advance(0)
    assert virtual.active == "b"
    assert asked == [0]


def test_a_transition_without_an_event_that_fires_first_leaves_the_event_to_the_new_state() -> None:
    virtual = listener(when(always, 1, 2), on("go", 1, 1), on("go", 2, 3))
    virtual.send("go")
    virtual.advance(1)
    assert virtual.changes("root") == [(0, "a"), (0, "b"), (0.1, "c")]


def test_entry_code_may_send_several_events() -> None:
    def root(c: Component) -> Automaton:
        def entry() -> None:
            c.send("foo")
            c.send("bar")

        first = State(id=1, name="a", entry=entry)
        return automaton(1, "root", [first, *states("", "b", "c")[1:]], [on("foo", 1, 2), on("bar", 2, 3)])

    assert run(component(root), 1).changes("root") == [(0, "a"), (0.1, "b"), (0.2, "c")]


def test_a_dropped_event_stands_in_the_log_once_for_each_place_and_reason(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    virtual = listener(on("go", 1, 2, guard=lambda event: False))
    for _ in range(5):
        virtual.send("go")
        virtual.advance(0.1)
    assert [record.getMessage() for record in caplog.records] == [
        "root/a: the event 'go' is dropped: no transition out of the current state used it"
    ]
    assert virtual.tree.root.events.dropped == 5
    assert virtual.errors == ()


def test_a_transition_ignores_events_of_other_names() -> None:
    virtual = listener(on("go", 1, 2), on("stop", 1, 3))
    virtual.send("stop")
    virtual.advance(0)
    assert virtual.active == "c"


def test_guard_and_code_get_the_events_of_the_name_one_after_the_other() -> None:
    guarded: list[Event] = []
    coded: list[Event] = []

    def guard(event: Event) -> bool:
        guarded.append(event)
        return bool(event.data != 1)

    virtual = listener(on("go", 1, 2, guard=guard, code=coded.append))
    virtual.advance(0)
    for data in (1, {"place": ["kitchen", 2.5, None, True]}):
        virtual.send("go", data)
    virtual.advance(0.1)
    assert guarded == [Event("go", 1), Event("go", {"place": ["kitchen", 2.5, None, True]})]
    assert coded == guarded[1:]


def test_an_event_whose_guard_does_not_hold_is_dropped() -> None:
    virtual: VirtualRun
    virtual = listener(on("go", 1, 2, guard=lambda event: virtual.time > 0.15))
    virtual.send("go")
    virtual.advance(1)
    assert virtual.active == "a"
    assert virtual.tree.root.events.last_dropped == (Event("go"), DropReason.UNHANDLED, 0)


def test_an_event_of_a_state_reaches_every_active_automaton() -> None:
    def root(c: Component) -> Automaton:
        def sends() -> None:
            if c.clock.now() == 0.3:
                c.send("go")

        above = automaton(2, "listener", states("x", "y"), [on("go", 1, 2)], period=0.1)
        sender = automaton(3, "sender", [State(id=1, name="s", code=sends)], [], period=0.1)
        below = automaton(4, "late", states("x", "y"), [on("go", 1, 2)], period=0.1)
        return automaton(
            1, "root", [State(id=1, name="a", children=(above, sender, below)), *states("", "b")[1:]],
            [on("go", 1, 2)],
        )  # fmt: skip

    virtual = run(component(root), 0.4)
    assert virtual.changes("late") == [
        (0, "x"),
        (0.3, "y"),
    ]  # its cycle of that time comes after the sender's
    assert virtual.changes("root") == [(0, "a"), (0.4, "b")]
    assert virtual.changes("listener") == [(0, "x")]  # the root left before it looked


def test_an_automaton_receives_what_it_sends_itself_in_its_next_cycle() -> None:
    def root(c: Component) -> Automaton:
        first = State(id=1, name="a", code=lambda: c.send("go"))
        return automaton(1, "root", [first, State(id=2, name="b")], [on("go", 1, 2)])

    assert run(component(root), 1).changes("root") == [(0, "a"), (0.1, "b")]


def test_a_ghost_receives_no_events_and_drops_those_that_waited() -> None:
    child = automaton(2, "child", states("x", "y"), [on("go", 1, 2)], period=1)
    root = automaton(
        1,
        "root",
        [State(id=1, name="a", children=(child,)), State(id=2, name="b")],
        [after(0.5, 1, 2), after(0.3, 2, 1)],
    )
    virtual = VirtualRun(component(root))
    for seconds in (0.4, 0.3):
        virtual.advance(seconds)
        virtual.send("go")
    virtual.advance(2)
    assert virtual.changes("child") == [(0, "x")]
    assert virtual.tree.actors[1].events.last_dropped == (Event("go"), DropReason.GHOST, 500_000_000)
    assert virtual.tree.actors[1].events.dropped == 1


def test_children_that_wake_at_a_transition_receive_no_event_sent_before() -> None:
    def root(c: Component) -> Automaton:
        def say(what: str) -> Code:
            return lambda: c.send("go", what)

        heard: list[object] = []
        child = automaton(
            2, "child", states("x", "y"), [on("go", 1, 2, code=lambda event: heard.append(event.data))]
        )
        above = State(id=2, name="b", entry=say("entry"), code=say("code"), children=(child,))
        c.heard = heard  # type: ignore[attr-defined]
        return automaton(1, "root", [State(id=1, name="a"), above], [after(0.2, 1, 2, code=say("fired"))])

    written = component(root)
    run(written, 0.2)
    assert vars(written)["heard"] == ["code"]


def test_a_finished_automaton_receives_no_events() -> None:
    child = automaton(2, "child", [State(id=1, name="x", final=True)], [on("go", 1, 1)])
    virtual = run(component(automaton(1, "root", [State(id=1, name="a", children=(child,))])), 0.1)
    virtual.send("go")
    assert virtual.tree.actors[1].events.waiting == deque()


def test_an_automaton_that_finishes_drops_what_waited() -> None:
    final = [State(id=1, name="x"), State(id=2, name="y", final=True)]
    child = automaton(2, "child", final, [on("go", 1, 2)])
    virtual = VirtualRun(component(automaton(1, "root", [State(id=1, name="a", children=(child,))])))
    for number in range(2):
        virtual.send("go", number)
    virtual.advance(0)
    assert virtual.tree.actors[1].events.last_dropped == (Event("go", 1), DropReason.FINISHED, 0)


def test_of_more_events_than_may_wait_the_oldest_is_dropped_and_that_is_an_error(
    caplog: pytest.LogCaptureFixture,
) -> None:
    virtual = listener(on("first", 1, 2), on("last", 1, 3))
    virtual.send("first")
    for number in range(CAPACITY):
        virtual.send("last", number)
    virtual.advance(0)
    assert virtual.active == "c"
    assert [record.levelno for record in caplog.records] == [logging.ERROR]
    assert "root/a: the event 'first' is dropped: more than 64 events waited" in caplog.text
    assert len(virtual.errors) == 1


def test_the_order_of_transitions_decides_between_events_and_other_transitions() -> None:
    virtual = listener(after(0.1, 1, 2), on("go", 1, 3))
    virtual.advance(0)
    virtual.send("go")
    virtual.advance(0.1)
    assert virtual.active == "b"


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("", None, "an event has a name"),
        ("go", object(), "the data of the event 'go' is a object"),
        ("go", {"a": [0, {1, 2}]}, r"the data of the event 'go'\['a'\]\[1\] is a set"),
        ("go", {1: 2}, "has the key 1: keys are text"),
        ("go", float("nan"), "is nan, which JSON cannot represent"),
    ],
)
def test_an_event_that_json_cannot_represent_is_refused(name: str, data: object, words: str) -> None:
    with pytest.raises(EventError, match=words):
        listener().send(name, data)


def test_data_that_contains_itself_is_refused() -> None:
    data: list[object] = []
    data.append(data)
    with pytest.raises(EventError, match="nested deeper than 32 levels"):
        listener().send("go", data)


def test_the_receiver_does_not_see_what_the_sender_changes_later() -> None:
    seen: list[object] = []
    virtual = listener(on("go", 1, 2, code=lambda event: seen.append(event.data)))
    data = [1]
    virtual.send("go", data)
    data.append(2)
    virtual.advance(0)
    assert seen == [[1]]


def test_events_of_a_cycle_that_a_lost_server_cuts_short_are_handled_when_it_is_back() -> None:
    def lost() -> bool:
        if virtual.time < 0.1:
            raise ConnectionLostException("gone")
        return False

    virtual = listener(when(lost, 1, 2), on("go", 1, 3))
    virtual.send("go")
    virtual.advance(0.1)
    assert virtual.changes("root") == [(0, "a"), (0.1, "c")]


def test_a_guard_that_fails_drops_its_event_when_errors_are_ignored() -> None:
    automata = automaton(1, "root", states("a", "b"), [on("go", 1, 2, guard=lambda event: event.data / 0)])
    virtual = VirtualRun(component(automata), on_error="continue")
    virtual.send("go", 1)
    virtual.advance(0.5)
    assert len(virtual.errors) == 1
    assert virtual.tree.root.events.dropped == 1


# Definitions.


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"event": "go", "finished": True}, "fires by one of"),
        ({"seconds": 1.0, "event": "go"}, "fires by one of"),
        ({}, "needs a time, an event or a guard"),
    ],
)
def test_a_transition_fires_by_one_thing(more: dict[str, object], words: str) -> None:
    with pytest.raises(DefinitionError, match=words):
        automaton(1, "root", states("a", "b"), [Transition("", 1, 2, id=1, **more)])  # type: ignore[arg-type]
