"""What a program with a name saves is a step of it for others who have the document open."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.documents import document, state, sub
from visualhfsm import AddState, FileChanged, OpenDocument, Project, RenameState

ADD = AddState(automaton=1, x=200, y=100, name="more")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "walk.xml"
    file.write_text(document(sub(1, 0, state(1, "go", initial=True))))
    return file


@pytest.fixture
def page(path: Path, tmp_path: Path) -> Iterator[OpenDocument]:
    """The document as a person has it open."""
    with Project(path.parent, journals=tmp_path / ".mine") as project:
        yield project.open(path)


@pytest.fixture
def agent(path: Path, tmp_path: Path) -> Iterator[OpenDocument]:
    with Project(path.parent, journals=tmp_path / ".its", author="agent") as project:
        yield project.open(path)


def names(opened: OpenDocument) -> list[str]:
    return [each.name for each in opened.automata[0].states]


def test_its_step_stands_in_undo_under_its_name_and_is_undone_as_one(
    page: OpenDocument, agent: OpenDocument
) -> None:
    heard: list[FileChanged] = []
    page.subscribe(lambda event: heard.append(event) if isinstance(event, FileChanged) else None)
    agent.apply([ADD, RenameState(automaton=1, state=1, name="went")])
    agent.save()
    assert page.refresh() == "same"
    its = "agent: Add a state, Rename “go”"
    assert [(each.state, each.message) for each in heard] == [("reloaded", its)]
    assert page.version.undo[0].name == its
    assert names(page) == ["went", "more"]
    agent.undo()
    agent.save()
    page.refresh()
    assert [each.name for each in page.version.undo] == ["agent: Undo", its]
    assert names(page) == ["go", "more"]
    page.undo()
    page.undo()
    assert names(page) == ["go"]


@pytest.mark.parametrize(
    "forged", ["", "{}", '{"digest": 3}', '{"digest":"0","author":"you","step":"x"}', "[" * 100_000]
)
def test_a_note_that_is_none_of_this_version_names_nobody(
    page: OpenDocument, agent: OpenDocument, path: Path, forged: str
) -> None:
    agent.apply(ADD)
    agent.save()
    (path.parent / ".visualhfsm" / "walk.xml.json").write_text(forged)
    page.refresh()
    assert page.version.undo[0].name == "Take the file as it is now"


def test_what_a_note_says_is_one_short_line(page: OpenDocument, agent: OpenDocument, path: Path) -> None:
    agent.apply(ADD)
    agent.save()
    note = path.parent / ".visualhfsm" / "walk.xml.json"
    note.write_text(note.read_text().replace("Add a state", "\\u001b[2J\\n" + "x" * 500))
    page.refresh()
    name = page.version.undo[0].name
    assert name.startswith("agent: ")
    assert name.isprintable()
    assert len(name) <= 80


@pytest.mark.parametrize("name", [".visualhfsm", ".visualhfsm/walk.xml.json"])
def test_a_note_is_not_written_through_a_link(
    agent: OpenDocument, path: Path, name: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    outside = tmp_path_factory.mktemp("outside")
    link = path.parent / name
    link.parent.mkdir(exist_ok=True)
    link.symlink_to(outside if name == ".visualhfsm" else outside / "file")
    agent.apply(ADD)
    agent.save()
    assert not [*outside.iterdir()]


def test_people_leave_no_notes(page: OpenDocument, path: Path) -> None:
    page.apply(ADD)
    page.save()
    assert not (path.parent / ".visualhfsm").exists()
