"""Events of a project, and the listeners that get them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from visualhfsm import AddState, Opened, Project


@pytest.fixture
def project(tmp_path: Path) -> Iterator[Project]:
    with Project(tmp_path, journals=tmp_path / "journals") as opened:
        yield opened


def test_listeners_of_a_project_hear_of_documents_that_are_opened_later(project: Project) -> None:
    heard: list[object] = []
    unsubscribe = project.subscribe(heard.append)
    document = project.new()
    document.apply(AddState(automaton=1, x=0, y=0))
    document.close(discard=True)
    assert [type(each).__name__ for each in heard] == ["Opened", "Changed", "Closed"]
    assert heard[0] == Opened(document)
    unsubscribe()
    project.new()
    assert len(heard) == 3


def test_a_listener_that_fails_undoes_nothing(project: Project, caplog: pytest.LogCaptureFixture) -> None:
    heard: list[object] = []

    def fail(event: object) -> None:
        raise RuntimeError(f"a fault at {event}")

    project.subscribe(fail)
    project.subscribe(heard.append)
    document = project.new()
    document.apply(AddState(automaton=1, x=0, y=0))
    assert document.version.revision == 1
    assert len(heard) == 2
    assert "a fault" in caplog.text
