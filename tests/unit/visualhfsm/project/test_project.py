"""A project: documents below a folder, opened once, confined to it, and recovered."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from codegen.hfsm import write_document
from tests.support.codegen_command import codegen
from tests.support.editing import large_document, tree
from tests.support.limits import EVENT_LIMIT, RUN_LIMIT
from tests.support.plugins import OLD_DOCUMENTS
from visualhfsm import (
    AddEntry,
    AddState,
    AddTransition,
    EditError,
    ForbiddenPathError,
    MissingError,
    Project,
    TooManyError,
    WouldOverwriteError,
)
from visualhfsm._base.environment import child_environment

SCXML = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="a"><state id="a">'
    '<transition target="a" cond="In(\'b\')"/></state></scxml>'
)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    folder = tmp_path / "root"
    folder.mkdir()
    (folder / "waver.xml").write_text(write_document(tree()))
    return folder


@pytest.fixture
def project(root: Path) -> Iterator[Project]:
    with Project(root, journals=root.with_name("journals")) as opened:
        yield opened


def test_a_document_is_opened_once(project: Project, root: Path) -> None:
    document = project.open("waver.xml")
    assert project.open(root / "waver.xml") is document
    (root / "same.xml").symlink_to(root / "waver.xml")
    assert project.open("same.xml") is project.open("./waver.xml") is document
    assert project.documents == [document]
    document.close()
    assert project.documents == []
    assert project.open("waver.xml") is not document


def test_threads_that_open_a_file_get_one_document(project: Project, root: Path) -> None:
    (root / "large.xml").write_text(write_document(large_document(500)))  # others come while it is read
    together = threading.Barrier(4)

    def open_it(_: int) -> object:
        together.wait(EVENT_LIMIT)
        return project.open("large.xml")

    with ThreadPoolExecutor(4) as threads:
        found = [*threads.map(open_it, range(4))]
    assert project.documents == [found[0]]
    assert len({*map(id, found)}) == 1


def test_a_file_that_is_being_saved_is_opened_as_the_same_document(project: Project) -> None:
    with ThreadPoolExecutor(2) as threads:
        for number in range(20):
            document, name = project.new(), f"new{number}.xml"
            saving = threads.submit(document.save, name)
            found = None
            while found is None:
                with contextlib.suppress(MissingError):  # the file is not there yet
                    found = project.open(name)
            assert saving.result(EVENT_LIMIT) == document.path
            assert found is document


def test_no_more_documents_than_wanted_are_open(root: Path) -> None:
    with Project(root, journals=root.with_name("journals"), most=1) as project:
        document = project.open("waver.xml")
        with pytest.raises(TooManyError, match="close one first"):
            project.new()
        assert project.open("waver.xml") is document
        document.close()
        project.new()


def test_what_is_outside_the_folder_is_neither_opened_nor_written(project: Project, root: Path) -> None:
    outside = root.with_name("outside.xml")
    outside.write_text(write_document(tree()))
    (root / "link.xml").symlink_to(outside)
    for path in ("../outside.xml", outside, "link.xml"):
        with pytest.raises(ForbiddenPathError, match="is outside"):
            project.open(path)
    document = project.open("waver.xml")
    for save in (document.save, document.save_copy):
        with pytest.raises(ForbiddenPathError, match="is outside"):
            save("../elsewhere.xml")
    assert not root.with_name("elsewhere.xml").exists()
    with pytest.raises(MissingError, match=r"there is no file no\.xml"):
        project.open("no.xml")


def test_a_file_that_became_a_link_is_not_followed_out_of_the_folder(project: Project, root: Path) -> None:
    document = project.open("waver.xml")
    document.apply(AddState(automaton=1, x=0, y=0))
    outside = (root / "waver.xml").rename(root.with_name("outside.xml"))
    (root / "waver.xml").symlink_to(outside)
    before = outside.read_text()
    for overwrite in (False, True):
        with pytest.raises(ForbiddenPathError):
            document.save(overwrite=overwrite)
    assert outside.read_text() == before


def test_a_document_is_not_saved_over_another_one(project: Project) -> None:
    document, other = project.new(), project.open("waver.xml")
    for overwrite in (False, True):
        with pytest.raises(WouldOverwriteError, match=r"waver\.xml is open, too"):
            document.save("waver.xml", overwrite=overwrite)
    other.close()
    with pytest.raises(WouldOverwriteError, match=r"waver\.xml already exists"):
        document.save("waver.xml")
    document.save("waver.xml", overwrite=True)
    assert project.find(project.root.directory / "waver.xml") is document


def test_new_documents_have_names_of_their_own(project: Project, root: Path) -> None:
    titles = [project.new().version.title for _ in range(3)]
    assert titles == ["untitled", "untitled 2", "untitled 3"]
    text = project.open("waver.xml").text()
    (root / "follow me.xml").write_text(text)
    assert project.open("follow me.xml").version.title == "follow me"
    assert project.open_text("follow_me.xml", text).version.title == "follow_me 2"  # components of one name
    assert project.open_text("waver.xml", text).version.title == "waver 2"
    kept = project.open_text("waver.mcap", text, kept=True)
    assert (kept.version.title, kept.version.dirty) == ("waver.mcap", False)


def test_a_new_document_in_spanish_can_be_saved_and_generated(project: Project) -> None:
    document = project.new(language="es-ES")
    assert document.version.title == "sin título"
    assert project.new(language="es").version.title == "sin título 2"
    document.apply([AddState(automaton=1, x=x, y=0, language="es") for x in (0, 200)])
    document.apply(AddTransition(automaton=1, origin=1, destination=2, language="es"))
    document.save(f"{document.version.title}.xml")
    component = document.generate()
    code = component.read_text("utf-8")
    assert "transición 1" in code
    compile(code, str(component), "exec")


@OLD_DOCUMENTS
def test_scxml_is_opened_as_a_new_document_with_remarks(project: Project, root: Path) -> None:
    (root / "toggle.scxml").write_text(SCXML)
    document = project.open("toggle.scxml")
    assert (document.path, document.version.title) == (None, "toggle")
    assert document.remarks
    assert project.open("waver.xml").remarks is None
    assert project.open_text("toggle.scxml", SCXML).remarks == document.remarks


def test_unsaved_changes_of_a_project_that_ended_can_be_recovered(root: Path) -> None:
    journals = root.with_name("journals")
    with Project(root, journals=journals) as project:
        project.open("waver.xml").apply(AddState(automaton=1, x=0, y=0, name="kept"))
        project.new().apply(AddState(automaton=1, x=0, y=0, name="dropped"))
        project.new()
    elsewhere = root.with_name("elsewhere")
    elsewhere.mkdir()
    with Project(elsewhere, journals=journals) as project:
        assert [each.name for each in project.recoverable()] == ["untitled"]
    with Project(root, journals=journals) as project:
        names = {each.name: each.file.name for each in project.recoverable()}
        assert {*names} == {"waver", "untitled"}
        document = project.recover(names["waver"])
        assert document.version.is_unsaved
        assert "kept" in document.text()
        project.discard(names["untitled"])
        assert project.recoverable() == []
        for again in (project.recover, project.discard):
            with pytest.raises(MissingError, match="cannot be recovered any more"):
                again(names["waver"])
        document.undo()


KILLED_WITHOUT_CHANGES = """
import os, signal, sys
from pathlib import Path
from visualhfsm import AddState, Project, SetText
from visualhfsm._document.places import Place

