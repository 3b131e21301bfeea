"""The semantics of states, sentence by sentence: entry and exit code, final states, children and restart."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress

import pytest

from hfsm_runtime import Automaton, Component, State, Transition, VirtualRun, run
from hfsm_runtime.errors import CycleCutError
from hfsm_runtime.tree import ChangeKind
from tests.support.automata import Code, after, automaton, component, finished, when
from zenoh_ice.data.exceptions import ConnectionLostException


class Log:
    """What ran, in its order."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def says(self, what: str) -> Code:
        return lambda: self.lines.append(what)

    def state(
        self, id: int, name: str, children: tuple[Automaton, ...] = (), *, restart: bool = False
    ) -> State:
        return State(
            id=id,
            name=name,
            entry=self.says(f"entry {name}"),
            code=self.says(name),
            exit=self.says(f"exit {name}"),
            children=children,
            restart=restart,
        )

    def take(self) -> list[str]:
        taken, self.lines = self.lines, []
        return taken


@pytest.fixture
def log() -> Log:
    return Log()


# Entry and exit.


def test_the_initial_state_is_entered_with_its_entry_code_in_the_first_cycle(log: Log) -> None:
    run(component(automaton(1, "root", [log.state(1, "a")])), 0.1)
    assert log.lines == ["entry a", "a", "a"]


def test_the_entry_code_of_an_initial_state_runs_before_transitions_are_tried(log: Log) -> None:
    def guard() -> bool:
        log.says("guard")()
        return True

    run(component(automaton(1, "root", [log.state(1, "a"), log.state(2, "b")], [when(guard, 1, 2)])), 0)
    assert log.lines == ["entry a", "guard", "exit a", "entry b", "b"]


def test_a_firing_runs_exit_then_the_transition_then_entry_then_the_code_of_the_state(log: Log) -> None:
    change = after(0.1, 1, 2, code=log.says("fired"))
    run(component(automaton(1, "root", [log.state(1, "a"), log.state(2, "b")], [change])), 0.2)
    assert log.lines == ["entry a", "a", "exit a", "fired", "entry b", "b", "b"]


def test_the_state_changes_between_exit_code_and_the_code_of_the_transition() -> None:
    seen: list[str] = []
    virtual: VirtualRun

    def note() -> None:
        seen.append(virtual.active)

    states = [State(id=1, name="a", exit=note), State(id=2, name="b", entry=note)]
    virtual = VirtualRun(component(automaton(1, "root", states, [after(0.1, 1, 2, code=note)])))
    virtual.advance(0.1)
    assert seen == ["a", "b", "b"]


def test_a_self_transition_leaves_and_enters(log: Log) -> None:
    run(component(automaton(1, "root", [log.state(1, "a")], [after(0.1, 1, 1)])), 0.1)
    assert log.lines == ["entry a", "a", "exit a", "entry a", "a"]


def test_timers_count_from_the_end_of_an_entry_that_takes_longer_than_a_period() -> None:
    def root(c: Component) -> Automaton:
        states = [State(id=1, name="a", entry=lambda: c.sleep(0.25)), State(id=2, name="b")]
        return automaton(1, "root", states, [after(0.5, 1, 2)])

    assert run(component(root), 2).changes("root") == [(0, "a"), (0.8, "b")]


def test_an_entry_shorter_than_a_period_counts_as_if_it_took_no_time() -> None:
    def root(c: Component) -> Automaton:
        states = [State(id=1, name="a", entry=lambda: c.sleep(0.05)), State(id=2, name="b")]
        return automaton(1, "root", states, [after(0.5, 1, 2)])

    assert run(component(root), 2).changes("root") == [(0, "a"), (0.5, "b")]


def test_an_entry_counts_by_what_it_takes_and_not_by_how_late_its_cycle_began() -> None:
    def root(c: Component) -> Automaton:
        slow = automaton(2, "slow", [State(id=1, name="s", entry=lambda: c.sleep(0.07))])
        states = [State(id=1, name="x", entry=lambda: c.sleep(0.07)), State(id=2, name="y")]
        late = automaton(3, "late", states, [after(0.5, 1, 2)])
        return automaton(1, "root", [State(id=1, name="a", children=(slow, late))])

    assert run(component(root), 2).changes("late") == [(0, "x"), (0.5, "y")]


