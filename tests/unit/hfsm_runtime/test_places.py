"""Where lines of a running component stand in its document, as errors tell it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import write_document
from codegen.hfsm.document import Text
from codegen.hfsm.loading import load_document
from hfsm_runtime import Component, VirtualRun
from hfsm_runtime.errors import MissingLibraryError, VariablesError
from hfsm_runtime.loading import load_module
from hfsm_runtime.places import Line, read_source
from tests.support.documents import compile_to, generate, load, sub
from tests.support.documents import document as written_document
from tests.support.documents import state as written_state
from tests.support.model_documents import automaton, document, state, when

VARIABLES = "# the second line fails\nlimit = 1 / 0"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    root = automaton(
        1,
        [state(1, entry="x = 0", code="x += 1\nif x > limit:\n    x = 0"), state(2)],
        [when("x >\n  limit", 1, 2, id=7)],
        variables=Text(VARIABLES),
    )
    path = tmp_path / "behavior.xml"
    path.write_text(write_document(document(root)), encoding="utf-8")
    return path


def component(path: Path) -> str:
    loaded = load_document(path, None, diagnostics := Diagnostics())
    assert loaded is not None, diagnostics.render()
    return loaded.component


def place_of_failure(running: Component) -> str:
    """Return where the variables of a component fail in the document, as its error tells it."""
    with pytest.raises(VariablesError) as raised:
        VirtualRun(running)
    found = re.search(r"behavior\.py:\d+ \((.*)\)", str(raised.value))
    assert found is not None, raised.value
    return found[1]


def test_each_code_names_the_lines_of_the_document(path: Path) -> None:
    text = component(path)
    written, made = path.read_text("utf-8").split("\n"), text.split("\n")
    source = read_source(text)
    assert source.document == "behavior.xml"
    assert [(each.part, each.automaton, each.id) for each in source.codes] == [
        ("variables", 1, 0),
        ("entry", 1, 1),
        ("code", 1, 1),
        ("trigger", 1, 7),
    ]
    for code in source.codes:
        for number in range(code.first, code.last + 1):
            place = Line(str(path.with_suffix(".py")), number, source).in_document
            # The document escapes `>`, and has its tags before the first line.
            found = written[int(place.removeprefix("behavior.xml:")) - 1].replace("&gt;", ">")
            assert made[number - 1].strip().removeprefix("return ") in found


def test_a_generated_line_is_no_code(path: Path) -> None:
    text = component(path)
    source = read_source(text)
    generated = next(number for number, line in enumerate(text.split("\n"), 1) if line.startswith("class "))
    for number in (generated, 10_000):
        assert str(Line("behavior.py", number, source)) == f"behavior.py:{number}"


def test_without_its_document_a_place_is_a_line_of_the_code(path: Path) -> None:
    file = generate(path, path.parent)
    assert place_of_failure(load(file)).startswith("behavior.xml:")
    path.unlink()
    assert place_of_failure(load(file)) == "line 2 of variables 1"


@pytest.mark.parametrize("content", ["", "<VisualHFSM>", "no XML \0", "<VisualHFSM/>"])
def test_a_document_that_is_damaged_tells_no_line(path: Path, content: str) -> None:
    file = generate(path, path.parent)
    path.write_text(content)
    assert place_of_failure(load(file)) == "line 2 of variables 1"


def test_a_document_that_has_changed_tells_lines_of_the_code_that_it_still_has(path: Path) -> None:
    file, text = generate(path, path.parent), path.read_text()
    before = int(place_of_failure(load(file)).removeprefix("behavior.xml:"))
    path.write_text(text.replace("<VisualHFSM>", "<VisualHFSM>\n\n\n"))
    assert place_of_failure(load(file)) == f"behavior.xml:{before + 3}"
    path.write_text(text.replace("1 / 0", "2 / 0"))
    assert place_of_failure(load(file)) == "line 2 of variables 1"


def test_a_component_that_is_generated_again_keeps_the_places_of_its_code(path: Path) -> None:
    file = generate(path, path.parent)
    running, before = load(file), place_of_failure(load(file))
    file.write_text("\n" * 50 + file.read_text())
    assert place_of_failure(running) == before


def test_the_same_code_in_several_places_is_told_apart(tmp_path: Path) -> None:
    one = "<state id='1' initial='true'><name>one</name>\n<entry>x = 1</entry>\n<code>x = 1</code></state>\n"
    root = sub(1, 0, one, written_state(2, "two", "x = 1"), variables="x = 1")
    file = compile_to(tmp_path, written_document(root))
    source = read_source(file.read_text())
    places = [Line(str(file), code.first, source).in_document for code in source.codes]
    assert places == [f"behavior.xml:{line}" for line in (8, 4, 5, 6)]


def test_imported_code_leads_to_its_file_unless_that_has_it_twice(tmp_path: Path) -> None:
    child = [
        sub(
            1, 0, written_state(1, "a", "x = 1\ny = 1", initial=True, child=2), written_state(2, "b", "x = 1")
        ),
        sub(2, 1, written_state(1, "a", "x = 1", initial=True), written_state(2, "b", "x = 1")),
    ]
    (tmp_path / "child.xml").write_text(written_document(*child))
    stub = '<SubAutomata id="3" idFather="1"><import>child.xml</import></SubAutomata>\n'
    root = sub(1, 0, written_state(1, "only", "x = 1", initial=True, child=3))
    file = compile_to(tmp_path, written_document(root, stub))
    source = read_source(file.read_text())
    told = {code.key: str(Line(str(file), code.last, source)).partition(" ")[2] for code in source.codes}
    assert told["code 1.1"] == "(behavior.xml:3)"
    assert told["code 3.1"] == "(child.xml:4)"
    assert told["code 3.2"] == "(line 1 of code 3.2)"


def test_a_component_of_an_older_version_says_what_to_do(path: Path) -> None:
    file = generate(path, path.parent)
    file.write_text(file.read_text().replace("    main,\n", "    main,\n    source_map,\n", 1))
    with pytest.raises(
        MissingLibraryError, match=r"^behavior\.py: .*source_map.*generate .* again, by `codegen "
    ):
        load_module("behavior", file)
