"""Documents in parts, which are read as their text is, and only again where they changed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics, Severity
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.document import Automaton, Document, Element, Library, State, Text
from tests.support.editing import large_document, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.parts import Parts, split
from visualhfsm._document.places import Place, texts_in
from visualhfsm.project._check_process import CheckProcess

PATH = Path("a.xml")
CODE = Place(kind="state", automaton=1, id=1, part="code")


def read(document: Document, parts: Parts | None = None) -> tuple[Document, Diagnostics]:
    found = (parts or Parts()).read(split(document), PATH, diagnostics := Diagnostics(decoded=True))
    assert found is not None
    return found, diagnostics


@pytest.mark.parametrize(
    "document",
    [
        Document(),
        tree(),
        large_document(30),
        replace(
            tree(),
            root_tag="VisualStates",
            dialect=Text("VisualStates"),
            libraries=(Library(name=Text("math")),),
            lists=(Element("config", (("kind", "ros"),)), Element("events", (("by", "hand"),))),
            extras=(Element("nombreEsquema", (), "old"), Element("stat", (), "new")),
        ),
    ],
)
def test_parts_are_read_as_the_text_is(document: Document) -> None:
    found, diagnostics = read(document)
    text = write_document(document)
    whole = parse_document(text, PATH, in_text := Diagnostics(decoded=True))
    assert whole is not None
    assert found == whole
    assert [each.message for each in diagnostics] == [each.message for each in in_text]
    placed = [[each for each in texts_in(one) if each.line] for one in (found, whole)]
    ordered = [sorted(each, key=lambda text: (text.line, text.column)) for each in placed]
    assert [each.place for each in ordered[0]] == [each.place for each in ordered[1]]


def test_only_what_has_changed_is_read_again() -> None:
    parts = Parts()
    before, _ = read(tree(), parts)
    after, _ = read(SetText(place=CODE, text="x = 2\n\ny = 3").apply(tree()), parts)
    assert after.automata[0] != before.automata[0]
    assert all(one is other for one, other in zip(after.automata[1:], before.automata[1:], strict=True))


@pytest.mark.slow
def test_what_cannot_be_written_is_not_checked() -> None:
    checks = CheckProcess()
    try:
        for code, why in (("x = '\x00'", "does not allow"), ("x = '\ud800'", "surrogate")):
            only = Automaton(id=1, states=(State(id=1, name="a", code=Text(code)),))
            with pytest.raises(EditError, match=why):
                checks.check(Document(automata=(only,)), None)
        assert Severity.ERROR in checks.check(SetText(place=CODE, text="(").apply(tree()), None).counts
    finally:
        checks.close()