def test_children_wake_after_the_entry_of_the_state_above_them(log: Log) -> None:
    child = automaton(2, "child", [log.state(1, "x")])
    run(component(automaton(1, "root", [log.state(1, "a", (child,))])), 0)
    assert log.lines == ["entry a", "a", "entry x", "x"]


def test_timers_of_children_count_from_when_they_wake_and_not_from_their_first_cycle() -> None:
    states = [State(id=1, name="x"), State(id=2, name="y")]
    child = automaton(2, "child", states, [after(0.2, 1, 2)], period=0.3)
    root = automaton(1, "root", [State(id=1, name="a"), State(id=2, name="b", children=(child,))],
                     [after(0.1, 1, 2)])  # fmt: skip
    assert run(component(root), 1).changes("child") == [(0.1, "x"), (0.3, "y")]


def test_children_are_ghosts_before_exit_code_runs() -> None:
    active: list[bool] = []
    virtual: VirtualRun
    child = automaton(2, "child", [State(id=1, name="x")])
    states = [
        State(id=1, name="a", children=(child,), exit=lambda: active.append(virtual.tree.actors[1].active)),
        State(id=2, name="b"),
    ]
    virtual = VirtualRun(component(automaton(1, "root", states, [after(0.1, 1, 2)])))
    virtual.advance(0.1)
    assert active == [False]


def by_turns(above: Callable[[int, str, tuple[Automaton, ...]], State], child: Automaton) -> Automaton:
    """Return an automaton that is for 0.5 s each in a state with a child and in one without."""
    states = [above(1, "a", (child,)), State(id=2, name="b")]
    return automaton(1, "root", states, [after(0.5, 1, 2), after(0.5, 2, 1)])


def test_becoming_a_ghost_runs_no_exit_code_and_resuming_no_entry_code(log: Log) -> None:
    child = automaton(2, "child", [log.state(1, "x")], period=0.3)
    virtual = run(component(by_turns(lambda i, n, c: State(id=i, name=n, children=c), child)), 1.2)
    assert log.lines == ["entry x", "x", "x", "x"]
    assert [c.kind for c in virtual.trace if c.automaton == "child"] == ["entered", "ghost", "resumed"]


# An entry that is owed.


def lost_until(virtual: Callable[[], VirtualRun], time: float, log: Log, what: str) -> Code:
    def code() -> None:
        if virtual().time < time:
            raise ConnectionLostException("gone")
        log.says(what)()

    return code


def test_an_entry_that_a_lost_server_cuts_short_is_owed_and_run_first_when_it_is_back(log: Log) -> None:
    virtual: VirtualRun
    child = automaton(2, "child", [log.state(1, "x")])
    entry = lost_until(lambda: virtual, 0.25, log, "entry b")
    states = [
        State(id=1, name="a"),
        State(id=2, name="b", entry=entry, code=log.says("b"), children=(child,)),
    ]
    root = automaton(1, "root", states, [when(lambda: True, 1, 2), when(log.says("guard"), 2, 1)])
    virtual = VirtualRun(component(root))
    virtual.advance(0.2)
    assert (virtual.active, log.take()) == ("b/x", [])
    assert not virtual.tree.actors[1].active
    virtual.advance(0.1)
    assert log.take() == ["entry b", "guard", "b", "entry x", "x"]


def test_the_timers_of_a_state_whose_entry_is_owed_stand_still() -> None:
    virtual: VirtualRun
    log = Log()
    entry = lost_until(lambda: virtual, 1.0, log, "entry a")
    states = [State(id=1, name="a", entry=entry), State(id=2, name="b")]
    virtual = VirtualRun(component(automaton(1, "root", states, [after(0.5, 1, 2)])))
    virtual.advance(2)
    assert virtual.changes("root") == [(0, "a"), (1.5, "b")]


def test_a_lost_server_in_exit_code_does_not_keep_the_state_from_changing(log: Log) -> None:
    virtual: VirtualRun
    states = [
        State(id=1, name="a", exit=lost_until(lambda: virtual, 9, log, "exit a")),
        log.state(2, "b"),
    ]
    virtual = VirtualRun(component(automaton(1, "root", states, [after(0.1, 1, 2, code=log.says("fired"))])))
    virtual.advance(0.1)
    assert (virtual.active, log.take()) == ("b", [])
    virtual.advance(0.1)
    assert log.take() == ["entry b", "b"]


