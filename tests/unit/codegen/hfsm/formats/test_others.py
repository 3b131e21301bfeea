"""Documents of other editors, with the plug-ins of somebody else, and with none."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from codegen.diagnostics import Diagnostics, Note
from codegen.hfsm import parse_document
from codegen.hfsm.code.former import FormerCode, FormerNames, Given, former_code
from codegen.hfsm.document import Automaton, Document
from codegen.hfsm.formats import others
from codegen.hfsm.formats.xml_tree import XmlElement, read_root
from codegen.hfsm.loading import load_document
from codegen.messages import Message
from tests.support.documents import document, state, sub
from tests.support.plugins import without
from zenoh_ice import plugins

VISUALSTATES = '<VisualStates>\n<state id="0"><state id="1"/></state></VisualStates>'
SPANISH = "<VisualHFSM><SubAutomata><idSub>1</idSub><Estado><id>1</id></Estado></SubAutomata></VisualHFSM>"


class Chart:
    """A format of which the root alone says what it is."""

    suffix = ".chart"
    guide = "chart.md"

    def recognizes(self, root: XmlElement) -> bool:
        return root.tag == "chart"

    def read(
        self, root: XmlElement, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None
    ) -> Document | None:
        return Document(automata=(Automaton(id=int(root.attributes["id"])),))


class Spoken(FormerCode):
    """Code that is no Python where it says please."""

    def is_other_language(self, code: str) -> bool:
        return "please" in code

    def notes_about(self, code: str) -> list[Note]:
        return [Note(Message("say it in Python"))]

    def former_names(self, document: Document, **_names: Any) -> FormerNames:
        return FormerNames({}, {}, {}, {}, {"heard": Given("[]", Message("a list"))}, frozenset({"heard"}))


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """The formats that are installed: none, unless a test adds one."""
    found: list[Any] = []
    monkeypatch.setattr(plugins, "each", lambda _seam: iter([("one", each) for each in found]))
    others.formats.cache_clear()
    with without("visualhfsm_old_documents"):
        yield found
    others.formats.cache_clear()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<scxml/>", "`scxml` is not the root of a document: it must be `VisualHFSM`"),
        (VISUALSTATES, "`state` is not in the format of VisualHFSM"),
        (SPANISH, "`idSub` is not in the format of VisualHFSM"),
    ],
)
@pytest.mark.usefixtures("installed")
def test_without_plug_ins_a_document_of_another_editor_says_what_to_install(text: str, problem: str) -> None:
    diagnostics = Diagnostics()
    assert parse_document(text, Path("a.xml"), diagnostics) is None
    (error,) = diagnostics
    assert str(error.message) == problem
    assert [str(note.message) for note in error.notes] == [
        "what reads documents of other editors is not installed: pip install visualhfsm"
    ]


@pytest.mark.usefixtures("installed")
def test_without_plug_ins_our_own_documents_are_read_as_ever() -> None:
    for text in (
        "<VisualHFSM/>",
        "<VisualHFSM><SubAutomata/></VisualHFSM>",
        document(sub(1, 0, state(1, "a"))),
    ):
        diagnostics = Diagnostics()
        assert parse_document(text, Path("a.xml"), diagnostics) is not None, diagnostics.render()


@pytest.mark.usefixtures("installed")
def test_without_plug_ins_former_code_cannot_be_fixed() -> None:
    assert former_code().modernize(Document(), Path(), Diagnostics(), fixes=False) == Document()
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'visualhfsm\[python2\]'"):
        former_code().modernize(Document(), Path(), Diagnostics(), fixes=True)


def test_a_file_is_imported_in_the_format_of_its_name_or_root(installed: list[Any]) -> None:
    chart = Chart()
    installed.append(chart)
    assert others.imported_suffixes() == [".chart"]
    assert others.writable_formats() == {}
    assert others.imported_format("a.CHART", b"anything") is chart
    assert others.imported_format("a.xml", b'<!-- one --><chart id="3">') is chart
    assert others.imported_format("a.xml", b"<VisualHFSM><chart/>") is None
    root = read_root(b'<chart id="3"><')
    assert root is not None
    assert chart.read(root, Path(), Diagnostics(), None) == Document(automata=(Automaton(id=3),))


@pytest.fixture
def spoken(monkeypatch: pytest.MonkeyPatch) -> None:
    """What knows about code, in place of our plug-in."""
    monkeypatch.setitem(sys.modules, "visualhfsm_old_documents", Spoken())


@pytest.mark.usefixtures("spoken")
def test_a_component_gets_the_names_that_its_code_relies_on(tmp_path: Path) -> None:
    path = tmp_path / "old.xml"
    path.write_text(document(sub(1, 0, state(1, "a", "self.heard.append(1)", initial=True))))
    diagnostics = Diagnostics()
    loaded = load_document(path, None, diagnostics)
    assert loaded is not None
    assert "    heard = []\n" in loaded.component
    assert [str(each.message) for each in diagnostics if each.code == "N504"] == [
        "`self.heard` is a list, as in the components of 2017"
    ]


@pytest.mark.usefixtures("spoken")
def test_what_is_wrong_with_code_has_the_notes_of_the_plug_in(tmp_path: Path) -> None:
    path = tmp_path / "old.xml"
    path.write_text(document(sub(1, 0, state(1, "a", "walk please", initial=True))))
    diagnostics = Diagnostics()
    assert load_document(path, None, diagnostics) is None
    assert [str(note.message) for note in diagnostics.errors[0].notes] == ["say it in Python"]
