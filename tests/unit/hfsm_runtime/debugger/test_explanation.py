"""Why an automaton is in its state, in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from hfsm_runtime import Automaton, State, Transition, VirtualRun
from hfsm_runtime._phases import Phase
from hfsm_runtime._timeline import Timeline
from hfsm_runtime.debugger._explanation import explain
from interfaces.hfsm import Explanation
from tests.support.automata import component


@dataclass
class Explained:
    """A run in virtual time that can be asked."""

    root: Automaton
    run: VirtualRun = field(init=False)

    def __post_init__(self) -> None:
        self.run = VirtualRun(component(self.root))
        self.timeline = Timeline(self.run.clock)

    def why(self, automaton: int = 1) -> Explanation:
        found = self.run.tree.actor(automaton)
        assert found is not None
        return explain(self.run.tree, found, self.timeline)

    def reasons(self, automaton: int = 1) -> list[str]:
        return [each.reason for each in self.why(automaton).transitions]


def automaton(*transitions: Transition, **second: object) -> Automaton:
    """Return an automaton with the states a and b, in 10 cycles a second."""
    states = (State(id=1, name="a", initial=True), State(id=2, name="b", **second))  # type: ignore[arg-type]
    return Automaton(id=1, name="walker", states=states, transitions=transitions)


def when(
    id: int, guard: Callable[..., object], origin: int = 1, destination: int = 2, **rest: object
) -> Transition:
    return Transition(
        id=id, name=f"t{id}", origin=origin, destination=destination, guard=guard, condition="ready", **rest  # type: ignore[arg-type]
    )  # fmt: skip


def test_a_guard_reports_its_last_value_and_when_it_was_asked() -> None:
    explained = Explained(automaton(when(1, lambda: False)))
    assert explained.reasons() == ["its guard has not been evaluated since the state was entered"]
    explained.run.advance(0.25)
    (reason,) = explained.why().transitions
    assert (reason.order, reason.asked, reason.value, reason.askedAt) == (1, True, False, 0.2)
    assert reason.reason == "its guard `ready` was false when it was evaluated 0.05 s ago"
    assert explained.why().summary == (
        "walker has been in a for 0.25 s. 1. t1: its guard `ready` was false when it was evaluated 0.05 s ago."
    )


def test_a_guard_reports_what_its_names_stand_for_now() -> None:
    count, path = 3, [1]
    asked = replace(when(1, lambda: count > 5 and path), condition="count > 5 and len(path) < self.limit")
    explained = Explained(automaton(asked))
    explained.run.advance(0.25)
    assert explained.reasons()[0].endswith(
        "was false when it was evaluated 0.05 s ago; now count = 3, path = [1]"
    )


def test_a_timer_reports_what_is_left_and_then_its_guard() -> None:
    explained = Explained(automaton(when(1, lambda: False, seconds=1.0)))
    explained.run.advance(0.3)
    (reason,) = explained.why().transitions
    assert (reason.remaining, reason.reason) == (0.7, "its time comes after 0.70 s more in the state")
    explained.run.advance(1.0)
    assert explained.reasons() == [
        "its guard `ready` was false though its time has come, when it was evaluated 0.00 s ago"
    ]
    assert explained.why().transitions[0].remaining == 0


def test_an_event_is_awaited_or_came_while_its_guard_did_not_hold() -> None:
    explained = Explained(automaton(when(1, lambda event: False, event="lost")))
    explained.run.advance(0.1)
    assert explained.reasons() == ["no event lost has come since the state was entered"]
    explained.run.send("lost")
    explained.run.advance(0.1)
    assert explained.reasons() == ["its guard `ready` was false when lost came 0.00 s ago"]
    explained.run.advance(0.5)
    assert explained.why().transitions[0].asked is False  # not in the last cycle


def test_events_that_wait_and_that_were_dropped_are_reported() -> None:
    explained = Explained(automaton(Transition(id=1, name="t1", origin=1, destination=2, event="lost")))
    explained.run.send("lost")
    assert explained.reasons() == ["the event lost waits in the queue for the next cycle"]
    assert explained.why().summary.endswith(" Waiting events: 1 (lost).")
    explained.run.send("lost")
    explained.run.advance(0.15)
    assert explained.why().summary.endswith(
        " Events dropped: 1, the last one (lost) 0.05 s ago: no transition out of the current state used it."
    )


def test_the_transition_that_comes_first_is_named() -> None:
    explained = Explained(automaton(when(1, lambda: True, destination=1), when(2, lambda: True)))
    explained.run.advance(0.3)
    assert explained.reasons()[1] == "it was not tried: t1, which comes first, fired"
    assert explained.why().enteredBy == 1
    assert "entered by t1" in explained.why().summary


def test_an_automaton_that_restarts_was_enteredBy_no_transition() -> None:
    ready = True
    states = (State(id=1, name="x", initial=True), State(id=2, name="y", final=True))
    child = Automaton(id=2, name="b", states=states, transitions=(when(1, lambda: ready),))
    explained = Explained(automaton(when(1, lambda: True), when(2, lambda: True, 2, 1), children=(child,)))
    explained.run.advance(0.15)
    assert (explained.why(2).state, explained.why(2).enteredBy) == (2, 1)
    ready = False
    explained.run.advance(0.15)
    assert (explained.why(2).state, explained.why(2).enteredBy) == (1, 0)


def test_transitions_are_explained_in_the_order_in_which_they_are_tried() -> None:
    explained = Explained(automaton(when(1, lambda: False), when(2, lambda: False, priority=1)))
    assert [(reason.order, reason.transition) for reason in explained.why().transitions] == [(1, 2), (2, 1)]


def test_a_forced_transition_is_reported() -> None:
    explained = Explained(automaton(when(1, lambda: False)))
    root = explained.run.tree.root
    root.forced = root.automaton.transitions[0]
    assert explained.reasons() == ["it is forced, and fires in the next cycle"]


def test_final_states_and_states_without_a_way_out_say_so() -> None:
    explained = Explained(automaton(when(1, lambda: True), when(2, lambda: True, 2, 1), final=True))
    explained.run.advance(0.2)
    assert explained.reasons() == ["the state is final: no transition is tried"]
    assert "walker has finished in b, entered by t1" in explained.why().summary
    trap = Explained(automaton(when(1, lambda: True)))
    trap.run.advance(0.1)
    assert (
        trap.why().summary
        == "walker has been in b for 0.10 s, entered by t1. No transition leaves the state."
    )


def family(*, final: bool) -> Automaton:
    child = Automaton(
        id=2,
        name="child",
        states=(State(id=1, name="x", initial=True), State(id=2, name="y", final=final)),
        transitions=(Transition("", 1, 2, id=1, seconds=0.5),),
    )
    return Automaton(
        id=1,
        name="walker",
        states=(State(id=1, name="a", initial=True, children=(child,)), State(id=2, name="b")),
        transitions=(
            when(1, lambda: False, finished=True),
            Transition(id=2, name="later", origin=1, destination=2, seconds=2.0),
            Transition(id=3, name="never", origin=2, destination=1, finished=True),
        ),
    )


def test_automata_that_have_not_finished_are_named() -> None:
    explained = Explained(family(final=True))
    assert explained.reasons()[0] == "not all automata of the state have finished: child is in x"
    explained.run.advance(0.8)
    assert explained.reasons()[0] == "its guard `ready` was false when it was evaluated 0.00 s ago"
    explained.run.advance(1.5)
    assert explained.reasons() == ["the state owns no automaton that could finish: it never fires"]


def test_a_ghost_says_which_automaton_above_is_elsewhere() -> None:
    explained = Explained(family(final=False))
    explained.run.advance(2.5)
    ghost = explained.why(2)
    assert ghost.ghost
    assert ghost.summary.startswith(
        "child is a ghost in y: walker is in b, not in a. It has been active there for 1.50 s"
    )


def test_an_automaton_that_waits_for_entry_code_says_so() -> None:
    explained = Explained(automaton(when(1, lambda: True), when(2, lambda: True, 2, 1), entry=lambda: None))
    explained.run.advance(0.1)
    explained.run.tree.root.phase = Phase.OWES_ENTRY
    assert explained.reasons() == ["it is not tried before the entry code of the state has run to its end"]


def test_what_guards_said_is_forgotten_with_the_state() -> None:
    explained = Explained(automaton(when(1, lambda: True), when(1, lambda: False, 2, 1)))
    explained.run.advance(0.0)
    (reason,) = explained.why().transitions
    assert (explained.run.active, reason.askedAt, reason.value) == ("b", -1.0, False)