def test_a_lost_server_in_the_code_of_a_transition_leaves_the_entry_owed(log: Log) -> None:
    virtual: VirtualRun
    change = after(0.1, 1, 2, code=lost_until(lambda: virtual, 9, log, "fired"))
    virtual = VirtualRun(
        component(automaton(1, "root", [State(id=1, name="a"), log.state(2, "b")], [change]))
    )
    virtual.advance(0.1)
    assert (virtual.active, log.take()) == ("b", [])
    virtual.advance(0.1)
    assert log.take() == ["entry b", "b"]


def test_an_owed_entry_stays_owed_while_the_automaton_is_a_ghost(log: Log) -> None:
    virtual: VirtualRun
    entry = lost_until(lambda: virtual, 0.75, log, "entry x")
    child = automaton(2, "child", [State(id=1, name="x", entry=entry)], period=0.2)
    virtual = VirtualRun(component(by_turns(lambda i, n, c: State(id=i, name=n, children=c), child)))
    virtual.advance(0.9)
    assert log.take() == []
    virtual.advance(0.1)
    assert log.take() == ["entry x"]


def test_with_on_error_continue_a_failed_piece_is_left_and_the_firing_goes_on(log: Log) -> None:
    states = [
        State(id=1, name="a", exit=lambda: 1 / 0),
        State(id=2, name="b", entry=lambda: 1 / 0, code=log.says("b")),
    ]
    change = after(0.1, 1, 2, code=lambda: 1 / 0)
    virtual = run(component(automaton(1, "root", states, [change]), on_error="continue"), 0.1)
    assert (virtual.active, log.lines) == ("b", ["b"])
    assert [error.state for error in virtual.errors] == [1, 2, 2]


# Final states.


def final(id: int, name: str, log: Log | None = None) -> State:
    if log is None:
        return State(id=id, name=name, final=True)
    says = log.says
    return State(
        id=id, name=name, final=True, entry=says(f"entry {name}"), code=says(name), exit=says(f"exit {name}")
    )


def ends(id: int, log: Log | None = None, seconds: float = 0.2) -> Automaton:
    """Return an automaton that finishes after its time."""
    first = State(id=1, name="x") if log is None else log.state(1, "x")
    return automaton(id, f"child {id}", [first, final(2, "end", log)], [after(seconds, 1, 2)])


def test_a_final_state_runs_its_entry_code_and_nothing_else(log: Log) -> None:
    asked = when(log.says("guard"), 2, 1)
    root = automaton(1, "root", [State(id=1, name="a"), final(2, "end", log)], [after(0.1, 1, 2), asked])
    run(component(root), 1)
    assert log.lines == ["entry end"]


def test_an_automaton_that_has_finished_runs_no_more_cycles() -> None:
    virtual = run(component(automaton(1, "root", [State(id=1, name="a", children=(ends(2),))])), 1)
    child = virtual.tree.actors[1]
    assert (child.finished, child.cycle.count, virtual.active) == (True, 3, "a/end")


def test_an_initial_state_may_be_final_and_then_no_transition_leaves_it() -> None:
    root = automaton(1, "root", [final(1, "end"), State(id=2, name="b")], [when(lambda: True, 1, 2)])
    virtual = run(component(root), 0)
    assert (virtual.finished, virtual.active) == (True, "end")


def test_the_root_that_finishes_ends_the_component(log: Log) -> None:
    side = automaton(2, "side", [State(id=1, name="x", code=log.says("x"))])
    states = [State(id=1, name="a", children=(side,)), final(2, "end")]
    virtual = run(component(automaton(1, "root", states, [after(0.2, 1, 2)])), 1)
    assert (virtual.finished, virtual.halted, virtual.time) == (True, False, 1)
    assert log.lines == ["x", "x"]


def test_a_finish_is_reported_as_a_change() -> None:
    virtual = run(
        component(automaton(1, "root", [State(id=1, name="a"), final(2, "end")], [after(0.1, 1, 2)])), 1
    )
    assert [(change.time, change.state, change.kind) for change in virtual.trace] == [
        (0, "a", ChangeKind.ENTERED),
        (0.1, "end", ChangeKind.ENTERED),
        (0.1, "end", ChangeKind.FINISHED),
    ]


def test_exit_code_of_a_final_state_does_not_run_though_its_automaton_could_not_finish(log: Log) -> None:
    def lost() -> None:
        raise ConnectionLostException("offline")

    states = [State("x", exit=lost), State("done", final=True, exit=log.says("exit done"))]
    child = automaton(2, "child", states, [after(0.2, 1, 2)], period=0.2)
    root = [State("a", restart=True, children=(child,), exit=log.says("exit a")), State("b")]
    run(component(automaton(1, "root", root, [after(0.3, 1, 2)])), 1.0)
    assert log.lines == ["exit a"]


