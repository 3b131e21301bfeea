"""The tree of automata: who may run a cycle, and what the tree knows of itself."""

from __future__ import annotations

import threading

import pytest

from hfsm_runtime import Automaton, Event, State, Transition
from hfsm_runtime._actor import CAPACITY, Actor
from hfsm_runtime.errors import DefinitionError, UnknownElementError
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import ChangeKind, Phase, Tree
from tests.support.automata import after, automaton, on
from tests.support.limits import EVENT_LIMIT


def started() -> Tree:
    child = automaton(2, "child", [State(id=1, name="x")])
    other = automaton(3, "other", [State(id=1, name="x")])
    states = [State(id=1, name="a", children=(child,)), State(id=2, name="b", children=(other,))]
    tree = Tree(automaton(1, "root", states))
    tree.start(0)
    return tree


def test_a_ghost_begins_no_cycle() -> None:
    tree = started()
    assert [tree.begin_cycle(run) for run in tree.actors] == [True, True, False]


def test_while_the_tree_is_held_no_cycle_begins_but_one_of_an_automaton_that_is_to_step() -> None:
    tree = started()
    tree.held = True
    assert not tree.begin_cycle(tree.root)
    tree.root.stepping = True
    assert tree.begin_cycle(tree.root)
    assert tree.may_go_on(tree.root)
    tree.end_cycle(tree.root)
    assert not tree.begin_cycle(tree.root)


def test_a_running_cycle_is_to_end_early_when_the_tree_is_held() -> None:
    tree = started()
    assert tree.begin_cycle(tree.root)
    assert tree.may_go_on(tree.root)
    tree.held = True
    assert not tree.may_go_on(tree.root)


def test_automata_are_found_by_their_ids() -> None:
    tree = started()
    assert [tree.actor(number) for number in (1, 2, 3, 4)] == [*tree.actors, None]


def test_two_automata_of_one_id_are_refused() -> None:
    child = automaton(1, "child", [State(id=1, name="x")])
    with pytest.raises(DefinitionError, match="two automata have one id"):
        Tree(automaton(1, "root", [State(id=1, name="a", children=(child,))]))


def nested() -> Tree:
    """Root with two states; `there` owns an automaton with two states, and restarts each time."""
    child = automaton(2, "child", [State(id=1, name="a"), State(id=2, name="b")], [after(1.0, 2, 1)])
    states = [State(id=1, name="here"), State(id=2, name="there", children=(child,), restart=True)]
    return Tree(automaton(1, "root", states, [after(1.0, 2, 1), after(1.0, 1, 2)]))


def test_a_state_that_is_begun_at_is_the_first_one_with_those_above() -> None:
    tree = nested()
    tree.begin_at(2, 2)
    tree.start(0)
    assert next(tree.root.paths()) == "there/b"
    assert [run.active for run in tree.actors] == [True, True]


def test_what_was_begun_at_is_the_first_one_once() -> None:
    tree = nested()
    tree.begin_at(2, 2)
    tree.start(0)
    root = tree.root
    for transition in root.automaton.transitions:
        assert tree.begin_cycle(root)
        assert tree.leave(root, 1)
        assert tree.change(root, transition, 1)
        tree.enter(root, 1)
        tree.end_cycle(root)
    assert next(tree.root.paths()) == "there/a"


@pytest.mark.parametrize(
    ("number", "state", "reported"), [(7, 1, "there are 1, 2"), (2, 9, r"1 \(a\), 2 \(b\)")]
)
def test_what_is_not_there_cannot_be_begun_at(number: int, state: int, reported: str) -> None:
    tree = nested()
    with pytest.raises(UnknownElementError, match=reported):
        tree.begin_at(number, state)
    assert next(tree.root.paths()) == "here"


# -- events ----------------------------------------------------------------------------------------------


