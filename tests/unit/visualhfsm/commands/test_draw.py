"""`visualhfsm draw`: the picture of a document on the command line."""

from __future__ import annotations

import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.support.commands import run_here
from tests.support.documents import document, state, sub, transition
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app

TITLE = "{http://www.w3.org/2000/svg}title"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a document of three automata, two of which one state owns."""
    parent = state(1, "walk", initial=True).replace(
        "<idSubautomataSon>0</idSubautomataSon>", "<idSubautomataSon>2</idSubautomataSon><child>3</child>"
    )
    parts = (
        sub(1, 0, parent, state(2, "rest", child=4), transition(1, 1, 2, "True", name="tired")),
        sub(2, 1, state(3, "left", initial=True)),
        sub(3, 1, state(4, "right", initial=True)),
        sub(4, 1, state(5, "sleep", initial=True)),
    )
    (tmp_path / "robot.xml").write_text(document(*parts))
    return tmp_path


def draw(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return run_here(app, "visualhfsm", "draw", *arguments, cwd=cwd, expected=(VisualHfsmError,))


def title(picture: str) -> str | None:
    return ElementTree.fromstring(picture.encode()).findtext(TITLE)


def test_the_picture_of_the_root_lies_beside_the_document_and_is_not_overwritten(folder: Path) -> None:
    done = draw("robot.xml", cwd=folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "wrote robot.svg\n")
    picture = folder / "robot.svg"
    assert title(picture.read_text("utf-8")) == "robot"

    picture.write_text("mine")
    done = draw("robot.xml", cwd=folder)
    assert done.returncode == 2
    assert "--force" in done.stderr
    assert picture.read_text() == "mine"
    assert draw("robot.xml", "--force", cwd=folder).returncode == 0
    assert title(picture.read_text("utf-8")) == "robot"


def test_an_automaton_is_named_by_its_state_or_its_number(folder: Path) -> None:
    done = draw("robot.xml", "-", "--automaton", "rest", cwd=folder)
    assert (done.returncode, title(done.stdout)) == (0, "rest")
    assert ">sleep<" in done.stdout
    assert ">right<" in draw("robot.xml", "-", "--automaton", "3", cwd=folder).stdout


def test_a_name_that_means_no_automaton_or_several_is_an_error(folder: Path) -> None:
    done = draw("robot.xml", "--automaton", "run", cwd=folder)
    assert done.returncode == 1
    assert "no state named run has an automaton; those that have one: rest, walk" in done.stderr
    done = draw("robot.xml", "--automaton", "walk", cwd=folder)
    assert done.returncode == 1
    assert "choose one of 2, 3" in done.stderr
    assert not (folder / "robot.svg").exists()


def test_what_cannot_be_drawn_is_an_error(folder: Path) -> None:
    (folder / "broken.xml").write_text("<VisualHFSM>")
    assert "broken.xml:1" in draw("broken.xml", cwd=folder).stderr
    (folder / "none.xml").write_text("<VisualHFSM></VisualHFSM>")
    done = draw("none.xml", cwd=folder)
    assert (done.returncode, "the document has no root" in done.stderr) == (1, True)
    done = draw("robot.xml", "missing/robot.svg", cwd=folder)
    assert done.returncode == 1
    assert "missing/robot.svg: cannot be written" in done.stderr


def test_a_page_has_all_automata(folder: Path) -> None:
    done = draw("robot.xml", "robot.html", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "wrote robot.html\n")
    assert (folder / "robot.html").read_text("utf-8").startswith("<!doctype html>")
    done = draw("robot.xml", "other.html", "--automaton", "rest", cwd=folder)
    assert done.returncode == 2
    assert "shows all automata" in done.stderr
