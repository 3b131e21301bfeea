"""Which piece of code a line of a document belongs to, and where the lines of a component come from."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, read_document
from codegen.hfsm.document import Document, Text
from tests.support.documents import document, state, sub, transition
from visualhfsm.generation import generate_component
from visualhfsm.places import CodePlace, PlacedLine, find_line, pieces, replace_text
from visualhfsm.running.origins import read_origins

TEXT = document(
    sub(
        1, 0, state(1, "go", "\nx += 1\nraise ValueError(x)\n", initial=True), state(2, "end"),
        transition(1, 1, 2, "x > 1", code="self.help()"),
        variables="x = 0", functions="def help(self):\n    return 1\n",
    )
)  # fmt: skip


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "walk.xml"
    path.write_text(TEXT, encoding="utf-8")
    return path


@pytest.fixture
def read(file: Path) -> Document:
    found = read_document(file, Diagnostics())
    assert found is not None
    return found


def line_of(text: str) -> int:
    return next(number for number, line in enumerate(TEXT.split("\n"), 1) if text in line)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("raise ValueError", PlacedLine(CodePlace("state", "code", 1, 1), 3)),
        ("x &gt; 1", PlacedLine(CodePlace("transition", "trigger", 1, 1), 1)),
        ("x = 0", PlacedLine(CodePlace("automaton", "variables", 1), 1)),
        ("return 1", PlacedLine(CodePlace("automaton", "functions", 1), 2)),
        ("iteration_time", None),
    ],
)
def test_a_line_of_the_file_belongs_to_a_piece(
    read: Document, text: str, expected: PlacedLine | None
) -> None:
    assert find_line(read, line_of(text)) == expected


def test_a_line_of_another_file_does_not(read: Document) -> None:
    assert find_line(read, line_of("raise ValueError"), "other.xml") is None


def test_every_piece_can_be_replaced_and_nothing_else_changes(read: Document) -> None:
    for place, text, _ in pieces(read):
        changed = replace_text(read, place, Text("new"))
        assert changed is not None
        differing = [
            (there, after.text)
            for (there, before, _), (_, after, _) in zip(pieces(read), pieces(changed), strict=True)
            if before.text != after.text
        ]
        assert differing == [(place, "new")]
        assert replace_text(changed, place, text) == read


@pytest.mark.parametrize(
    "place",
    [
        CodePlace("state", "code", 1, 9),
        CodePlace("state", "code", 9, 1),
        CodePlace("state", "argument", 1, 1, "speed"),
        CodePlace("transition", "entry", 1, 1),
        CodePlace("document", "code"),
    ],
)
def test_what_is_not_there_is_not_replaced(read: Document, place: CodePlace) -> None:
    assert replace_text(read, place, Text("new")) is None


def test_output_is_led_back_to_the_document(file: Path) -> None:
    component = generate_component(file, None, Diagnostics())
    assert component is not None
    origins = read_origins(file, component)
    assert origins is not None
    lines = component.read_text().split("\n")
    number = next(number for number, line in enumerate(lines, 1) if "raise ValueError" in line)
    wanted = PlacedLine(CodePlace("state", "code", 1, 1), 3)
    assert origins.find(f'  File "{component}", line {number}, in run_go') == wanted
    told = f"ERROR walk: walk/go: ValueError: 2 at walk.py:{number} (walk.xml:{line_of('raise ValueError')})"
    assert origins.find(told) == wanted
    assert origins.find(f'  File "/usr/lib/python3/random.py", line {number}, in f') is None
    assert origins.find(f'  File "{component}", line 3') is None
    assert origins.find("x = 1") is None


def test_a_document_that_was_not_read_from_a_file_has_no_lines() -> None:
    parsed = parse_document(TEXT.encode(), Path("walk.xml"), Diagnostics())
    assert parsed is not None
    blank = replace_text(parsed, CodePlace("state", "code", 1, 1), Text("a\nb"))
    assert blank is not None
    assert all(
        find_line(blank, line) != PlacedLine(CodePlace("state", "code", 1, 1), 1) for line in range(1, 60)
    )