def waiting() -> tuple[Tree, Actor, Event]:
    """Return a tree, an automaton below its root in a cycle, and the event that it handles."""
    child = automaton(2, "child", [State(id=1, name="x"), State(id=2, name="y")], [on("go", 1, 2)])
    tree = Tree(automaton(1, "root", [State(id=1, name="a", children=(child,))]))
    tree.start(0)
    assert all(tree.begin_cycle(run) for run in tree.actors)
    tree.end_cycle(tree.root)
    run = tree.actors[1]
    tree.send(Event("go"), 0)
    assert tree.next_event(run, 0) is None, "it came after the cycle had begun"
    tree.end_cycle(run)
    assert tree.begin_cycle(run)
    event = tree.next_event(run, 0)
    assert event is not None
    return tree, run, event


@pytest.mark.parametrize(("handled", "dropped"), [(True, 0), (False, 1)])
def test_an_event_that_was_asked_for_is_taken_from_the_queue(handled: bool, dropped: int) -> None:
    tree, run, event = waiting()
    tree.send(Event("go", "a later one"), 0)
    tree.take_event(run, event, 0, handled=handled)
    assert ([each.data for each in run.events.waiting], run.events.dropped) == (["a later one"], dropped)
    assert tree.next_event(run, 0) is None, "that came after the cycle had begun"


@pytest.mark.parametrize("handled", [True, False])
def test_when_an_overflow_was_faster_no_other_event_is_taken(handled: bool) -> None:
    tree, run, event = waiting()
    for number in range(CAPACITY):
        tree.send(Event("go", number), 0)
    tree.take_event(run, event, 0, handled=handled)
    assert [each.data for each in run.events.waiting] == list(range(CAPACITY))


def test_when_the_automaton_became_a_ghost_there_is_no_event_to_take() -> None:
    tree, run, event = waiting()
    assert tree.begin_cycle(tree.root)
    tree.leave(tree.root, 0)
    tree.take_event(run, event, 0, handled=True)
    assert (list(run.events.waiting), run.events.dropped) == ([], 1)


def test_an_event_that_nothing_waits_for_makes_way_for_the_next_one() -> None:
    states = [State(id=1, name="a"), State(id=2, name="b")]
    tree = Tree(automaton(1, "root", states, [on("go", 1, 2), on("back", 2, 1)]))
    tree.start(0)
    for name in ("back", "back", "go"):
        tree.send(Event(name), 0)
    assert tree.begin_cycle(tree.root)
    event = tree.next_event(tree.root, 0)
    assert event is not None
    assert event.name == "go"


# -- activations -----------------------------------------------------------------------------------------


def go(tree: Tree, run: Actor, transition: Transition, now: int = 0) -> None:
    """Run a cycle of an automaton that fires a transition."""
    assert tree.begin_cycle(run)
    assert tree.leave(run, now)
    assert tree.change(run, transition, now)
    tree.enter(run, now)
    tree.end_cycle(run)


def test_an_automaton_is_active_since_it_was_last_a_ghost() -> None:
    tree = nested()
    tree.start(0)
    back, there = tree.root.automaton.transitions
    since = [tree.actors[1].active_since]
    for now, transition in enumerate((there, back, there), 1):
        go(tree, tree.root, transition, now)
        since.append(tree.actors[1].active_since)
    assert since == [None, 1, None, 3]


def test_an_automaton_that_restarts_has_made_no_transition() -> None:
    tree = nested()
    tree.begin_at(2, 2)
    tree.start(0)
    child = tree.actors[1]
    go(tree, child, child.automaton.transitions[0])
    assert child.last_transition == child.automaton.transitions[0].id
    for transition in tree.root.automaton.transitions:
        go(tree, tree.root, transition)
    assert child.last_transition == 0


def test_an_automaton_that_restarts_is_forced_to_nothing() -> None:
    tree = nested()
    tree.start(0)
    child = tree.actors[1]
    child.forced = child.automaton.transitions[0]
    for transition in tree.root.automaton.transitions:
        go(tree, tree.root, transition)
    assert child.forced is None


