"""The columns of diagnostics are those of the file, whatever is written before them in its line."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics, as_github, as_json
from codegen.hfsm import compile_document
from tests.support.editing import find_problems

WRONG = "unknown_one"

CODE = {
    "plain": "x = 1 + unknown_one",
    "less": "x = 1 &lt; unknown_one",
    "twice": "x = 1 &lt; 2 and 3 &gt;= unknown_one",
    "ampersands": "x = 6 &amp; 3 &amp; unknown_one",
    "numeric": "x = &quot;&#233;&#xe9;&quot; + unknown_one",
    "after it": "x = unknown_one &lt; 2",
    "later line": "x = 1 &lt; 2\ny = x &gt; unknown_one",
    "line after": "x = 1 &lt; 2\ny = unknown_one",
    "tab": "if 1 &lt; 2:\n\tx =\t1 &lt; unknown_one",
    "indented": "\n    x = 1 &lt; 2\n    y = 3 &lt; unknown_one\n",
    "indented by tabs": "\n\tx = 1\n\tif x:\n\t\ty = 3 &lt; unknown_one\n",
    "comment with less indentation": "\n    x = 1\n  # &lt;\n    y = 3 &lt; unknown_one\n",
    "less in a bracket": "\n    x = max(1 &lt; 2,\n  unknown_one)\n",
    "accents": "x = 'ñandú' + unknown_one",
    "accents and entities": "x = 'ñ&lt;ú' + unknown_one",
    "CDATA": "<![CDATA[x = 1 < 2 & unknown_one]]>",
    "CDATA in the middle": "x = 1<![CDATA[ < 2 & unknown_one]]>",
    "comment of XML": "x = 1<!-- one --> + unknown_one",
    "CRLF": "x = 1 &lt; 2\r\ny = x &gt; unknown_one\r\n",
}
PLACES = {
    "state": '<state id="1" initial="true"><name>a &lt; b</name><code>{code}</code></state>',
    "attribute": '<state note="&lt;&amp;" id="1" initial="true"><name>a</name><entry>x = 0 &lt; 1</entry><code>{code}</code></state>',
    "variables": '<state id="1" initial="true"><name>a</name></state><variables>{code}</variables>',
}


def document(code: str, place: str) -> str:
    """Return a document with code in one of the places."""
    return f'<VisualHFSM><SubAutomata id="1" idFather="0">\n  {PLACES[place].format(code=code)}</SubAutomata></VisualHFSM>'


def place_of_the_fault(text: str) -> tuple[int, int]:
    """Return the line and column of the unknown name in a file."""
    before = text[: text.index(WRONG)].replace("\r\n", "\n")
    return before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1


def diagnose(path: Path, text: str) -> Diagnostics:
    path.write_bytes(text.encode())
    diagnostics = Diagnostics()
    compile_document(path, path.parent, diagnostics)
    return diagnostics


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("code", CODE.values(), ids=CODE)
def test_every_output_has_the_column_of_the_file(tmp_path: Path, code: str, place: str) -> None:
    text = document(code, place)
    diagnostics = diagnose(tmp_path / "main.xml", text)
    line, column = place_of_the_fault(text)
    (found,) = [each for each in json.loads(as_json(diagnostics)) if each["code"] == "W520"]
    assert (found["line"], found["column"], found["length"]) == (line, column, len(WRONG))
    assert f"line={line},col={column},endColumn={column + len(WRONG)}" in as_github(diagnostics)
    shown = diagnostics.render()
    assert f"main.xml:{line}:{column}: warning[W520]" in shown
    source, carets = re.findall(r"W520.*\n    (.*)\n    (.*)", shown)[0]
    assert source[carets.index("^") :].startswith(WRONG)
    assert carets.strip() == "^" + "~" * (len(WRONG) - 1)


@pytest.mark.parametrize(
    "before", ["x = 1 &lt; 2; ", "x = 'ñ&gt;'; ", "x = 'ñ'; ", "\tx = 1\n\tx = 1 &gt; 2; "]
)
@pytest.mark.parametrize(("wrong", "what"), [("yield 1", "yield"), ("break", "break"), ("a b", "b")])
def test_code_that_python_refuses_is_found_there_too(
    tmp_path: Path, before: str, wrong: str, what: str
) -> None:
    text = document(before + wrong, "state")
    (error,) = diagnose(tmp_path / "main.xml", text).errors
    line = text[: text.index(wrong)].count("\n") + 1
    written = text.split("\n")[line - 1]
    assert error.location.line == line
    assert written[error.location.column - 1 :].startswith((what, wrong))


def test_a_property_is_underlined_where_it_is_wrong(tmp_path: Path) -> None:
    expression = "a and a &amp; unknown_one"
    stated = f'<property kind="always"><expression>{expression}</expression></property>'
    body = '<state id="1" initial="true"><name>a</name></state>'
    text = f'<VisualHFSM><properties>\n{stated}</properties><SubAutomata id="1" idFather="0">{body}</SubAutomata></VisualHFSM>'
    (tmp_path / "main.xml").write_text(text)
    diagnostics = Diagnostics()
    compile_document(tmp_path / "main.xml", tmp_path, diagnostics, with_model=True)
    (error,) = diagnostics.errors
    written = text.split("\n")[error.location.line - 1]
    assert written[error.location.column - 1 :].startswith(("&amp;", WRONG))


@pytest.mark.parametrize("code", [CODE["less"], CODE["later line"], CODE["tab"]])
def test_the_editor_gets_the_place_in_the_text_that_it_shows(tmp_path: Path, code: str) -> None:
    found = next(
        each for each in find_problems(document(code, "state"), tmp_path / "main.xml") if each.code == "W520"
    )
    shown = code.replace("&lt;", "<").replace("&gt;", ">").split("\n")
    assert shown[found.line - 1][found.column - 1 :].startswith(WRONG)
