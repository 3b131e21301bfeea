"""Documents as JSON, and what the page makes of them, one after the other."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from subprocess import PIPE
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.hfsm.document import Automaton, Document, State, Text, Transition
from tests.support.any_text import any_text
from tests.support.examples import examples
from tests.support.limits import END_LIMIT
from tests.support.places import ROOT
from visualhfsm._editor.window import full

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


several = st.lists(documents, min_size=2, max_size=4)


Show = Callable[[list[dict[str, Any]]], dict[str, Any]]


@pytest.fixture(scope="module")
def show() -> Iterator[Show]:
    """Return what lets the page's own store take pushes, and returns the document that it shows then."""
    if shutil.which("node") is None:
        pytest.skip("Node.js is not installed")
    script = ROOT / "tests" / "page" / "pushes.js"
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
def test_the_page_shows_what_the_server_has(show: Show, versions: list[Document]) -> None:
    about = {"push": "document", "tab": 1, "undo": [], "redo": [], "dirty": False}
    for revision, version in enumerate(versions):
        sent = full(version, "robot")
        assert show([{**about, "revision": revision, "full": sent}]) == json.loads(json.dumps(sent))


def test_automata_with_the_same_id_are_all_sent() -> None:
    document = Document(automata=(Automaton(id=1), Automaton(id=1, father=1)))
    assert [each["father"] for each in full(document, "nao")["automata"]] == [0, 1]