root, journals = sys.argv[1:]
project = Project(root, journals=Path(journals))
reloaded, typed, crashed, lost = (project.open(f"{name}.xml") for name in ("reloaded", "typed", "crashed", "lost"))
for document in (reloaded, typed, crashed, lost):
    document.apply(AddState(automaton=1, x=0, y=0, name="kept"))
reloaded.save()
reloaded.path.write_text(typed.path.read_text())  # another program
reloaded.refresh()
place = Place(kind="automaton", automaton=1, part="functions")
typed.save()
for text in ("x = 1", ""):
    typed.apply(SetText(place=place, text=text))
crashed.path.write_text(crashed.text())  # it ends before the journal has that
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_what_a_file_holds_is_not_offered_after_a_kill(root: Path) -> None:
    journals = root.with_name("journals")
    for name in ("reloaded", "typed", "crashed", "lost"):
        (root / f"{name}.xml").write_text(write_document(tree()))
    killed = subprocess.run(
        [sys.executable, "-c", KILLED_WITHOUT_CHANGES, str(root), str(journals)],
        env=child_environment([Path.cwd()]),
        check=False,
    )
    assert killed.returncode == -signal.SIGKILL
    with Project(root, journals=journals) as project:
        (found,) = project.recoverable()
        assert found.name == "lost"
        assert [*journals.iterdir()] == [found.file]
        before = found.file.read_bytes(), found.changed_at
        (again,) = project.recoverable()
        assert (again.file.read_bytes(), again.changed_at) == before, "who looks changes nothing"
        assert "kept" in project.recover(found.file.name).text()


