"""Documents as JSON, and what of them is sent after a change."""

from __future__ import annotations

from typing import Any

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from codegen.hfsm.document import Automaton, Document, State, Text
from tests.support.editor import patched
from visualhfsm.web.rendering import Renderer, Rendering, full, patch

codes = st.builds(Text, st.text(max_size=5))
states = st.builds(
    State,
    id=st.integers(1, 5),
    name=st.text(max_size=5),
    code=codes,
    children=st.lists(st.integers(1, 6), max_size=2, unique=True).map(tuple),
)
automata = st.builds(
    Automaton, id=st.integers(1, 6), father=st.integers(0, 6), states=st.lists(states, max_size=3).map(tuple)
)
documents = st.builds(
    Document,
    automata=st.lists(automata, max_size=5, unique_by=lambda each: each.id).map(tuple),
    description=codes,
)


def decoded(rendering: Rendering) -> dict[str, Any]:
    found: dict[str, Any] = msgspec.json.decode(full(rendering))
    return found


@given(st.lists(documents, min_size=2, max_size=4))
def test_patches_lead_from_version_to_version(versions: list[Document]) -> None:
    renderer = Renderer()
    shown = renderer.render(versions[0], "robot")
    page = decoded(shown)
    for version in versions[1:]:
        rendering = renderer.render(version, "robot")
        change = patch(shown, rendering)
        assert change is not None
        patched(page, msgspec.json.decode(change))
        assert page == decoded(rendering)
        shown = rendering


def test_only_what_changed_is_in_a_patch() -> None:
    renderer = Renderer()
    one, two = Automaton(id=1), Automaton(id=2, father=1)
    before = renderer.render(Document(automata=(one, two)), "robot")
    changed = Automaton(id=2, father=1, functions=Text("x = 1"))
    after = renderer.render(Document(automata=(one, changed)), "robot")
    found = msgspec.json.decode(patch(before, after) or b"")
    assert found.keys() == {"automata"}
    assert [automaton["id"] for automaton in found["automata"]] == [2]
    renamed = msgspec.json.decode(
        patch(after, renderer.render(Document(automata=(one, changed)), "nao")) or b""
    )
    assert renamed["document"]["name"] == "nao"
    assert [automaton["title"] for automaton in renamed["automata"]] == ["nao"]


def test_automata_are_called_after_the_states_that_own_them() -> None:
    root = Automaton(id=1, states=(State(id=7, name="search", children=(2,)),))
    found = decoded(
        Renderer().render(
            Document(automata=(root, Automaton(id=2, father=1), Automaton(id=3, father=1))), "nao"
        )
    )
    assert [(each["title"], each["owner"]) for each in found["automata"]] == [
        ("nao", 0),
        ("search", 7),
        ("automaton 3", 0),
    ]


def test_automata_with_the_same_id_are_sent_whole() -> None:
    renderer = Renderer()
    before = renderer.render(Document(automata=(Automaton(id=1),)), "nao")
    after = renderer.render(Document(automata=(Automaton(id=1), Automaton(id=1, father=1))), "nao")
    assert patch(before, after) is None
    assert len(decoded(after)["automata"]) == 2