def test_a_ghost_leaves_no_state() -> None:
    below = automaton(3, "below", [State(id=1, name="x")])
    child = automaton(2, "child", [State(id=1, name="a", children=(below,))])
    states = [State(id=1, name="here", children=(child,)), State(id=2, name="there")]
    tree = Tree(automaton(1, "root", states, [after(1.0, 1, 2)]))
    tree.start(0)
    assert tree.leave(tree.actors[1], 0)
    go(tree, tree.root, tree.root.automaton.transitions[0])
    assert not tree.leave(tree.actors[1], 1)


def test_what_a_final_state_owns_stays_asleep_when_the_automaton_resumes() -> None:
    below = automaton(3, "below", [State(id=1, name="x")])
    states = [State(id=1, name="a"), State(id=2, name="end", final=True, children=(below,))]
    child = automaton(2, "child", states, [after(1.0, 1, 2)])
    states = [State(id=1, name="here", children=(child,)), State(id=2, name="there")]
    tree = Tree(automaton(1, "root", states, [after(1.0, 1, 2), after(1.0, 2, 1)]))
    tree.start(0)
    go(tree, tree.actors[1], tree.actors[1].automaton.transitions[0])
    for transition in tree.root.automaton.transitions:
        go(tree, tree.root, transition)
    assert [run.active for run in tree.actors] == [True, True, False]


def test_an_automaton_that_moves_below_one_that_resumes_goes_on_as_it_was() -> None:
    moved = automaton(4, "moved", [State(id=1, name="x")])

    def version(first: int, **children: tuple[Automaton, ...]) -> Tree:
        """Return a tree with the automata 2 and 3, the one of `first` below the first state of the root."""
        below = {
            2: automaton(2, "two", [State(id=1, name="x", children=children.get("two", ()))]),
            3: automaton(3, "three", [State(id=1, name="x", children=children.get("three", ()))]),
        }
        states = [
            State(id=1, name="a", children=(below[first],)),
            State(id=2, name="b", children=(below[5 - first],)),
        ]
        return Tree(automaton(1, "root", states, [after(1.0, 1, 2), after(1.0, 2, 1)]))

    tree = version(2, two=(moved,))
    tree.start(0)
    for transition in tree.root.automaton.transitions:
        go(tree, tree.root, transition)
    run = tree.actor(4)
    assert run is not None
    with tree.lock:
        tree.replace(version(3, three=(moved,)).actors, 1)
    assert run.active_since == 0


# -- phases ----------------------------------------------------------------------------------------------


def in_cycle() -> tuple[Tree, Actor]:
    """Return a tree, and an automaton in a cycle, below a state that its parent can leave and enter again."""
    child = automaton(2, "child", [State(id=1, name="x")])
    states = [State(id=1, name="a", children=(child,)), State(id=2, name="b")]
    tree = Tree(automaton(1, "root", states, [after(1.0, 1, 2), after(1.0, 2, 1)]))
    tree.start(0)
    assert tree.begin_cycle(tree.actors[1])
    return tree, tree.actors[1]


@pytest.mark.parametrize("phase", [Phase.SETTLED, Phase.PAUSED, Phase.PAUSED_AT_CODE, Phase.FINISHED])
def test_a_ghost_comes_to_no_phase_after_its_entry(phase: Phase) -> None:
    tree, run = in_cycle()
    go(tree, tree.root, tree.root.automaton.transitions[0])
    tree.reach(run, phase)
    assert run.phase is Phase.BEGUN


@pytest.mark.parametrize("phase", [Phase.ENTERING, Phase.ENTERED, Phase.SETTLED])
def test_a_cycle_that_outlives_its_activation_comes_to_no_phase(phase: Phase) -> None:
    tree, run = in_cycle()
    for transition in tree.root.automaton.transitions:
        go(tree, tree.root, transition)
    tree.reach(run, phase)
    assert (run.active, run.phase) == (True, Phase.BEGUN)


