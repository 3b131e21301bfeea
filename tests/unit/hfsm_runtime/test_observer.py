"""Observers: what they are notified of, and when."""

from __future__ import annotations

from hfsm_runtime import Event, State, Transition, VirtualRun
from hfsm_runtime.observer import Observer, Observers
from hfsm_runtime.tree import Actor, ChangeKind
from tests.support.automata import automaton, component, on, when


class Notes(Observer):
    """Records all notifications."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def cycle_began(self, run: Actor, at: int) -> None:
        self.lines.append(
            f"cycle began {at // 1_000_000} {','.join(event.name for event in run.events.waiting)}".strip()
        )

    def guard_evaluated(self, run: Actor, transition: Transition, value: bool, at: int) -> None:
        self.lines.append(
            f"guard {transition.event or 'plain'} {value} in {run.current.name} at {at // 1_000_000}"
        )

    def fired(self, run: Actor, transition: Transition, at: int) -> None:
        self.lines.append(f"fired {transition.event} in {run.current.name}")

    def entered(self, run: Actor, transition: Transition | None) -> bool:
        self.lines.append(f"may pause in {run.current.name} after {transition.event if transition else None}")
        return False

    def cycle_ended(self, run: Actor, at: int) -> None:
        self.lines.append(f"cycle ended {at // 1_000_000}")

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:
        self.lines.append(f"{kind} {run.current.name}")

    def event_sent(self, event: Event, now: int) -> None:
        self.lines.append(f"sent {event.name} {event.data}")

    def code_failed(self, run: Actor, error: Exception) -> None:
        self.lines.append(f"failed in {run.current.name}: {error}")


def test_an_observer_is_notified_of_all_that_happens_in_its_order() -> None:
    notes = Notes()
    child = automaton(2, "child", [State(id=1, name="x", final=True)], period=60)
    states = [
        State(id=1, name="a", exit=lambda: notes.lines.append("exit")),
        State(id=2, name="b", code=lambda: 1 / 0, children=(child,)),
    ]
    transitions = [when(lambda: False, 1, 2), on("go", 1, 2, guard=lambda event: True)]
    virtual = VirtualRun(component(automaton(1, "root", states, transitions)))
    virtual.tree.observers.append(notes)
    virtual.tree.observers.append(Observer())
    virtual.advance(0)
    virtual.send("go", 7)
    virtual.advance(0.1)
    assert notes.lines == [
        "cycle began 0",
        "may pause in a after None",
        "guard plain False in a at 0",
        "cycle ended 0",
        "sent go 7",
        "cycle began 100 go",
        "guard plain False in a at 100",
        "guard go True in a at 100",
        "fired go in a",
        "exit",
        "entered b",
        "entered x",
        "may pause in b after go",
        "failed in b: division by zero",
        "cycle ended 100",
    ]


def test_an_observer_is_notified_of_ghosts_and_of_those_that_have_finished() -> None:
    notes = Notes()
    child = automaton(2, "child", [State(id=1, name="x", final=True)])
    states = [State(id=1, name="a", children=(child,)), State(id=2, name="b")]
    virtual = VirtualRun(component(automaton(1, "root", states, [when(lambda: virtual.time == 0.1, 1, 2)])))
    virtual.tree.observers.append(notes)
    virtual.advance(0.1)
    changes = [line for line in notes.lines if line.split()[0] in set(ChangeKind)]
    assert changes == ["finished x", "ghost x", "entered b"]


def test_an_observer_pauses_where_a_state_is_entered_and_its_code_runs_in_the_next_cycle() -> None:
    class Stop(Observer):
        def entered(self, run: Actor, transition: Transition | None) -> bool:
            return run.current.name == "b"

    ran: list[float] = []
    states = [State(id=1, name="a"), State(id=2, name="b", code=lambda: ran.append(virtual.time))]
    virtual = VirtualRun(component(automaton(1, "root", states, [when(lambda: True, 1, 2)])))
    virtual.tree.observers.append(Stop())
    virtual.tree.observers.append(Observer())
    virtual.advance(0.1)
    assert virtual.active == "b"
    assert ran == [0.1]


class Entries(Observer):
    """Notes the transitions after which the entry of a state was reported; None is the first entry."""

    def __init__(self) -> None:
        self.transitions: list[str | None] = []

    def entered(self, run: Actor, transition: Transition | None) -> bool:
        self.transitions.append(transition.name if transition else None)
        return False


def test_a_cycle_that_became_a_ghosts_reports_no_entry() -> None:
    entries = Entries()

    def becomes_a_ghost() -> bool:
        return virtual.tree.leave(virtual.tree.root, 0)

    states = [State(id=1, name="x"), State(id=2, name="y")]
    child = automaton(2, "child", states, [when(becomes_a_ghost, 1, 2, name="never made")])
    virtual = VirtualRun(component(automaton(1, "root", [State(id=1, name="a", children=(child,))])))
    virtual.tree.observers.append(entries)
    virtual.advance(0)
    assert entries.transitions == [None, None]


def test_a_cycle_that_outlived_its_activation_reports_no_entry() -> None:
    entries = Entries()

    def becomes_a_ghost_and_wakes() -> None:
        virtual.tree.leave(virtual.tree.root, 0)
        virtual.tree.enter(virtual.tree.root, 0)

    states = [State(id=1, name="x", exit=becomes_a_ghost_and_wakes), State(id=2, name="y")]
    child = automaton(2, "child", states, [when(lambda: True, 1, 2, name="never made")])
    virtual = VirtualRun(component(automaton(1, "root", [State(id=1, name="a", children=(child,))])))
    virtual.tree.observers.append(entries)
    virtual.advance(0)
    assert entries.transitions == [None, None]


def test_a_cycle_that_continues_after_a_pause_has_the_events_of_the_one_before() -> None:
    class PauseOnce(Observer):
        paused = False

        def entered(self, run: Actor, transition: Transition | None) -> bool:
            first, self.paused = not self.paused, True
            return first

    states = [State(id=1, name="a"), State(id=2, name="b")]
    virtual = VirtualRun(component(automaton(1, "root", states, [on("go", 1, 2)])))
    virtual.tree.observers.append(PauseOnce())
    virtual.advance(0)
    virtual.send("go")
    virtual.advance(0.1)
    assert virtual.active == "a"
    virtual.advance(0.1)
    assert virtual.active == "b"


def test_only_the_hooks_that_an_observer_overrides_are_called() -> None:
    observers = Observers()
    assert not Observers().fired
    one, other = Notes(), Notes()
    for each in (one, Observer(), other):
        observers.append(each)
    assert observers.fired == (one.fired, other.fired)
    assert observers.proof_failed == ()
