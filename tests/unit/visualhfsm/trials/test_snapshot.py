"""The files that a series takes along."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

from tests.support.documents import document, state, sub
from visualhfsm.trials import TrialsError
from visualhfsm.trials._snapshot import take_snapshot, unpack


@pytest.fixture
def project(tmp_path: Path) -> Path:
    for name in (
        "interfaces/bell.idl",
        "interfaces/bell.py",
        "behaviors/ring.xml",
        "behaviors/worlds/big.toml",
    ):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name, encoding="utf-8")
    return tmp_path / "behaviors" / "ring.xml"


def files(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_the_documents_folder_and_its_interfaces_are_taken_along(project: Path, tmp_path: Path) -> None:
    snapshot = take_snapshot(project)
    unpack(snapshot.archive, tmp_path / "there")
    assert files(tmp_path / "there") == [
        *("behaviors/ring.xml", "behaviors/worlds/big.toml", "interfaces/bell.idl", "interfaces/bell.py"),
    ]
    assert (tmp_path / "there" / snapshot.document).read_text() == "behaviors/ring.xml"


def test_what_is_hidden_foreign_or_of_trials_stays(project: Path) -> None:
    before = take_snapshot(project)
    for name in (".secret.py", "__pycache__/ring.py", "run.mcap", "ring.trials.toml", "ring.outcomes.csv"):
        path = project.parent / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("x", encoding="utf-8")
    assert take_snapshot(project) == before


def test_other_documents_are_no_part_of_it_and_models_are(project: Path) -> None:
    before = take_snapshot(project)
    project.with_name("other.xml").write_text("<VisualStates></VisualStates>", encoding="utf-8")
    assert take_snapshot(project) == before
    project.with_name("arm.xml").write_text("<mujoco></mujoco>", encoding="utf-8")
    assert take_snapshot(project).digest != before.digest


def test_what_a_document_imports_is_part_of_it(project: Path) -> None:
    (project.parent / "parts").mkdir()
    for name, imported in ((project.name, "parts/outer.xml"), ("parts/outer.xml", "../inner.xml")):
        text = document(f'<SubAutomata id="1" idFather="0"><import>{imported}</import></SubAutomata>')
        (project.parent / name).write_text(text, encoding="utf-8")
    for name in ("inner.xml", "another.xml"):
        (project.parent / name).write_text(
            document(sub(1, 0, state(1, "there", initial=True))), encoding="utf-8"
        )
    packed = zipfile.ZipFile(io.BytesIO(take_snapshot(project).archive)).namelist()
    assert {name for name in packed if name.endswith(".xml")} == {
        *("behaviors/ring.xml", "behaviors/parts/outer.xml", "behaviors/inner.xml"),
    }


def test_a_change_makes_another_snapshot_and_the_time_of_a_file_does_not(project: Path) -> None:
    before = take_snapshot(project)
    project.touch()
    assert take_snapshot(project) == before
    project.write_text("other", encoding="utf-8")
    assert take_snapshot(project).digest != before.digest


def test_a_folder_with_too_much_is_refused(project: Path) -> None:
    with project.with_name("large.csv").open("wb") as file:
        file.truncate(21 << 20)
    with pytest.raises(TrialsError, match="put it into another folder"):
        take_snapshot(project)