@pytest.mark.parametrize("phase", [Phase.PAUSED, Phase.PAUSED_AT_CODE])
def test_a_cycle_that_paused_is_not_continued_after_a_time_as_a_ghost(phase: Phase) -> None:
    tree, run = in_cycle()
    tree.reach(run, phase)
    tree.end_cycle(run)
    for transition in tree.root.automaton.transitions:
        go(tree, tree.root, transition)
    assert (run.active, run.phase) == (True, Phase.SETTLED)


@pytest.mark.parametrize(("chosen", "first"), [(None, "y"), (3, "z")])
def test_an_automaton_that_was_never_active_begins_in_the_first_state_of_its_new_version(
    chosen: int | None, first: str
) -> None:
    def version(*order: int) -> Tree:
        states = [State(id=index, name="xyz"[index - 1]) for index in order]
        below = automaton(2, "below", states)
        states = [State(id=1, name="a", entry=print, children=(below,)), State(id=2, name="b")]
        return Tree(automaton(1, "root", states, [after(1.0, 1, 2), after(1.0, 2, 1)]))

    tree = version(1, 2, 3)
    if chosen is not None:
        tree.begin_at(2, chosen)
    tree.start(0)
    with tree.lock:
        tree.replace(version(2, 3, 1).actors, 0)
    tree.begin_cycle(tree.root)
    tree.enter(tree.root, 0)
    assert tree.actors[1].current.name == first


# -- cycles ----------------------------------------------------------------------------------------------

PERIOD = 100_000_000
"""Of the automata here, in ns."""


@pytest.mark.parametrize(
    ("until", "slot"), [(0, 1), (PERIOD - 1, 1), (PERIOD, 2), (PERIOD + 1, 2), (5 * PERIOD // 2, 3)]
)
def test_the_next_cycle_is_the_first_one_after_a_time(until: int, slot: int) -> None:
    tree = started()
    tree.decide(tree.root, until)
    assert tree.root.cycle.next_slot == slot * PERIOD


@pytest.mark.parametrize(("old", "new", "slot"), [(1.0, 0.1, 3), (0.1, 1.0, 10), (0.1, 0.1, 5)])
def test_a_new_period_counts_at_once(old: float, new: float, slot: int) -> None:
    def version(period: float) -> Tree:
        return Tree(automaton(1, "root", [State(id=1, name="a")], period=period))

    tree = version(old)
    tree.start(0)
    tree.root.cycle.next_slot = 5 * PERIOD
    with tree.lock:
        tree.replace(version(new).actors, 5 * PERIOD // 2)
    assert tree.root.cycle.next_slot == slot * PERIOD


# -- the end ---------------------------------------------------------------------------------------------


class Changes(Observer):
    """Notes the changes of automata."""

    def __init__(self) -> None:
        self.kinds: list[ChangeKind] = []

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:
        self.kinds.append(kind)


def test_a_ghost_does_not_finish() -> None:
    tree, run, _ = waiting()
    assert tree.begin_cycle(tree.root)
    tree.leave(tree.root, 0)
    tree.finish(run, 0)
    assert not run.finished


def test_an_automaton_finishes_once() -> None:
    tree, run, _ = waiting()
    changes = Changes()
    tree.observers.append(changes)
    tree.finish(run, 0)
    tree.finish(run, 0)
    assert (run.finished, changes.kinds) == (True, [ChangeKind.FINISHED])


# -- moments without a cycle -----------------------------------------------------------------------------


def test_a_tree_without_a_cycle_has_a_gap_at_once() -> None:
    tree = started()
    with tree.lock:
        assert tree.wait_for_gap(0.0)


def test_a_gap_that_does_not_come_is_not_waited_for_longer_than_said() -> None:
    tree = started()
    tree.begin_cycle(tree.root)
    with tree.lock:
        assert not tree.wait_for_gap(0.01)


def test_a_gap_comes_with_the_end_of_the_cycle() -> None:
    tree = started()
    tree.begin_cycle(tree.root)
    ends = threading.Timer(0.05, tree.end_cycle, [tree.root])
    ends.start()
    with tree.lock:
        assert tree.wait_for_gap(EVENT_LIMIT)
    ends.join()
