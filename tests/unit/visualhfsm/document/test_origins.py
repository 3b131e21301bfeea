"""The origins of the lines of a component's output."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest

from codegen.diagnostics import Diagnostics
from codegen.messages import Message
from tests.support.documents import document, state, sub, transition
from tests.support.present import present
from visualhfsm._document.generate import generate_component
from visualhfsm._document.origins import Origin, Origins, read_origins
from visualhfsm._document.places import Place

TEXT = document(
    sub(
        1, 0, state(1, "go", "\nx += 1\nraise ValueError(x)\n", initial=True), state(2, "end"),
        transition(1, 1, 2, "x > 1", code="self.help()"),
        variables="x = 0", functions="def help(self):\n    return 1\n",
    ),
    libraries=("math", "json"),
)  # fmt: skip


def generated(path: Path, text: str = TEXT) -> Path:
    """Write a document and generate its component; return the component's file."""
    path.write_text(text, encoding="utf-8")
    return present(generate_component(path, None, Diagnostics()))


def origins_of(component: Path) -> Origins:
    return present(read_origins(component.with_suffix(".xml"), component))


@pytest.fixture
def component(tmp_path: Path) -> Path:
    return generated(tmp_path / "walk.xml")


@pytest.fixture
def origins(component: Path) -> Origins:
    return origins_of(component)


def line_of(text: str, content: str) -> int:
    return next(number for number, line in enumerate(content.split("\n"), 1) if text in line)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("raise ValueError", Origin(Place(kind="state", automaton=1, id=1, part="code"), 3)),
        ("return 1", Origin(Place(kind="automaton", automaton=1, part="functions"), 2)),
        ("x = 0", Origin(Place(kind="automaton", automaton=1, part="variables"), 1)),
        ("import json", Origin(Place(kind="document", part="libraries", index=1, name="name"), 1)),
    ],
)
def test_a_frame_of_a_traceback_is_led_back_to_its_piece_of_code(
    origins: Origins, component: Path, text: str, expected: Origin
) -> None:
    number = line_of(text, component.read_text())
    assert origins.find(f'  File "{component}", line {number}, in run_go') == expected


def test_a_line_of_the_log_is_led_back_too(origins: Origins) -> None:
    logged = f"ERROR walk: walk/go: ValueError: 2 at walk.py:9 (walk.xml:{line_of('raise ValueError', TEXT)})"
    assert origins.find(logged) == Origin(Place(kind="state", automaton=1, id=1, part="code"), 3)


def test_code_of_a_transition_is_called_by_its_name_and_ends(origins: Origins) -> None:
    logged = f"ERROR walk: walk/go: ValueError: 2 at walk.py:9 (walk.xml:{line_of('self.help()', TEXT)})"
    found = present(origins.find(logged))
    assert found.transition == "go → end"
    assert found == origins.element(1, 1, 1)._replace(place=found.place, line=1)  # type: ignore[union-attr]


def test_a_library_that_could_not_be_imported_is_led_back_to_its_entry(origins: Origins) -> None:
    line = line_of("<lib>json", TEXT)
    expected = Origin(Place(kind="document", part="libraries", index=1, name="name"), 1)
    assert origins.find(f"walk.py: error: walk.xml:{line}: the library json is not installed") == expected
    assert origins.find(f"os._exit(3) ends the process at walk.py:9 (walk.xml:{line})") == expected
    assert origins.find(f"walk.py: error: other.xml:{line}: the library json is not installed") is None


def test_what_the_line_says_before_does_not_matter(origins: Origins) -> None:
    place = f"(walk.xml:{line_of('raise ValueError', TEXT)})"
    expected = Origin(Place(kind="state", automaton=1, id=1, part="code"), 3)
    for before in ("walk/go (again): f() at ", "(old.xml:3) ", "(" * 4000):
        assert origins.find(f"{before}{place}") == expected


def test_a_comment_of_a_person_is_never_taken_for_the_place_of_code(tmp_path: Path) -> None:
    functions = "# walk.xml:1\ndef help(self):\n    # copied from old.xml:200\n    return 1\n"
    text = document(sub(1, 0, state(1, "go", initial=True), functions=functions))
    component = generated(tmp_path / "walk.xml", text)
    origins = origins_of(component)
    number = line_of("return 1", component.read_text())
    expected = Origin(Place(kind="automaton", automaton=1, part="functions"), 4)
    assert origins.find(f'  File "{component}", line {number}, in help') == expected


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


def test_without_its_component_lines_of_the_document_are_found(component: Path) -> None:
    component.unlink()
    origins = origins_of(component)
    assert origins.find(f'  File "{component}", line 30, in walk') is None
    document = component.with_suffix(".xml").read_text().split("\n")
    line = next(number for number, text in enumerate(document, 1) if "<code>" in text)
    found = present(origins.find(f"at walk.py:57 (walk.xml:{line})"))
    assert found.place.part == "code"


