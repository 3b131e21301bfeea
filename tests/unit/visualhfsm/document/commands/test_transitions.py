"""Commands that add and change transitions."""

from __future__ import annotations

import pytest

from tests.support.editing import automaton, texted, transition, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.transitions import (
    AddTransition,
    RenameTransition,
    ReorderTransition,
    RetargetTransition,
    SetPriority,
    SetTransitionType,
)


def test_a_transition_is_added_with_a_handle_of_its_own() -> None:
    document = AddTransition(automaton=1, origin=1, destination=2, type="time").apply(tree())
    document = AddTransition(automaton=1, origin=1, destination=2).apply(document)
    document = AddTransition(automaton=1, origin=1, destination=1).apply(document)
    new = automaton(document).transitions[2:]
    assert [(each.id, each.type) for each in new] == [(3, "time"), (4, "condition"), (5, "condition")]
    handles = {(each.x, each.y) for each in automaton(document).transitions}
    assert len(handles) == 5
    assert (new[2].x, new[2].y) == (100.0, 10.0)


def test_a_transition_needs_its_states() -> None:
    with pytest.raises(EditError, match="state 9 of automaton 1: it does not exist"):
        AddTransition(automaton=1, origin=1, destination=9).apply(tree())


def test_an_end_of_a_transition_is_led_elsewhere_and_its_place_in_the_order_stays() -> None:
    document = RetargetTransition(automaton=1, transition=1, destination=1).apply(tree())
    assert [each.id for each in automaton(document).transitions] == [1, 2]
    moved = transition(document, 1)
    assert (moved.origin, moved.destination, moved.x, moved.y) == (1, 1, 100.0, 10.0)


def test_a_condition_goes_on_as_a_guard_and_comes_back() -> None:
    document = SetTransitionType(automaton=1, transition=1, type="event", trigger="call").apply(tree())
    changed = transition(document, 1)
    assert (changed.type, changed.trigger.text, changed.guard.text) == ("event", "call", "x > 1")
    back = transition(SetTransitionType(automaton=1, transition=1, type="condition").apply(document), 1)
    assert (back.type, back.trigger.text, back.guard.text) == ("condition", "x > 1", "")
    finished = transition(SetTransitionType(automaton=1, transition=1, type="finished").apply(document), 1)
    assert (finished.trigger.text, finished.guard.text) == ("", "x > 1")


def test_a_time_is_one_second_at_first_and_stays_as_it_was_set() -> None:
    document = SetTransitionType(automaton=1, transition=1, type="time").apply(tree())
    assert (transition(document, 1).trigger.text, transition(document, 1).guard.text) == ("1000", "x > 1")
    document = texted(document, "250", kind="transition", id=1, part="trigger")
    again = SetTransitionType(automaton=1, transition=1, type="time").apply(document)
    assert transition(again, 1).trigger.text == "250"


def test_the_texts_of_a_transition_are_set() -> None:
    document = RenameTransition(automaton=1, transition=1, name="on").apply(tree())
    for part in ("trigger", "guard", "fired"):
        document = texted(document, part, kind="transition", id=1, part=part)
    document = SetPriority(automaton=1, transition=1, priority="2").apply(document)
    new = transition(document, 1)
    assert (new.name, new.trigger.text, new.guard.text, new.code.text, new.priority.text) == (
        "on", "trigger", "guard", "fired", "2"
    )  # fmt: skip


def test_transitions_change_places_where_none_has_a_priority() -> None:
    document = tree()
    for _ in range(2):
        document = AddTransition(automaton=1, origin=1, destination=2).apply(document)
    document = ReorderTransition(automaton=1, transition=4, index=0).apply(document)
    assert [each.id for each in automaton(document).transitions] == [4, 2, 1, 3]
    assert [each.id for each in automaton(document).outgoing(1)] == [4, 1, 3]


def test_transitions_get_priorities_where_one_has_one() -> None:
    document = AddTransition(automaton=1, origin=1, destination=2).apply(tree())
    document = SetPriority(automaton=1, transition=3, priority="7").apply(document)
    document = ReorderTransition(automaton=1, transition=1, index=0).apply(document)
    assert [(each.id, each.priority.text) for each in automaton(document).transitions] == [
        (1, "1"), (2, ""), (3, "2")
    ]  # fmt: skip
