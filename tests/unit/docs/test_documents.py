"""docs/reference/documents.md: its example is written as shown, and its tables agree with the reader."""

from __future__ import annotations

import re

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.formats.schema import ANNOTATION, AUTOMATON, DOCUMENT, INTERFACE, STATE, TRANSITION
from tests.support.pages import DOCS
from visualhfsm._commands.convert import EPILOG

PAGE = (DOCS / "reference/documents.md").read_text("utf-8")
KINDS = (DOCUMENT, AUTOMATON, STATE, TRANSITION, ANNOTATION, INTERFACE)
TABLES = {kind.tag: frozenset(kind.children) for kind in KINDS}


def test_the_example_is_written_as_it_stands() -> None:
    (example,) = re.findall(r"```xml\n(.*?)```", PAGE, re.DOTALL)
    diagnostics = Diagnostics()
    document = parse_document(example, DOCS / "waver.xml", diagnostics, remarks=diagnostics)
    assert document is not None
    assert write_document(document) == example
    assert not len(diagnostics), diagnostics.render()


def test_the_example_has_every_element() -> None:
    (example,) = re.findall(r"```xml\n(.*?)```", PAGE, re.DOTALL)
    tags = set(re.findall(r"<(\w+)", example))
    assert frozenset().union(*TABLES.values()) - tags == {"dialect", "language"}


def test_the_tables_have_every_element_and_no_other() -> None:
    for section in re.split(r"^### ", PAGE, flags=re.MULTILINE)[1:]:
        title, _, text = section.partition("\n")
        if title in TABLES:
            rows = re.findall(r"^\| (`.*?) \|", text, re.MULTILINE)
            assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == TABLES[title], title


def test_the_examples_of_the_command_are_those_of_its_help() -> None:
    commands = [line for line in EPILOG.splitlines() if line.startswith("visualhfsm")]
    assert [line for line in commands if f"$ {line}" not in PAGE] == []
