"""Commands that delete, move and place states and transitions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from codegen.hfsm.document import Automaton, Document, State
from tests.support.editing import automaton, names, state, transition, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.items import (
    AlignStates,
    DeleteItems,
    DistributeStates,
    MoveItems,
    PlaceItems,
    Placement,
    ResetHandles,
)
from visualhfsm._document.commands.states import AddState


def test_deleting_a_state_takes_all_that_hangs_on_it() -> None:
    document = DeleteItems(automaton=1, states=(2,)).apply(tree())
    assert [each.id for each in document.automata] == [1]
    assert names(document) == ["wait"]
    assert automaton(document).transitions == ()


def test_deleting_leaves_an_automaton_that_another_state_owns_too() -> None:
    document = tree()
    root = automaton(document)
    shared = replace(root, states=(replace(root.states[0], children=(3,)), root.states[1]))
    document = replace(document, automata=(shared, *document.automata[1:]))
    assert [each.id for each in DeleteItems(automaton=1, states=(2,)).apply(document).automata] == [1, 3]


def test_deleting_in_a_tree_that_bites_its_tail_keeps_what_is_above() -> None:
    document = Document(
        automata=(
            Automaton(id=1, states=(State(id=1, name="a", children=(2,)),)),
            Automaton(id=2, father=1, states=(State(id=1, name="b", children=(1, 2)),)),
        )
    )
    assert [each.id for each in DeleteItems(automaton=2, states=(1,)).apply(document).automata] == [1, 2]


def test_moving_takes_handles_along() -> None:
    document = MoveItems(automaton=1, states=(1,), dx=10, dy=20).apply(tree())
    assert (state(document, 1).x, state(document, 1).y) == (110.0, 120.0)
    assert (transition(document, 1).x, transition(document, 1).y) == (205.0, 90.0)
    both = MoveItems(automaton=1, states=(1, 2), transitions=(1,), dx=10, dy=20).apply(tree())
    assert [(each.x, each.y) for each in automaton(both).transitions] == [(210.0, 100.0), (210.0, 140.0)]


def test_nothing_moves_off_the_canvas() -> None:
    for dx in (1e9, float("nan"), float("inf")):
        with pytest.raises(EditError, match="Cannot move that far"):
            MoveItems(automaton=1, states=(1,), dx=dx, dy=0).apply(tree())


@pytest.mark.parametrize(
    ("to", "places"),
    [
        ("left", [(100, 100), (100, 100)]),
        ("right", [(300, 100), (300, 100)]),
        ("center", [(200, 100), (200, 100)]),
        ("bottom", [(100, 100), (300, 100)]),
    ],
)
def test_states_are_aligned(to: Any, places: list[tuple[int, int]]) -> None:
    document = AlignStates(automaton=1, states=(1, 2), to=to).apply(tree())
    assert [(each.x, each.y) for each in automaton(document).states] == places


def test_states_are_distributed_between_the_outermost() -> None:
    document = tree()
    for x in (110.0, 120.0):
        document = AddState(automaton=1, x=x, y=100).apply(document)
    document = DistributeStates(automaton=1, states=(1, 2, 3, 4), along="x").apply(document)
    assert [each.x for each in automaton(document).states] == [100.0, 300.0, 166.67, 233.33]


def test_a_layout_places_many_and_handles_stand_by_themselves() -> None:
    placements = (
        Placement(automaton=1, states=((1, 0.0, 0.0), (2, 0.0, 200.0)), transitions=((2, 5.0, 6.0),)),
        Placement(automaton=2, states=((1, 7.0, 8.0),)),
    )
    document = PlaceItems(placements=placements).apply(tree())
    assert [(each.x, each.y) for each in automaton(document).states] == [(0.0, 0.0), (0.0, 200.0)]
    assert [(each.x, each.y) for each in automaton(document).transitions] == [(0.0, 100.0), (5.0, 6.0)]
    assert state(document, 1, of=2).y == 8.0


def test_a_layout_leaves_the_handles_between_states_that_it_does_not_place() -> None:
    document = AddState(automaton=1, x=0, y=0).apply(tree())
    placed = PlaceItems(placements=(Placement(automaton=1, states=((3, 50.0, 50.0),)),)).apply(document)
    assert automaton(placed).transitions == automaton(document).transitions


def test_handles_go_back_where_they_stand_by_themselves() -> None:
    document = ResetHandles(automaton=1, transitions=(1, 2)).apply(tree())
    assert [(each.x, each.y) for each in automaton(document).transitions] == [(200.0, 100.0), (200.0, 150.0)]


def test_a_handle_keeps_away_from_those_that_stand_still() -> None:
    document = ResetHandles(automaton=1, transitions=(1,)).apply(tree())
    assert [(each.x, each.y) for each in automaton(document).transitions] == [(200.0, 150.0), (200.0, 120.0)]
