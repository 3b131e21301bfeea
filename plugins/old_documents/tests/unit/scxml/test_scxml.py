"""SCXML: the output conforms to the recommendation, and is read back as the same document."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Automaton, Document, State, Text, Transition
from plugins.old_documents.tests.support.scxml_documents import export, facts, import_
from plugins.old_documents.tests.support.scxml_rules import violations
from tests.support.codegen_command import ROOT
from tests.support.examples import examples
from tests.support.random_documents import documents, trees


@pytest.mark.slow
@settings(max_examples=examples(8), deadline=None)
@given(trees)
def test_a_document_of_any_shape_comes_back_as_it_was(document: Document) -> None:
    text, _ = export(document)
    again, diagnostics = import_(text)
    assert again == document, diagnostics.render()
    assert violations(text) == []


@pytest.mark.slow
@settings(max_examples=examples(6), deadline=None)
@given(documents)
def test_whatever_is_in_a_document_comes_back_as_it_was(document: Document) -> None:
    text, _ = export(document)
    again, diagnostics = import_(text)
    assert again == document, diagnostics.render()
    assert violations(text) == []


_scripts = st.sampled_from(["", "x = 1", "\n  a()\n  b('<&>')\n", "x = ']]>'"])
_triggers = st.one_of(
    st.tuples(
        st.just("event"), st.sampled_from(["go", "go on", "a.b", "done", "error", "_x0020_", "ñ", "*"])
    ),
    st.tuples(st.just("time"), st.sampled_from(["0", "1.5", "500", "60000"])),
    st.tuples(st.just("condition"), st.sampled_from(["x > 1", "True", "self.f()"])),
    st.just(("finished", "")),
)


@st.composite
def charts(draw: st.DrawFn) -> Document:
    """Return a document of which SCXML can express all, numbered as the reader does."""
    automata: list[Automaton] = []

    def grow(father: int, depth: int) -> int:
        own = len(automata) + 1
        automata.append(Automaton(id=own))  # its place
        amount = draw(st.integers(1, 3))
        first = draw(st.integers(1, amount))
        children: list[tuple[int, ...]] = []
        for _ in range(amount):
            below = draw(st.integers(0, 2)) if depth < 3 and len(automata) < 8 else 0
            children.append(tuple(grow(own, depth + 1) for _ in range(below)))
        states = [
            State(
                id=number,
                name=f"s{own}_{number}",
                initial=number == first,
                final=not inside and draw(st.integers(0, 4)) == 0,
                children=inside,
                history=Text(draw(st.sampled_from(["", "restart"])) if inside else ""),
                entry=Text(draw(_scripts)),
                exit=Text(draw(_scripts)),
            )
            for number, inside in enumerate(children, 1)
        ]
        leaving = [state.id for state in states if not state.final]
        ends = draw(st.lists(st.sampled_from(leaving), max_size=4)) if leaving else []
        transitions = []
        for number, origin in enumerate(sorted(ends), 1):
            kind, trigger = draw(_triggers)
            guard = "" if kind == "condition" else draw(st.sampled_from(["", "x < 2"]))
            destination = draw(st.integers(1, amount))
            transitions.append(
                Transition(
                    id=number, origin=origin, destination=destination, type=kind, trigger=Text(trigger),
                    guard=Text(guard), code=Text(draw(_scripts)),
                )
            )  # fmt: skip
        variables = draw(st.sampled_from(["", f"v{own} = 1", f"v{own} = [1]\nw{own} = 'a'"]))
        automata[own - 1] = Automaton(
            id=own,
            father=father,
            states=tuple(states),
            transitions=tuple(transitions),
            variables=Text(variables),
        )
        return own

    grow(0, 1)
    return Document(automata=tuple(automata))


@settings(max_examples=examples(6), deadline=None)
@given(charts())
def test_the_chart_alone_says_what_the_document_does(document: Document) -> None:
    text, reported = export(document)
    start, end = text.index("<hfsm:document>"), text.index("</hfsm:document>")
    chart, diagnostics = import_(text[:start] + text[end + len("</hfsm:document>") :])
    assert chart is not None
    assert (list(reported), list(diagnostics)) == ([], [])
    assert facts(chart) == facts(document)
    for old, new in zip(document.automata, chart.automata, strict=True):
        assert old.variables == new.variables
        assert [(each.entry, each.exit) for each in old.states] == [
            (each.entry, each.exit) for each in new.states
        ]


_FOLDERS = ("behaviors", "tests/data/components", "tests/data/documents")
_FILES = sorted(path for folder in _FOLDERS for path in (ROOT / folder).rglob("*.xml"))


@pytest.mark.slow
def test_documents_of_the_project_come_back_as_they_were() -> None:
    for path in _FILES:
        document = read_document(path, Diagnostics())
        if document is not None:
            text, _ = export(document)
            again, diagnostics = import_(text)
            assert again == document, path
            assert {found.code for found in diagnostics} <= {"W541"}, diagnostics.render()
            assert violations(text) == [], path
    assert len(_FILES) > 100
