"""The picture of an automaton: what it shows, and that no document breaks it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import pytest
from hypothesis import given, settings

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Annotation, Automaton, Document, Import, State, Text, Transition
from tests.support.examples import examples
from tests.support.places import ROOT
from tests.support.random_documents import documents
from visualhfsm._base.errors import MissingError
from visualhfsm._drawing.svg import svg

SVG = "{http://www.w3.org/2000/svg}"
TRANSLATED = re.compile(r"translate\((-?[\d.]+),(-?[\d.]+)\)")
BEHAVIORS = sorted((ROOT / "behaviors").glob("*.xml"))


def drawn(document: Document, automaton: int = 1, component: str = "root") -> Element:
    return ElementTree.fromstring(svg(document, automaton, component=component))


def texts(picture: Element) -> list[str]:
    """Return the texts of a picture in its order, those of several lines with the lines joined."""
    found = ["".join(each.itertext()) for each in picture.iter(f"{SVG}text")]
    return [text for text in found if text]


def texts_in(part: Element, right: float = 0.0, down: float = 0.0) -> Iterator[tuple[float, float]]:
    """Yield the places of texts; groups may be moved."""
    for child in part:
        moved = TRANSLATED.fullmatch(child.get("transform", ""))
        dx, dy = map(float, moved.groups()) if moved else (0.0, 0.0)
        if child.tag == f"{SVG}text" and child.get("x") is not None:
            yield right + float(child.get("x", "")), down + float(child.get("y", ""))
        yield from texts_in(child, right + dx, down + dy)


def one(
    *states: State, transitions: tuple[Transition, ...] = (), more: tuple[Automaton, ...] = ()
) -> Document:
    return Document(automata=(Automaton(id=1, states=states, transitions=transitions), *more))


def test_states_and_transitions_have_their_names_and_what_fires_them() -> None:
    states = (State(id=1, name="walk", initial=True), State(id=2, name="rest", x=300))
    transitions = (
        Transition(id=1, name="tired", origin=1, destination=2, type="time", trigger=Text("1500")),
        Transition(id=2, origin=2, destination=1, type="event", trigger=Text("whistle"), guard=Text("fit\n")),
        Transition(id=3, origin=2, destination=2, type="finished", name="again"),
    )
    found = texts(drawn(one(*states, transitions=transitions)))
    assert found == ["tired", "1.5 s", "1", "whistle [fit]", "2", "again", "walk", "rest"]


def test_everything_lies_on_the_sheet() -> None:
    for path in BEHAVIORS:
        document = read_document(path, Diagnostics())
        assert document is not None
        for automaton in document.automata:
            picture = drawn(document, automaton.id)
            left, top, width, height = map(float, picture.get("viewBox", "").split())
            assert (picture.get("width"), picture.get("height")) == (f"{width:.0f}", f"{height:.0f}")
            for x, y in texts_in(picture):
                assert left < x < left + width
                assert top < y < top + height
            for state in automaton.states:
                assert left + 40 < state.x < left + width - 40
                assert top + 40 < state.y < top + height - 40


def test_the_title_is_the_component_or_the_state_that_owns_the_automaton() -> None:
    own = State(id=1, name="search", children=(2,))
    document = one(own, more=(Automaton(id=2, father=1), Automaton(id=3, father=9)))
    titles = [drawn(document, number, "robot").findtext(f"{SVG}title") for number in (1, 2, 3)]
    assert titles == ["robot", "search", "automaton 3"]


def test_a_state_whose_automaton_comes_from_another_file_says_so() -> None:
    imported = Automaton(id=2, father=1, imported=Import(file=Text("other.xml")))
    plain = drawn(one(State(id=1, name="a", children=(2,)), more=(Automaton(id=2, father=1),)))
    other = drawn(one(State(id=1, name="a", children=(2,)), more=(imported,)))
    assert len(list(other.iter(f"{SVG}rect"))) == len(list(plain.iter(f"{SVG}rect"))) + 1


def test_names_of_others_are_text_and_nothing_else() -> None:
    hostile = "</text><script>alert(\"1\")</script><a href='x'>&amp;"
    states = (State(id=1, name="&<>\"'"), State(id=2, name="\x00\ud800\x1b[31m", x=200))
    arc = Transition(id=1, name=hostile[:18], origin=1, destination=2, trigger=Text(hostile[7:22]))
    document = one(*states, transitions=(arc,), more=(Automaton(id=2, father=1),))
    text = svg(document, 1, component=hostile)
    picture = ElementTree.fromstring(text.encode())
    assert {each.tag.removeprefix(SVG) for each in picture.iter()} == {
        *("svg", "title", "rect", "g", "path", "circle", "text", "tspan"),
    }
    assert picture.findtext(f"{SVG}title") == hostile
    assert texts(picture)[0] == hostile[:18]
    assert "&<>\"'" in texts(picture)
    assert "\N{REPLACEMENT CHARACTER}" in texts(picture)[-1]
    assert not re.search(r"url\(|href|style", text.replace("&lt;a href", ""))


@pytest.mark.slow
@settings(max_examples=examples(20))
@given(document=documents)
def test_every_document_has_a_picture(document: Document) -> None:
    for automaton in document.automata:
        ElementTree.fromstring(svg(document, automaton.id).encode())


def test_invalid_documents_are_drawn_as_far_as_they_go() -> None:
    assert texts(drawn(one())) == []
    far = State(id=1, name="far", x=1e300, y=-1e300)
    twice = State(id=1, name="twice")
    lost = tuple(
        Transition(id=number, name=f"t{number}", origin=origin, destination=destination, x=50)
        for number, (origin, destination) in enumerate([(1, 9), (9, 1), (8, 9)])
    )
    found = texts(drawn(one(far, twice, transitions=lost)))
    assert {"far", "twice", "t0", "t1", "t2"} <= {*found}


def test_an_unknown_automaton_is_an_error_that_names_the_known_ones() -> None:
    document = one(State(id=1, name="a"), more=(Automaton(id=7, father=1),))
    with pytest.raises(MissingError, match=r"no automaton 5: its automata are 1, 7"):
        svg(document, 5)
    with pytest.raises(MissingError, match="none"):
        svg(replace(document, automata=()), 1)


def test_notes_and_frames_are_below_the_states() -> None:
    annotations = (
        Annotation(id=1, x=-100, y=0, width=120, height=60, text=Text("why")),
        Annotation(id=2, kind="frame", x=0, y=-100, width=400, height=300, text=Text("begin")),
    )
    document = one(State(id=1, name="wait", x=100, y=50))
    document = replace(document, automata=(replace(document.automata[0], annotations=annotations),))
    picture = drawn(document)
    assert texts(picture) == ["begin", "why", "wait"]
    assert picture.get("viewBox") == "-124 -124 548 348"