def test_children_of_a_final_state_never_wake_and_are_handed_nothing(log: Log) -> None:
    def arguments() -> Mapping[int, Mapping[str, object]]:
        log.says("arguments")()
        return {}

    below = automaton(3, "below", [log.state(1, "x")])
    end = State(id=1, name="end", final=True, children=(below,), arguments=arguments)
    child = automaton(2, "child", [end])
    virtual = run(component(automaton(1, "root", [State(id=1, name="a", children=(child,))])), 1)
    assert (virtual.active, log.lines) == ("a/end", [])


@pytest.mark.parametrize("restart", [False, True])
def test_a_finished_child_restarts_whenever_its_state_is_entered_again(log: Log, restart: bool) -> None:
    virtual = run(
        component(by_turns(lambda i, n, c: State(id=i, name=n, children=c, restart=restart), ends(2, log))),
        1.4,
    )
    assert log.lines == ["entry x", "x", "x", "exit x", "entry end"] * 2
    assert virtual.changes("child 2") == [(0, "x"), (0.2, "end"), (1, "x"), (1.2, "end")]


def test_a_finished_child_stays_finished_when_the_state_above_it_is_resumed_and_not_entered(log: Log) -> None:
    middle = automaton(3, "middle", [State(id=1, name="m", children=(ends(2, log),))])
    virtual = run(component(by_turns(lambda i, n, c: State(id=i, name=n, children=c), middle)), 1.4)
    assert virtual.changes("child 2") == [(0, "x"), (0.2, "end")]
    assert virtual.tree.actors[2].finished


# Restart.


def test_children_resume_by_default_and_restart_with_restart() -> None:
    def changes(*, restart: bool) -> list[tuple[float, str]]:
        states = [State(id=1, name="x"), State(id=2, name="y")]
        child = automaton(2, "child", states, [after(0.3, 1, 2)])
        root = by_turns(lambda i, n, c: State(id=i, name=n, children=c, restart=restart), child)
        return run(component(root), 2.4).changes("child")

    assert changes(restart=False) == [(0, "x"), (0.3, "y")]
    assert changes(restart=True) == [(0, "x"), (0.3, "y"), (1, "x"), (1.3, "y"), (2, "x"), (2.3, "y")]


def test_leaving_a_restart_state_runs_the_exit_code_of_its_children_first(log: Log) -> None:
    children = tuple(automaton(i, f"c{i}", [log.state(1, f"x{i}")], period=10) for i in (2, 3))
    root = by_turns(lambda i, n, c: log.state(i, n, children, restart=True), children[0])
    run(component(root), 0.5)
    assert [line for line in log.lines if line.startswith("exit")] == ["exit x2", "exit x3", "exit a"]


def test_children_that_restart_run_their_entry_code_again(log: Log) -> None:
    child = automaton(2, "child", [log.state(1, "x"), log.state(2, "y")], [after(0.1, 1, 2)], period=0.1)
    run(component(by_turns(lambda i, n, c: State(id=i, name=n, children=c, restart=True), child)), 1)
    assert log.lines[:3] == ["entry x", "x", "exit x"]
    assert log.lines[-3:] == ["exit y", "entry x", "x"]


def test_below_a_child_that_is_left_for_good_only_restart_states_are_left_too(log: Log) -> None:
    def grandchildren(*, restart: bool) -> list[str]:
        leaf = automaton(3, "leaf", [log.state(1, "leaf")])
        child = automaton(2, "child", [log.state(1, "x", (leaf,), restart=restart)])
        run(component(by_turns(lambda i, n, c: log.state(i, n, c, restart=True), child)), 0.5)
        return [line for line in log.take() if line.startswith("exit")]

    assert grandchildren(restart=True) == ["exit leaf", "exit x", "exit a"]
    assert grandchildren(restart=False) == ["exit x", "exit a"]


def test_what_restarts_below_a_child_is_left_though_the_child_has_run_no_cycle_yet(log: Log) -> None:
    leaf = automaton(3, "leaf", [State(id=1, name="leaf", exit=log.says("exit leaf"))])
    states = [State(id=1, name="x", children=(leaf,), restart=True, exit=log.says("exit x"))]
    slow = automaton(2, "slow", states, period=10)
    above = State(id=1, name="a", children=(slow,), restart=True)
    root = automaton(1, "root", [State(id=2, name="first"), above, State(id=3, name="last")],
                     [after(0.1, 2, 1), after(0.2, 1, 3)])  # fmt: skip
    run(component(root), 0.5)
    assert log.lines == ["exit leaf", "exit x"]


