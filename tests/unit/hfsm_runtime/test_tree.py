"""Who may run a cycle, and what a tree of automata knows of itself."""

from __future__ import annotations

import pytest

from hfsm_runtime import State
from hfsm_runtime.errors import DefinitionError, UnknownElementError
from hfsm_runtime.tree import Tree
from tests.support.automata import after, automaton


def started() -> Tree:
    child = automaton(2, "child", [State(id=1, name="x")])
    other = automaton(3, "other", [State(id=1, name="x")])
    states = [State(id=1, name="a", children=(child,)), State(id=2, name="b", children=(other,))]
    tree = Tree(automaton(1, "root", states))
    tree.start(0)
    return tree


def test_a_ghost_begins_no_cycle() -> None:
    tree = started()
    assert [tree.begin_cycle(run) for run in tree.runs] == [True, True, False]


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
    assert [tree.run(number) for number in (1, 2, 3, 4)] == [*tree.runs, None]


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
    assert [run.active for run in tree.runs] == [True, True]


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
