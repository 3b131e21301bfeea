"""States that are moved into a new sub-automaton."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.hfsm.document import Automaton, Document, State, Text, Transition
from codegen.messages import Message
from tests.support.editing import tree
from tests.support.examples import examples
from visualhfsm import Project
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.group import GroupStates, split_variables
from visualhfsm._document.serialization import parse, written

NUMBERS = st.integers(1, 6)


@st.composite
def documents(draw: st.DrawFn) -> Document:
    """An automaton of six states, some with an automaton below them, and any transitions among them."""
    ends = draw(st.lists(st.tuples(NUMBERS, NUMBERS), max_size=10))
    owners = draw(st.sets(NUMBERS, max_size=3))
    states = tuple(
        State(id=n, name=f"s{n}", initial=n == 1, x=50.0 * n, children=(n + 1,) if n in owners else ())
        for n in range(1, 7)
    )
    arcs = tuple(
        Transition(id=number, name=f"t{number}", origin=origin, destination=destination)
        for number, (origin, destination) in enumerate(ends, 1)
    )
    below = (
        Automaton(id=n + 1, father=1, states=(State(id=1, name="low", initial=True),)) for n in sorted(owners)
    )
    return Document(automata=(Automaton(id=1, states=states, transitions=arcs), *below))


@settings(max_examples=examples(15))
@given(document=documents(), chosen=st.sets(NUMBERS, min_size=1))
def test_grouped_states_keep_what_they_are_and_what_leads_across_the_border_ends_at_the_group(
    tmp_path_factory: pytest.TempPathFactory, document: Document, chosen: set[int]
) -> None:
    folder = tmp_path_factory.getbasetemp()
    session = Project(folder, journals=folder / "journals").open_text("group", written(document))
    try:
        original = session.text()
        session.apply(GroupStates(automaton=1, states=tuple(chosen)))
        made = session.version.document
        top, child = made.automata[0], made.automata[-1]
        (group,) = (state for state in top.states if state.children == (child.id,))
        assert {state.id for state in child.states} == chosen
        assert {state.id for state in top.states} == {*range(1, 7)} - chosen | {group.id}
        assert (group.initial, sum(state.initial for state in child.states)) == (1 in chosen, 1)
        former = {each.id: each for each in document.automata[0].transitions}
        for each in child.transitions:
            assert each == former.pop(each.id)
        for each in top.transitions:
            before = former.pop(each.id)
            expected = [group.id if end in chosen else end for end in (before.origin, before.destination)]
            assert [each.origin, each.destination] == expected
            assert before.origin not in chosen or before.destination not in chosen
        assert not former
        for automaton in made.automata[1:-1]:
            owner = made.owner(automaton)
            assert owner is not None
            assert automaton.father == (child.id if owner.id in chosen else 1)
        assert parse(session.text(), Message("Cannot read")) == made
        session.undo()
        assert session.text() == original
        session.redo()
        assert session.version.document is made
    finally:
        session.close(discard=True)


def test_a_group_begins_where_the_first_transition_leads_in() -> None:
    document = tree()
    root = document.automata[0]
    grouped = GroupStates(automaton=1, states=(2,), name="both").apply(document)
    (group,) = (state for state in grouped.automata[0].states if state.name == "both")
    assert (group.id, group.initial, group.history.text) == (3, False, "restart")
    assert [state.name for state in grouped.automata[-1].states if state.initial] == ["work"]
    assert [(each.origin, each.destination) for each in grouped.automata[0].transitions] == [(1, 3), (3, 1)]
    assert grouped.automata[-1].iteration_time == root.iteration_time


@pytest.mark.parametrize(
    ("variables", "kept", "taken"),
    [
        ("count = 0\nspeed = 1\n", "speed = 1\n", "count = 0"),
        ("count = 0  # so\nimport math\nfar = math.pi\n", "import math\nfar = math.pi\n", "count = 0  # so"),
        (
            "count = [\n    1,\n]\n\nfar = count[0]\nspeed = 1",
            "\nspeed = 1",
            "count = [\n    1,\n]\nfar = count[0]",
        ),
        ("count = 0\nspeed = count\n", "count = 0\nspeed = count\n", ""),
        ("speed = 1\ncount = speed\n", "speed = 1\ncount = speed\n", ""),
        ("count = 0; speed = 1", "count = 0; speed = 1", ""),
        ("count, speed = 0, 1", "count, speed = 0, 1", ""),
        ("int count = 0;", "int count = 0;", ""),
    ],
)
def test_variables_that_nothing_else_uses_go_along(variables: str, kept: str, taken: str) -> None:
    assert split_variables(variables, {"count", "far", "speed"}, {"speed"}) == (kept, taken)
    states = (
        State(id=1, name="in", initial=True, code=Text("count += far(speed)")),
        State(id=2, name="out", code=Text("speed = 2")),
    )
    document = Document(automata=(Automaton(id=1, states=states, variables=Text(variables)),))
    top, child = GroupStates(automaton=1, states=(1,)).apply(document).automata
    assert (top.variables.text, child.variables.text) == (kept, taken)


def test_nothing_cannot_be_grouped() -> None:
    with pytest.raises(EditError, match="no state is selected"):
        GroupStates(automaton=1, states=()).apply(tree())
