"""The source map of a component, read from its file and by the running component."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import write_document
from codegen.hfsm.document import Text
from codegen.hfsm.loading import load_document
from codegen.hfsm.source_map import SourceMap
from codegen.source_rows import SourceRow
from hfsm_runtime import VirtualRun
from hfsm_runtime.errors import VariablesError
from hfsm_runtime.source_map import sources_of
from tests.support.documents import load
from tests.support.memory import garbage_that_parses
from tests.support.model_documents import automaton, document, state, when
from visualhfsm.simulation._loading import load_component

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


def place_of_failure(path: Path) -> str:
    """Return the message of the component of a document whose variables fail."""
    with pytest.raises(VariablesError) as raised:
        VirtualRun(load_component(path)())
    return str(raised.value)


def test_each_row_names_the_lines_of_the_document(path: Path) -> None:
    text = component(path)
    written, made = path.read_text("utf-8").split("\n"), text.split("\n")
    rows = SourceMap.read(text).rows
    assert [(row.part, row.automaton, row.id) for row in rows] == [
        ("variables", 1, 0),
        ("entry", 1, 1),
        ("code", 1, 1),
        ("trigger", 1, 7),
    ]
    for row in rows:
        assert row.file == "behavior.xml"
        for line in range(row.first, row.last + 1):
            # The document escapes `>`, and has its tags before the first line.
            found = written[row.line_of(line) - 1].replace("&gt;", ">")
            assert made[line - 1].strip().removeprefix("return ") in found


def test_the_runtime_and_the_editor_read_the_same_place(path: Path) -> None:
    broken = load_component(path)
    with pytest.raises(VariablesError) as raised:
        VirtualRun(broken())
    place = re.search(r"behavior\.py:(\d+) \((behavior\.xml):(\d+)\)", str(raised.value))
    assert place is not None, raised.value
    line, file, number = int(place[1]), place[2], int(place[3])
    row = SourceMap.read(component(path)).find(line)
    assert row is not None
    assert (row.part, row.file, row.line_of(line)) == ("variables", file, number)
    assert "1 / 0" in path.read_text("utf-8").split("\n")[number - 1]
    namespace = vars(sys.modules[broken.__module__])
    assert sources_of(namespace) == {row.file}
    assert [SourceRow(*each) for each in namespace["SOURCE_MAP"]] == [*SourceMap.read(component(path)).rows]


def test_the_map_of_an_older_version_still_leads_to_the_document(tmp_path: Path, path: Path) -> None:
    text = component(path)
    rows = tuple(tuple(row) for row in SourceMap.read(text).rows)
    begin, _, end = text.partition("\nSOURCE_MAP = source_map(__file__, (")
    (tmp_path / "older.py").write_text(f"{begin}\nSOURCE_MAP = {rows!r}{end.partition('))')[2]}")
    with pytest.raises(VariablesError, match=r"older\.py:\d+ \(behavior\.xml:(\d+)\)") as raised:
        VirtualRun(load(tmp_path / "older.py"))
    assert re.findall(r"xml:(\d+)", str(raised.value)) == re.findall(r"xml:(\d+)", place_of_failure(path))


def test_a_component_that_is_generated_again_keeps_the_map_of_its_code(tmp_path: Path, path: Path) -> None:
    file = tmp_path / "behavior.py"
    file.write_text(component(path))
    running = load(file)
    file.write_text("\n" * 50 + component(path))
    with pytest.raises(VariablesError) as raised:
        VirtualRun(running)
    assert re.findall(r"xml:(\d+)", str(raised.value)) == re.findall(r"xml:(\d+)", place_of_failure(path))


def test_garbage_that_parses_at_its_end_hides_no_map(tmp_path: Path) -> None:
    path = tmp_path / "many.xml"
    path.write_text(write_document(document(automaton(1, [state(number) for number in range(1, 400)]))))
    text = component(path)
    found = SourceMap.read(text)
    with garbage_that_parses():
        assert SourceMap.read(text).rows == found.rows


def test_a_generated_line_is_in_no_row(path: Path) -> None:
    text = component(path)
    found = SourceMap.read(text)
    generated = next(number for number, line in enumerate(text.split("\n"), 1) if line.startswith("class "))
    assert found.find(generated) is None
    assert found.find(10_000) is None


@pytest.mark.parametrize("table", ["(1, 2,", "7", "(1, 2, 3)", "call()", '("code 1.1", "code 1.9")'])
def test_an_edited_table_has_no_rows(path: Path, table: str) -> None:
    begin, _, _ = component(path).partition("\nSOURCE_MAP = ")
    assert SourceMap.read(f"{begin}\nSOURCE_MAP = source_map(__file__, (\n    {table}\n))\n").rows == ()
