"""Where the lines of a component's output come from."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from tests.support.documents import document, state, sub, transition
from visualhfsm.editing.places import Place
from visualhfsm.generation import generate_component
from visualhfsm.running.origins import Origin, Origins, read_origins

TEXT = document(
    sub(
        1, 0, state(1, "go", "\nx += 1\nraise ValueError(x)\n", initial=True), state(2, "end"),
        transition(1, 1, 2, "x > 1", code="self.help()"),
        variables="x = 0", functions="def help(self):\n    return 1\n",
    )
)  # fmt: skip


@pytest.fixture
def component(tmp_path: Path) -> Path:
    path = tmp_path / "walk.xml"
    path.write_text(TEXT, encoding="utf-8")
    written = generate_component(path, None, Diagnostics())
    assert written is not None
    return written


@pytest.fixture
def origins(component: Path) -> Origins:
    found = read_origins(component.with_suffix(".xml"), component)
    assert found is not None
    return found


def line_of(text: str, content: str) -> int:
    return next(number for number, line in enumerate(content.split("\n"), 1) if text in line)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("raise ValueError", Origin(Place(kind="state", automaton=1, id=1, part="code"), 3)),
        ("return 1", Origin(Place(kind="automaton", automaton=1, part="functions"), 2)),
        ("x = 0", Origin(Place(kind="automaton", automaton=1, part="variables"), 1)),
    ],
)
def test_a_frame_of_a_traceback_is_led_back_to_its_piece_of_code(
    origins: Origins, component: Path, text: str, expected: Origin
) -> None:
    number = line_of(text, component.read_text())
    assert origins.find(f'  File "{component}", line {number}, in run_go') == expected


def test_a_line_of_the_log_is_led_back_too(origins: Origins) -> None:
    told = f"ERROR walk: walk/go: ValueError: 2 at walk.py:9 (walk.xml:{line_of('raise ValueError', TEXT)})"
    assert origins.find(told) == Origin(Place(kind="state", automaton=1, id=1, part="code"), 3)


@pytest.mark.parametrize(
    "line",
    [
        '  File "/usr/lib/python3/random.py", line 30, in f',
        '  File "{component}", line 3',
        '  File "{component}", line 9999999999',
        "at other.py:9 (other.xml:4)",
        "at walk.py:9 (walk.xml:999999999)",
        "x = 1",
        "",
    ],
)
def test_other_lines_come_from_nowhere(origins: Origins, component: Path, line: str) -> None:
    assert origins.find(line.replace("{component}", str(component))) is None


def test_a_component_that_cannot_be_read_has_no_origins(component: Path) -> None:
    component.unlink()
    assert read_origins(component.with_suffix(".xml"), component) is None
