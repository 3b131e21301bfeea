"""The shelf: what its files say, and what of them is refused."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from visualhfsm._base.errors import EditError, MissingError
from visualhfsm.project._editing.shelf import ReadyState, Shelves, our_shelf

WORTHWHILE = """<VisualHFSM>
  <description>Knock twice. Then
    wait for an answer.</description>
  {shelf}
  <SubAutomata id="1" idFather="0">
    <state id="1" initial="true"><name>knock</name></state>
    <state id="2"><name>knocked</name><final>true</final></state>
    <input><name>times</name><type>int</type><default>2</default><description>How often</description></input>
  </SubAutomata>
  <config>
    <iceinterface><nameinterface>Arm</nameinterface><nameproxy>LeftArm</nameproxy><interface>Joints</interface></iceinterface>
  </config>
</VisualHFSM>
"""
SHELF = (
    "<shelf><title>Knock!</title><category>Doors</category><icon>wave</icon><words>door tap</words></shelf>"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The shelf of a project, which has the only folder above it."""
    folder = tmp_path / "project" / "shelf"
    folder.mkdir(parents=True)
    return folder


def own(folder: Path) -> list[ReadyState]:
    return [each for each in Shelves(folder.parent).states() if each.own]


@pytest.mark.slow
def test_a_file_needs_nothing_but_a_name(folder: Path) -> None:
    (folder / "Doors_and_more").mkdir()
    (folder / "Doors_and_more" / "knock_twice.xml").write_text(WORTHWHILE.format(shelf=""))
    (found,) = own(folder)
    assert (found.title, found.category) == ("knock twice", "Doors and more")
    assert (found.summary, found.text) == ("Knock twice.", "Knock twice. Then wait for an answer.")
    assert [(each.name, each.default) for each in found.inputs] == [("times", "2")]
    assert [(each.identity, each.type) for each in found.needs] == [("LeftArm", "Joints")]
    assert found.ends
    assert found.path == "shelf/Doors_and_more/knock_twice.xml"


def test_the_postures_that_its_code_names_are_known(folder: Path) -> None:
    ours = {each.title: each.postures for each in Shelves(folder.parent).states()}
    assert ours["Sit"] == ("Sit",)
    assert ours["Stand"] == ("Stand",)
    assert ours["Kick"] == ()


def test_a_file_says_how_it_is_shown(folder: Path) -> None:
    (folder / "a.xml").write_text(WORTHWHILE.format(shelf=SHELF))
    (found,) = own(folder)
    assert (found.title, found.category, found.icon, found.words) == ("Knock!", "Doors", "wave", "door tap")


def test_what_it_imports_comes_along_with_functions_and_nothing_from_above(folder: Path) -> None:
    library = """<VisualHFSM><SubAutomata id="1" idFather="0">
      <state id="1" initial="true"><name>s</name><idSubautomataSon>2</idSubautomataSon></state>
      <functions>def helper(self): return 1</functions></SubAutomata>
      <SubAutomata id="2" idFather="1"><state id="1" initial="true"><name>inner</name></state></SubAutomata>
    </VisualHFSM>"""
    importing = """<VisualHFSM><SubAutomata id="1" idFather="0">
      <state id="1" initial="true"><name>s</name><idSubautomataSon>2</idSubautomataSon></state></SubAutomata>
      <SubAutomata id="2" idFather="1"><import automaton="2">{file}</import></SubAutomata></VisualHFSM>"""
    (folder / "parts").mkdir()
    (folder / "parts" / "library.xml").write_text(library)
    (folder / "uses.xml").write_text(importing.format(file="parts/library.xml"))
    (folder.parent / "outside.xml").write_text(library)
    (folder / "reaches.xml").write_text(importing.format(file="../outside.xml"))
    shelves = Shelves(folder.parent)
    troubles = {each.path: each.trouble for each in shelves.states() if each.own}
    assert troubles["shelf/uses.xml"] == ""
    assert "outside" in troubles["shelf/reaches.xml"]
    _, text = shelves.content("own/uses.xml")
    document = parse_document(text, Path("x.xml"), Diagnostics())
    assert document is not None
    assert document.root is not None
    assert "helper" in document.root.functions.text
    assert [state.name for each in document.automata for state in each.states] == ["s", "inner"]


def test_what_cannot_be_used_says_why_and_is_not_drawn(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "secret.xml").write_text(WORTHWHILE.format(shelf=SHELF))
    (folder / "away.xml").symlink_to(tmp_path / "secret.xml")
    (folder / "loop.xml").symlink_to("loop.xml")
    (folder / "empty.xml").write_text("<VisualHFSM/>")
    (folder / "folder.xml").mkdir()
    (folder / "folder.xml" / "inside.xml").write_text("no XML")
    os.mkfifo(folder / "pipe.xml")
    (folder / "large.xml").write_bytes(b"<" * ((1 << 20) + 1))
    shelves = Shelves(folder.parent)
    troubles = {each.id: each.trouble for each in shelves.states() if each.own}
    assert {name: bool(trouble) for name, trouble in troubles.items()} == {
        f"own/{name}.xml": True
        for name in ("away", "loop", "empty", "folder", "folder.xml/inside", "pipe", "large")
    }
    assert "leads out" in troubles["own/away.xml"]
    for each in troubles:
        with pytest.raises(EditError, match="Cannot draw"):
            shelves.content(each)
    with pytest.raises(MissingError, match="is not on the shelf"):
        shelves.content("own/../secret.xml")


def test_links_of_folders_are_not_followed(folder: Path, tmp_path: Path) -> None:
    away = tmp_path / "away"
    away.mkdir()
    (away / "a.xml").write_text(WORTHWHILE.format(shelf=SHELF))
    (folder / "linked").symlink_to(away)
    assert own(folder) == []
    (folder / "linked").unlink()
    folder.rmdir()
    folder.symlink_to(away)
    assert own(folder) == []


def test_a_change_is_seen_at_once(folder: Path) -> None:
    shelves = Shelves(folder.parent)
    assert not [each for each in shelves.states() if each.own]
    file = folder / "a.xml"
    file.write_text(WORTHWHILE.format(shelf=""))
    (before,) = [each for each in shelves.states() if each.own]
    file.write_text(WORTHWHILE.format(shelf=SHELF))
    (after,) = [each for each in shelves.states() if each.own]
    assert (before.title, after.title) == ("a", "Knock!")
    file.unlink()
    assert not [each for each in shelves.states() if each.own]


def test_ours_are_complete_and_are_no_projects() -> None:
    ours = Shelves(our_shelf().parent).states()  # a checkout as the project: each is listed once
    assert ours
    for each in ours:
        assert not each.own
        assert not each.trouble
        assert each.title
        assert each.summary.endswith(".")
        assert each.icon
        assert each.words
        assert each.ends
        assert all(given.description for given in each.inputs)