def test_a_journal_with_an_entry_that_nobody_reads_is_offered_as_it_is(root: Path) -> None:
    journals = root.with_name("journals")
    with Project(root, journals=journals) as project:
        project.open("waver.xml").apply(AddState(automaton=1, x=0, y=0, name="kept"))
    (file,) = journals.iterdir()
    with file.open("ab") as stream:
        stream.write(b'{"entry": "of a later release"}\n')
    content = file.read_bytes()
    with Project(root, journals=journals) as project:
        (found,) = project.recoverable()
        assert file.read_bytes() == content
        assert "kept" in project.recover(found.file.name).text()


def test_directories_come_first_and_hidden_files_not_at_all(project: Project, root: Path) -> None:
    for name in (".hidden.xml", "notes.txt", "run.mcap"):
        (root / name).write_text("")
    (root / "z").mkdir()
    found = [(each.path.name, each.kind) for each in project.entries()]
    assert found == [("z", "directory"), ("run.mcap", "recording"), ("waver.xml", "document")]
    with pytest.raises(ForbiddenPathError):
        project.entries("..")


def test_files_below_follow_but_not_those_of_packages_hidden_ones_and_links(
    project: Project, root: Path
) -> None:
    for name in ("behaviors/in/deep", "node_modules/x", "env/lib", ".git", "z"):
        (root / name).mkdir(parents=True)
        (root / name / "part.xml").write_text("")
    (root / "behaviors" / "first.xml").write_text("")
    (root / "env" / "pyvenv.cfg").write_text("")
    (root / "again").symlink_to(root)

    def found(depth: int) -> list[str]:
        return [
            str(each.path.relative_to(root))
            for each in project.entries(depth=depth)
            if each.kind != "directory"
        ]

    assert found(0) == ["waver.xml"]
    assert found(1) == ["waver.xml", "behaviors/first.xml", "z/part.xml"]
    assert found(2) == found(1)
    assert found(3) == [*found(2), "behaviors/in/deep/part.xml"]


def test_of_many_folders_below_only_the_first_are_looked_at(project: Project, root: Path) -> None:
    for number in range(220):
        (root / f"{number:03}").mkdir()
        (root / f"{number:03}" / "one.xml").write_text("")
    assert sum(each.kind == "document" for each in project.entries(depth=3)) == 1 + 200


def test_models_of_robots_are_told_from_documents(project: Project, root: Path) -> None:
    (root / "robots").mkdir()
    for name in ("arm.urdf", "arm.urdf.xacro", "robots/arm.toml", "other.toml"):
        (root / name).write_text("")
    (root / "scene.xml").write_text('<?xml version="1.0"?>\n<!-- a robot -->\n<mujoco model="arm"/>\n')
    kinds = {each.path.name: each.kind for folder in ("", "robots") for each in project.entries(folder)}
    assert kinds == {
        "robots": "directory",
        "arm.urdf": "model",
        "arm.urdf.xacro": "model",
        "scene.xml": "model",
        "waver.xml": "document",
        "arm.toml": "model",
    }


@pytest.mark.slow
def test_a_document_without_a_file_finds_the_interfaces_of_the_folder(project: Project, root: Path) -> None:
    (root / "interfaces").mkdir()
    (root / "interfaces" / "lamp.idl").write_text("module home { interface Lamp { void on(); }; };")
    assert codegen("interfaces/lamp.idl", cwd=root).returncode == 0
    document = project.new()
    lamp = {"name": "Lamp", "proxy": "Lamp", "type": "Lamp"}
    document.apply([AddState(automaton=1, x=0, y=0, name="on"), AddEntry(list="interfaces", fields=lamp)])
    assert [each.message for each in document.problems() if each.severity == "error"] == []
    document.simulate(stubs={"Lamp": {"on": None}}).close()


@pytest.mark.slow
def test_a_project_loads_neither_the_page_nor_asyncio() -> None:
    code = (
        "import sys; from visualhfsm import Project, AddState; Project('.').close(); "
        "print({'asyncio', 'starlette', 'typer', 'uvicorn', 'zenoh'} & sys.modules.keys())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=RUN_LIMIT, check=True
    )
    assert done.stdout == "set()\n"


def test_a_folder_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for wrong, why in ((tmp_path / "absent", "there is no folder"), (tmp_path / "file", "is not a folder")):
        with pytest.raises(MissingError, match=why):
            Project(wrong)


def test_a_closed_project_opens_nothing(root: Path) -> None:
    project = Project(root, journals=root.with_name("journals"))
    project.close()
    project.close()
    for make in (project.new, lambda: project.open("waver.xml")):
        with pytest.raises(EditError, match="the project is closed"):
            make()
