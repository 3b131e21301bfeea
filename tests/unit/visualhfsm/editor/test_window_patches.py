"""Documents as JSON, and what is sent after a change."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from subprocess import PIPE
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.hfsm.document import Automaton, Document, State, Text, Transition
from tests.support.any_text import any_text
from tests.support.editor import patched
from tests.support.examples import examples
from tests.support.limits import END_LIMIT
from tests.support.places import ROOT
from visualhfsm._editor.window import Sent, full, patch

codes = st.builds(Text, any_text(max_size=5))
# States and transitions are chosen, since each draw takes time; so the same ones also come again.
states = st.sampled_from(
    [
        State(id=number, name=name, code=Text(code), children=children)
        for number in range(1, 6)
        for name in ("", "a", "ñ\n")
        for code in ("", "x")
        for children in ((), (1,), (6, 2))
    ]
)
transitions = st.sampled_from(
    [
        Transition(id=number, origin=origin, destination=destination, code=Text(code))
        for number in range(1, 6)
        for origin in range(1, 6)
        for destination in range(1, 6)
        for code in ("", "x", "ñ\n")
    ]
)
automata = st.builds(
    Automaton,
    id=st.integers(1, 6),
    father=st.integers(0, 6),
    states=st.lists(states, max_size=4).map(tuple),
    transitions=st.lists(transitions, max_size=4, unique_by=lambda each: each.id).map(tuple),
    variables=codes,
)
documents = st.builds(
    Document,
    automata=st.lists(automata, max_size=5, unique_by=lambda each: each.id).map(tuple),
    description=codes,
)


def decoded(version: Sent) -> dict[str, Any]:
    found: dict[str, Any] = msgspec.json.decode(full(version))
    return found


several = st.lists(documents, min_size=2, max_size=4).map(
    lambda versions: [Sent(document, "robot") for document in versions]
)


@settings(max_examples=examples(30))
@given(several)
def test_patches_lead_from_version_to_version(versions: list[Sent]) -> None:
    page = decoded(versions[0])
    for shown, version in pairwise(versions):
        change = patch(shown, version)
        assert change is not None
        patched(page, msgspec.json.decode(change))
        assert page == decoded(version)


Show = Callable[[list[dict[str, Any]]], dict[str, Any]]


@pytest.fixture(scope="module")
def show() -> Iterator[Show]:
    """Return what lets the page's own store take pushes, and returns the document that it shows then."""
    if shutil.which("node") is None:
        pytest.skip("Node.js is not installed")
    script = ROOT / "tests" / "page" / "patches.js"
    with subprocess.Popen(["node", script], stdin=PIPE, stdout=PIPE, text=True) as node:
        stdin, stdout = node.stdin, node.stdout
        assert stdin is not None
        assert stdout is not None

        def take(pushes: list[dict[str, Any]]) -> dict[str, Any]:
            print(json.dumps(pushes), file=stdin, flush=True)
            shown: dict[str, Any] = json.loads(stdout.readline())
            return shown

        yield take
        stdin.close()
        node.wait(END_LIMIT)


@pytest.mark.slow
@settings(max_examples=examples(30))
@given(several)
def test_the_page_shows_what_the_server_has(show: Show, versions: list[Sent]) -> None:
    about = {"push": "document", "tab": 1, "revision": 1, "undo": [], "redo": [], "dirty": False}
    assert show([{**about, "full": decoded(versions[0])}]) == decoded(versions[0])
    for shown, version in pairwise(versions):
        change = msgspec.json.decode(patch(shown, version) or b"")
        assert show([{**about, "patch": change}]) == decoded(version)


def changes(before: Document, after: Document) -> dict[str, Any]:
    found: dict[str, Any] = msgspec.json.decode(patch(Sent(before, "nao"), Sent(after, "nao")) or b"")
    return found


def test_only_what_changed_is_in_a_patch() -> None:
    one, two = Automaton(id=1), Automaton(id=2, father=1)
    before = Document(automata=(one, two))
    after = Document(automata=(one, replace(two, functions=Text("x = 1"))))
    assert changes(before, before) == {}
    assert changes(before, after) == {"parts": [{"id": 2, "fields": {"functions": "x = 1"}}]}
    renamed = msgspec.json.decode(patch(Sent(after, "robot"), Sent(after, "nao")) or b"")
    assert renamed["document"]["name"] == "nao"
    assert renamed.keys() == {"document"}
    assert [automaton["id"] for automaton in changes(Document(automata=(one,)), before)["automata"]] == [2]


def test_of_an_automaton_only_the_states_and_transitions_that_changed_are_sent() -> None:
    many = tuple(State(id=number, name=f"state {number}") for number in range(1, 301))
    loops = tuple(Transition(id=number, origin=number, destination=number) for number in range(1, 301))
    before = Automaton(id=1, states=many, transitions=loops)
    named = replace(many[1], name="wait")
    after = replace(before, states=(many[0], named, *many[3:], State(id=301, name="")), transitions=loops[1:])
    [part] = changes(Document(automata=(before,)), Document(automata=(after,)))["parts"]
    assert [(each["id"], each["name"]) for each in part["states"]["changed"]] == [(2, "wait"), (301, "")]
    assert part["states"]["removed"] == [3]
    assert part["transitions"] == {"removed": [1]}
    swapped = replace(before, transitions=(loops[1], loops[0], *loops[2:]))
    [part] = changes(Document(automata=(before,)), Document(automata=(swapped,)))["parts"]
    assert part["transitions"] == {"order": [2, 1, *range(3, 301)]}


def test_automata_whose_states_share_an_id_are_sent_whole() -> None:
    before = Automaton(id=1, states=(State(id=1, name="one"),))
    after = replace(before, states=(*before.states, State(id=1, name="other")))
    found = changes(Document(automata=(before,)), Document(automata=(after,)))
    assert [each["name"] for each in found["automata"][0]["states"]] == ["one", "other"]


def test_automata_with_the_same_id_are_sent_whole() -> None:
    before = Sent(Document(automata=(Automaton(id=1),)), "nao")
    after = Sent(Document(automata=(Automaton(id=1), Automaton(id=1, father=1))), "nao")
    assert patch(before, after) is None
    assert len(decoded(after)["automata"]) == 2
