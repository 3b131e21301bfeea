"""Marks in whole components: each line of code leads to the line that it was in the document."""

from __future__ import annotations

import difflib
import html
from pathlib import Path

import pytest

from codegen.code_marks import MarkedCode
from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from hfsm_runtime.places import Line, read_source
from tests.support.documents import document, problems, state, sub, transition
from tests.support.places import DATA, ROOT

DOCUMENTS = sorted(
    path
    for folder in ("behaviors", "examples", "tests/data/components")
    for path in (ROOT / folder).rglob("*.xml")
    if path.with_suffix(".py").exists() or path.parent == DATA / "components"
)
CHILD = document(
    sub(1, 0, state(1, "outer", "a = 1", initial=True, child=2), functions="def twice(self):\n    return 2"),
    sub(2, 1, state(1, "inner", "# first\nb = self.twice()", initial=True), variables="b = 0"),
)
IMPORT = """\
<SubAutomata id="{id}" idFather="1">
<import>{file}</import>
</SubAutomata>
"""


def component(path: Path) -> str:
    """Return the component of a document."""
    made = compile_document(path, None, diagnostics := Diagnostics())
    assert made is not None, diagnostics.render()
    return made[0].text


def unmarked(line: str) -> str:
    """Return a line of code of a component as it stands in a document."""
    return html.escape(line.partition("  # <")[0].strip(), quote=False).removeprefix("return ")


def check(path: Path) -> dict[MarkedCode, str]:
    """Check where each line of code in a document's component leads; return the places of first lines."""
    text = component(path)
    source, lines = read_source(text), text.split("\n")
    found = {}
    for code in source.codes:
        if code.part == "automaton":
            continue
        places = [
            Line(str(path.with_suffix(".py")), number, source).in_document
            for number in range(code.first, code.last + 1)
        ]
        found[code] = places[0]
        for number, place in enumerate(places, code.first):
            name, _, there = place.rpartition(":")
            written = (path.parent / name).read_text("utf-8").split("\n")[int(there) - 1]
            made = unmarked(lines[number - 1]).removeprefix("import ").removesuffix(",")
            assert made.rpartition(": ")[2] in written.replace("&quot;", '"').replace("&apos;", "'"), code
    return found


@pytest.mark.slow
@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_each_line_of_code_leads_to_its_line(path: Path) -> None:
    check(path)


def test_code_that_is_imported_several_times_leads_to_its_one_place(tmp_path: Path) -> None:
    (tmp_path / "child.xml").write_text(CHILD)
    path = tmp_path / "both.xml"
    path.write_text(
        document(
            sub(1, 0, state(1, "one", "x = 1", initial=True, child=2), state(2, "other", "x = 2", child=3)),
            *(IMPORT.format(id=number, file="child.xml") for number in (2, 3)),
        )
    )
    places = [place for code, place in check(path).items() if code.text == "a = 1"]
    assert len(places) == 2
    assert places[0] == places[1]


@pytest.mark.parametrize("layout", ["one line", "blank lines", "carriage returns"])
def test_the_layout_of_the_document_does_not_matter(tmp_path: Path, layout: str) -> None:
    text = document(
        sub(
            1, 0, state(1, "a", "x = 1", initial=True), state(2, "b", "x = 2"),
            transition(1, 1, 2, "x > 0", code="x = 3"), variables="x = 0", functions="def f(self): pass",
        ),
        libraries=("math", "time"),
    )  # fmt: skip
    changed = {
        "one line": text.replace("\n", ""),
        "blank lines": text.replace("<code>", "<code>\n\n  ").replace("</code>", "\n\n</code>\n\n"),
        "carriage returns": text.replace("\n", "\r\n"),
    }
    path = tmp_path / "walk.xml"
    path.write_bytes(changed[layout].encode())
    assert len(check(path)) == 8


def test_a_line_more_is_a_line_more_in_both(tmp_path: Path) -> None:
    path = tmp_path / "walk.xml"
    path.write_text(CHILD)
    before = component(path).split("\n")
    path.write_text(CHILD.replace("# first\n", "# first\n# second\n"))
    after = component(path).split("\n")
    changes = [line for line in difflib.ndiff(before, after) if line[0] in "+-"]
    assert changes == ["+             # second"]


def test_a_line_that_would_end_the_code_is_refused(tmp_path: Path) -> None:
    text = CHILD.replace("# first", "# &lt;/code 2.1&gt;")
    (found,) = [each for each in problems(tmp_path / "walk.xml", text) if "E520" in each]
    assert found.startswith("10:")
    assert "`# </code 2.1>` is what ends code in a component: change this comment" in found


def test_lines_like_marks_of_other_code_are_code(tmp_path: Path) -> None:
    path = tmp_path / "walk.xml"
    path.write_text(
        CHILD.replace("# first", "# &lt;/code 1.1&gt;\n# &lt;code 1.1&gt;\nb = 1  # &lt;trigger 1.1/&gt;")
    )
    assert [code.part for code in check(path)].count("code") == 2