def test_a_child_that_ends_its_entry_as_a_ghost_has_entered_and_is_left(log: Log) -> None:
    def root(c: Component) -> Automaton:
        def entry() -> None:
            with suppress(CycleCutError):
                c.sleep(60)

        child = automaton(2, "child", [State(id=1, name="x", entry=entry, exit=log.says("exit x"))])
        return by_turns(lambda i, n, below: State(id=i, name=n, children=below, restart=True), child)

    run(component(root), 0.6)
    assert log.lines == ["exit x"]


def test_a_restart_state_that_is_resumed_and_not_entered_lets_its_children_go_on() -> None:
    leaf = automaton(3, "leaf", [State(id=1, name="p"), State(id=2, name="q")], [after(0.3, 1, 2)])
    child = automaton(2, "child", [State(id=1, name="x", children=(leaf,), restart=True)])
    virtual = run(component(by_turns(lambda i, n, c: State(id=i, name=n, children=c), child)), 1.4)
    assert virtual.changes("leaf") == [(0, "p"), (0.3, "q")]


def test_a_child_whose_entry_never_ran_is_left_without_exit_code(log: Log) -> None:
    def lost() -> None:
        raise ConnectionLostException("gone")

    child = automaton(2, "child", [State(id=1, name="x", entry=lost, exit=log.says("exit x"))])
    run(component(by_turns(lambda i, n, c: log.state(i, n, c, restart=True), child)), 0.5)
    assert "exit x" not in log.lines


def test_an_error_in_exit_code_of_a_child_that_is_left_is_the_childs() -> None:
    child = automaton(2, "child", [State(id=7, name="x", exit=lambda: 1 / 0)])
    virtual = run(
        component(by_turns(lambda i, n, c: State(id=i, name=n, children=c, restart=True), child)), 0.5
    )
    assert [(error.automaton, error.state) for error in virtual.errors] == [(2, 7)]
    assert virtual.halted


def test_variables_keep_their_values_through_a_restart() -> None:
    counted: list[int] = []

    def make() -> Automaton:
        rounds = 0

        def enter() -> None:
            nonlocal rounds
            rounds += 1
            counted.append(rounds)

        return automaton(2, "child", [State(id=1, name="x", entry=enter)])

    run(component(by_turns(lambda i, n, c: State(id=i, name=n, children=c, restart=True), make())), 2)
    assert counted == [1, 2, 3]


# Paths.


def test_the_path_follows_the_first_child_and_branches_where_there_are_several() -> None:
    left = automaton(2, "left", [State(id=1, name="l")])
    deep = automaton(4, "deep", [State(id=1, name="d")])
    right = automaton(3, "right", [State(id=1, name="r", children=(deep,))])
    virtual = run(component(automaton(1, "root", [State(id=1, name="a", children=(left, right))])), 0)
    assert virtual.active == "a/l"
    assert virtual.active_paths == ("a/l", "a/r/d")


def test_a_finished_transition_waits_for_every_child() -> None:
    states = [State(id=1, name="a", children=(ends(2), ends(3, seconds=0.6))), State(id=2, name="b")]
    virtual = run(component(automaton(1, "root", states, [finished(1, 2)])), 2)
    assert virtual.changes("root") == [(0, "a"), (0.7, "b")]


def test_a_finished_transition_of_a_state_without_children_never_holds() -> None:
    root = automaton(1, "root", [State(id=1, name="a"), State(id=2, name="b")], [finished(1, 2)])
    assert run(component(root), 2).active == "a"


def test_a_finished_transition_asks_its_guard_only_then() -> None:
    asked: list[float] = []
    virtual: VirtualRun

    def guard() -> bool:
        asked.append(virtual.time)
        return len(asked) == 3

    states = [State(id=1, name="a", children=(ends(2),)), State(id=2, name="b")]
    transitions: list[Transition] = [finished(1, 2, guard=guard)]
    virtual = VirtualRun(component(automaton(1, "root", states, transitions)))
    virtual.advance(2)
    assert asked == [0.3, 0.4, 0.5]
    assert virtual.active == "b"
