"""Who may run a cycle, and what a tree of automata knows of itself."""

from __future__ import annotations

import pytest

from hfsm_runtime import State
from hfsm_runtime.errors import DefinitionError
from hfsm_runtime.tree import Tree
from tests.support.automata import automaton


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