def test_pieces_that_share_a_line_are_distinguished(tmp_path: Path) -> None:
    text = document(
        sub(
            1, 0, state(1, "go", "print(1)", initial=True, child=2), state(2, "end", "print(2)"),
            transition(1, 1, 2, "self.x == 1", code="print(2)", name="t"), transition(2, 2, 1, "self.x == 2", name="u"),
        ),
        sub(2, 1, state(1, "inner", "print(2)", initial=True)),
    )  # fmt: skip
    component = generated(tmp_path / "walk.xml", text.replace("\n", ""))
    origins = origins_of(component)
    lines = component.read_text().split("\n")

    def place(function: str) -> Place | None:
        above = next(number for number, line in enumerate(lines, 1) if f"def {function}(" in line)
        first = above + 2 if lines[above].lstrip().startswith("#") else above + 1
        found = origins.find(f'  File "{component}", line {first}, in {function}')
        return found and found.place

    def automaton(number: int, kind: Literal["state", "transition"], id: int, part: str) -> Place:
        return Place(kind=kind, automaton=number, id=id, part=part)

    assert place("state_go") == automaton(1, "state", 1, "code")
    assert place("state_end") == automaton(1, "state", 2, "code")
    assert place("guard_t") == automaton(1, "transition", 1, "trigger")
    assert place("guard_u") == automaton(1, "transition", 2, "trigger")
    assert place("fired_t") == automaton(1, "transition", 1, "fired")
    assert place("state_inner") == automaton(2, "state", 1, "code")

    reported = present(origins.find("walk.py:9 (walk.xml:1)", automaton=1, state=2))
    assert reported.place == automaton(1, "state", 2, "code")
    reported = present(origins.find("walk.py:9 (walk.xml:1)", automaton=2, state=1))
    assert reported.place == automaton(2, "state", 1, "code")


def importing(directory: Path) -> Path:
    """Write a document whose state `top` imports TEXT, and generate it; return its component."""
    (directory / "parts.xml").write_text(TEXT, encoding="utf-8")
    imported = '<SubAutomata id="2" idFather="1"><import>parts.xml</import></SubAutomata>'
    text = document(sub(1, 0, state(1, "top", initial=True, child=2)), imported)
    return generated(directory / "above.xml", text)


def test_imported_code_is_led_back_to_its_automaton_in_the_document_and_to_its_file(tmp_path: Path) -> None:
    component = importing(tmp_path)
    origins = origins_of(component)
    number = line_of("raise ValueError", component.read_text())
    line = line_of("raise ValueError", TEXT)
    place = Place(kind="state", automaton=2, id=1, part="code")
    source = Place(kind="state", automaton=1, id=1, part="code")
    owners = (Place(kind="state", automaton=1, id=1),)
    expected = Origin(place, 3, "parts.xml", source, Message("code of go, line 3"), owners)
    assert origins.find(f'  File "{component}", line {number}, in run_go') == expected
    assert (
        origins.find(f"ERROR above: go: ValueError: 1 at {component.name}:{number} (parts.xml:{line})")
        == expected
    )
    assert origins.texts(place) == ("\nx += 1\nraise ValueError(x)\n",)


def test_what_was_executed_last_in_an_imported_automaton_is_found(tmp_path: Path) -> None:
    origins = origins_of(importing(tmp_path))
    found = present(origins.element(2, 1, 0))
    assert (found.place, found.file) == (Place(kind="state", automaton=2, id=1), "parts.xml")
    assert found.owners == (Place(kind="state", automaton=1, id=1),)
    assert origins.state_name(2, 1) == "go"


def test_a_library_of_an_imported_file_is_at_the_state_that_imports_it(tmp_path: Path) -> None:
    origins = origins_of(importing(tmp_path))
    line = line_of("<lib>json", TEXT)
    found = present(origins.find(f"above.py: error: parts.xml:{line}: No module named 'json'"))
    assert found.place == Place(kind="state", automaton=1, id=1)
    assert found.source == Place(kind="document", part="libraries", index=1, name="name")


def test_a_copy_of_a_document_imports_what_the_document_does(tmp_path: Path) -> None:
    component = importing(tmp_path)
    path = component.with_suffix(".xml")
    copy = tmp_path / "copy" / path.name
    copy.parent.mkdir()
    copy.write_text(path.read_text())
    origins = present(read_origins(copy, component, [tmp_path], home=path))
    found = present(
        origins.find(f'  File "{component}", line {line_of("raise", component.read_text())}, in x')
    )
    assert found.file == "parts.xml"
