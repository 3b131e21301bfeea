"""What the tests of projects share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from codegen.hfsm import write_document
from tests.support.editing import tree
from visualhfsm import AddState, AddTransition, OpenDocument, Place, Project, SetText


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("root")


@pytest.fixture(scope="module")
def project(root: Path) -> Iterator[Project]:
    """Have one project for all tests, whose processes are started before them."""
    with Project(root, journals=root / ".journals") as opened:
        document = opened.new()
        document.apply(AddState(automaton=1, x=0, y=0))
        document.check()
        document.complete(Place(kind="state", automaton=1, id=1, part="code"))
        document.close(discard=True)
        yield opened


@pytest.fixture
def document(project: Project, root: Path) -> Iterator[OpenDocument]:
    """Open a document of one automaton with the states `wait` and `go`."""
    (root / "waver.xml").write_text(write_document(tree()))
    opened = project.open("waver.xml")
    yield opened
    opened.close(discard=True)


@pytest.fixture
def blinker(project: Project) -> Iterator[OpenDocument]:
    """Make a document whose automaton goes from `off` to `on` after a second."""
    made = project.new()
    made.apply(
        [AddState(automaton=1, x=100, y=100, name="off"), AddState(automaton=1, x=300, y=100, name="on")]
    )
    made.apply(AddTransition(automaton=1, origin=1, destination=2, type="time", name="wait"))
    made.apply(SetText(place=Place(kind="transition", automaton=1, id=1, part="trigger"), text="1000"))
    yield made
    made.close(discard=True)
