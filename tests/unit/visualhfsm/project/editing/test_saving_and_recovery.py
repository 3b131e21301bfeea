"""Open documents: undo and redo with names, saving, files that change, and journals that survive a crash."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from codegen.hfsm import write_document
from tests.support.editing import tree
from tests.support.plugins import OLD_DOCUMENTS
from visualhfsm import Choice, OpenDocument, Project, Step
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import (
    ChangedOutsideError,
    EditError,
    ForbiddenPathError,
    OldFormatError,
    UnsavedError,
    WouldOverwriteError,
)
from visualhfsm._document.commands import Command
from visualhfsm._document.commands.component import AddEntry, ChangeEntry
from visualhfsm._document.commands.items import MoveItems
from visualhfsm._document.commands.states import AddState, RenameState
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.places import Place
from visualhfsm._document.serialization import MAX_SIZE, written
from visualhfsm.project._editing.document_state import begin_from_file, recover
from visualhfsm.project._editing.files import write_file
from visualhfsm.project._editing.journal import find_abandoned

SPANISH = """<VisualHFSM><SubAutomata><idSub>1</idSub><Estado estado_inicial="true"><id>1</id><nombre>uno</nombre>
<origenX>1</origenX><origenY>2</origenY><codigo>x = 1</codigo></Estado><tiempoIteracion>50</tiempoIteracion>
</SubAutomata></VisualHFSM>"""


class Time:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def time(monkeypatch: pytest.MonkeyPatch) -> Time:
    clock = Time()
    monkeypatch.setattr("visualhfsm.project._editing.undo_stack.monotonic", clock)
    return clock


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "waver.xml"
    file.write_text(write_document(tree()))
    return file


@pytest.fixture
def session(path: Path, tmp_path: Path, time: Time):
    opened = project(tmp_path).open(path)
    yield opened
    opened.close(discard=True)


def rename(name: str, state: int = 1) -> RenameState:
    return RenameState(automaton=1, state=state, name=name)


def code(text: str, state: int = 1) -> SetText:
    return SetText(place=Place(kind="state", automaton=1, id=state, part="code"), text=text)


def project(folder: Path) -> Project:
    return Project(folder, journals=folder / "journals")


def recover_only(folder: Path) -> OpenDocument:
    """Recover the only document of which a journal is left."""
    opened = project(folder)
    (found,) = opened.recoverable()
    return opened.recover(found.file.name)


def step_names(steps: Sequence[Step]) -> list[str]:
    return [step.name for step in steps]


def test_steps_have_names_and_are_undone_and_done_again(session: OpenDocument) -> None:
    session.apply(rename("a"))
    session.apply(AddState(automaton=1, x=0, y=0))
    assert step_names(session.version.undo) == ["Add a state", "Rename “wait”"]
    change = session.undo()
    assert (change.name, change.revision, step_names(session.version.redo)) == (
        "Add a state",
        3,
        ["Add a state"],
    )
    assert session.redo().added[0].states == (3,)
    session.undo()
    session.apply(rename("b", 2))
    assert step_names(session.version.redo) == []
    with pytest.raises(EditError, match="nothing to redo"):
        session.redo()


def test_a_step_is_gone_to_by_the_revision_that_it_leads_to(session: OpenDocument) -> None:
    for x in range(3):
        session.apply(AddState(automaton=1, x=x, y=0))
    assert [step.revision for step in session.version.undo] == [2, 1, 0]
    documents = {step.revision: step.document for step in session.version.undo}
    session.go_to(1)
    assert session.version.document is documents[1]
    assert [step.revision for step in session.version.redo] == [2, 3]
    assert session.go_to(1).before is documents[1]
    session.go_to(3)
    assert [step.revision for step in session.version.undo] == [2, 1, 0]
    session.go_to(0)
    assert (session.version.document is documents[0], session.version.dirty, session.version.revision) == (
        True,
        False,
        10,
    )


def test_a_step_that_no_longer_is_there_is_not_gone_to(session: OpenDocument) -> None:
    for x in range(3):
        session.apply(AddState(automaton=1, x=x, y=0))
    session.undo()
    session.apply(rename("d"))
    after = session.version.document
    with pytest.raises(EditError, match="changed since"):
        session.go_to(3)
    assert session.version.document is after


@pytest.mark.parametrize(
    ("command", "place"),
    [
        (code("new"), Place(kind="state", automaton=1, id=1, part="code")),
        (MoveItems(automaton=1, states=(2,), dx=1, dy=0), Place(kind="state", automaton=1, id=2)),
        (AddState(automaton=2, x=0, y=0), Place(kind="automaton", automaton=2)),
        (
            ChangeEntry(list="properties", index=0, fields={"expression": "x"}),
            Place(kind="document", part="properties", index=0, name="expression"),
        ),
        (AddEntry(list="events"), Place(kind="document")),
    ],
)
def test_a_step_that_is_undone_says_where(session: OpenDocument, command: Command, place: Place) -> None:
    session.apply(AddEntry(list="properties", fields={"name": "p", "expression": "y"}))
    session.apply(command)
    assert session.undo().place == place


def test_typing_is_one_step_until_one_pauses(session: OpenDocument, time: Time) -> None:
    for text in ("x", "x =", "x = 1"):
        session.apply(code(text))
        time.now += 1.9
    assert len(session.version.undo) == 1
    time.now += 2.1
    session.apply(code("x = 2"))
    assert len(session.version.undo) == 2
    time.now += 2.1
    session.apply(code("x = 3"))
    assert len(session.version.undo) == 3
    session.undo()
    session.undo()
    session.apply(code("x = 4"))
    assert len(session.version.undo) == 2
    session.undo()
    session.undo()
    assert not session.version.dirty


def test_what_was_typed_over_an_older_text_is_merged(session: OpenDocument) -> None:
    session.apply(code("x"))
    session.apply(code("x theirs"), "x")
    change = session.apply(code("mine x"), "x")
    assert (session.version.document.automata[0].states[0].code.text, change.conflict) == (
        "mine x theirs",
        False,
    )
    assert session.apply(code("mine y theirs"), "mine x theirs").conflict is False
    assert session.apply(code("mine z theirs"), "mine x theirs").conflict is True
    assert session.version.document.automata[0].states[0].code.text == "mine zy theirs"
    session.undo()
    assert not session.version.dirty


def test_a_field_of_an_entry_is_merged(session: OpenDocument) -> None:
    session.apply(AddEntry(list="properties", fields={"name": "p", "expression": "x"}))
    for text in ("x theirs", "mine x"):
        session.apply(ChangeEntry(list="properties", index=0, fields={"expression": text}), "x")
    assert session.version.document.properties[0].expression.text == "mine x theirs"


def test_what_is_no_text_is_not_merged(session: OpenDocument) -> None:
    with pytest.raises(EditError, match="no piece of text"):
        session.apply(AddState(automaton=1, x=0, y=0), "x")


def test_typing_after_saving_is_another_step(session: OpenDocument) -> None:
    session.apply(code("x"))
    session.save()
    session.apply(code("x = 1"))
    assert len(session.version.undo) == 2


def test_moves_of_the_same_things_are_one_step(session: OpenDocument) -> None:
    for _ in range(5):
        session.apply(MoveItems(automaton=1, states=(1,), dx=1, dy=0))
    assert len(session.version.undo) == 1
    session.apply(MoveItems(automaton=1, states=(1, 2), dx=1, dy=0))
    assert len(session.version.undo) == 2


def test_a_command_that_changes_nothing_is_no_step(session: OpenDocument) -> None:
    change = session.apply(rename("wait"))
    assert (change.revision, step_names(session.version.undo), session.version.dirty) == (0, [], False)


def test_a_command_that_fails_leaves_everything(session: OpenDocument) -> None:
    before = session.version.document
    with pytest.raises(EditError):
        session.apply(rename("x", 9))
    assert session.version.document is before
    assert step_names(session.version.undo) == []


@pytest.mark.slow
def test_a_document_does_not_grow_beyond_what_can_be_opened(session: OpenDocument) -> None:
    most = 1_000_000  # characters that one text may have; a file has five for each `&`
    for _ in range(MAX_SIZE // (5 * most)):
        added = session.apply(AddState(automaton=1, x=0, y=0)).added
        session.apply(code("&" * most, added[0].states[0]))
    before = session.version.document
    with pytest.raises(EditError, match="it is larger than"):
        session.apply(code("&" * most))
    assert session.version.document is before
    session.apply(code("x" * most))


def test_saving_is_byte_for_byte_what_was_opened(session: OpenDocument, path: Path) -> None:
    original = path.read_bytes()
    session.apply(rename("a"))
    assert session.version.dirty
    session.undo()
    assert not session.version.dirty
    session.save()
    assert path.read_bytes() == original


def test_saving_keeps_permissions_and_links(session: OpenDocument, path: Path, tmp_path: Path) -> None:
    path.chmod(0o640)
    link = tmp_path / "link.xml"
    link.symlink_to(path)
    session.apply(rename("a"))
    session.save(link, overwrite=True)
    write_file(link, path.read_bytes())
    assert link.is_symlink()
    assert path.stat().st_mode & 0o777 == 0o640
    assert "<name>a</name>" in path.read_text()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["journals", "link.xml", "waver.xml"]


def test_what_was_not_changed_is_written_back_as_it_was_laid_out(path: Path, tmp_path: Path) -> None:
    by_hand = path.read_bytes().replace(b"\n", b"\r\n").replace(b"  <", b"\t<")
    path.write_bytes(by_hand)
    session = project(tmp_path).open(path)
    session.apply(rename("a"))
    session.save()
    assert path.read_bytes() != by_hand
    session.undo()
    with pytest.raises(UnsavedError, match="not saved"):
        session.close()
    session.save()
    assert path.read_bytes() == by_hand
    session.close()


def test_a_directory_that_cannot_be_synced_does_not_hide_that_the_file_is_there(
    session: OpenDocument, path: Path, monkeypatch
) -> None:
    def fail(_directory: Path) -> None:
        raise OSError(22, "Invalid argument")

    monkeypatch.setattr("visualhfsm.project._editing.files.flush", fail)
    session.apply(rename("a"))
    session.save()
    assert not session.version.dirty
    assert "<name>a</name>" in path.read_text()
    assert session.refresh() == "same"


def test_saving_that_fails_leaves_the_old_file(session: OpenDocument, path: Path, monkeypatch) -> None:
    original = path.read_bytes()
    session.apply(rename("a"))

    def fail(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(EditError, match="No space left on device; nothing was written"):
        session.save()
    assert path.read_bytes() == original
    assert session.version.dirty
    assert [each.name for each in path.parent.glob(".*")] == []


def test_saving_as_asks_before_it_overwrites(session: OpenDocument, tmp_path: Path) -> None:
    other = tmp_path / "other.xml"
    other.write_text("mine")
    with pytest.raises(WouldOverwriteError, match="already exists"):
        session.save(other)
    assert other.read_text() == "mine"
    with pytest.raises(ForbiddenPathError, match=r"end in \.xml"):
        session.save(tmp_path / "component.py")
    session.save(other, overwrite=True)
    assert (session.path, session.version.title, session.version.dirty) == (other, "other", False)


@OLD_DOCUMENTS
def test_an_old_dialect_opens_and_is_saved_elsewhere(tmp_path: Path) -> None:
    old = tmp_path / "old.xml"
    old.write_text(SPANISH)
    session = project(tmp_path).open(old)
    assert session.version.document.format == "Spanish (2013)"
    session.apply(rename("dos"))
    with pytest.raises(OldFormatError, match="another file"):
        session.save()
    assert old.read_text() == SPANISH
    session.save(tmp_path / "new.xml")
    session.apply(rename("tres"))
    session.save()
    session.close()
    assert "<name>tres</name>" in (tmp_path / "new.xml").read_text()


@OLD_DOCUMENTS
@pytest.mark.parametrize("choice", [None, Choice.THEIRS, Choice.MERGE])
def test_a_recovered_document_of_an_old_format_is_not_replaced_unasked(
    tmp_path: Path, choice: Choice | None
) -> None:
    old = tmp_path / "old.xml"
    old.write_text(SPANISH)
    session = project(tmp_path).open(old)
    if choice is not None:
        old.write_text(SPANISH.replace("uno", "one"))
        session.resolve(choice)
    written = old.read_text()
    session.apply(rename("dos"))
    session.abandon()
    recovered = recover_only(tmp_path)
    with pytest.raises(OldFormatError, match="another file"):
        recovered.save()
    assert old.read_text() == written
    recovered.save(overwrite=True)
    recovered.apply(rename("tres"))
    recovered.save()
    recovered.close()


def test_a_new_document_needs_a_file(tmp_path: Path) -> None:
    session = project(tmp_path).open_text("untitled", written(tree()))
    assert session.version.dirty
    with pytest.raises(EditError, match="no file yet"):
        session.save()
    session.save(tmp_path / "a.xml")
    assert not session.version.dirty
    session.close()


@pytest.mark.parametrize(
    ("content", "why"),
    [("<a/>", "not the root"), ("<VisualHFSM>", "malformed"), (None, "it does not exist")],
)
def test_what_is_no_document_does_not_open(tmp_path: Path, content: str | None, why: str) -> None:
    file = tmp_path / "bad.xml"
    if content is not None:
        file.write_text(content)
    with pytest.raises(EditError, match=why):
        begin_from_file(file, tmp_path / "journals")
    with pytest.raises(EditError, match="it is not a file"):
        begin_from_file(tmp_path, tmp_path / "journals")


def test_a_file_that_another_program_changed_is_not_overwritten(session: OpenDocument, path: Path) -> None:
    session.apply(rename("mine"))
    assert session.refresh() == "same"
    os.utime(path, (1, 1))
    assert session.refresh() == "same", "the content is the same"
    path.write_text(path.read_text().replace(">work<", ">theirs<"))
    assert session.refresh() == "changed"
    with pytest.raises(ChangedOutsideError, match="another program has changed it"):
        session.save()
    assert "theirs" in path.read_text()


def test_one_takes_theirs_or_keeps_mine(session: OpenDocument, path: Path) -> None:
    session.apply(rename("mine"))
    path.write_text(path.read_text().replace(">wait<", ">theirs<"))
    session.resolve(Choice.THEIRS)
    assert session.version.document.automata[0].states[0].name == "theirs"
    assert not session.version.dirty
    session.undo()
    path.write_text(path.read_text().replace(">theirs<", ">again<"))
    session.resolve(Choice.MINE)
    session.save()
    assert "<name>mine</name>" in path.read_text()


def test_a_file_that_was_removed_is_written_again(session: OpenDocument, path: Path) -> None:
    path.unlink()
    assert session.refresh() == "deleted"
    with pytest.raises(ChangedOutsideError, match="deleted"):
        session.save()
    session.resolve(Choice.MINE)
    assert session.version.dirty
    session.save()
    assert path.exists()


def test_closing_asks_for_changes_and_leaves_no_journal(path: Path, tmp_path: Path) -> None:
    session = project(tmp_path).open(path)
    session.apply(rename("a"))
    assert len(list((tmp_path / "journals").iterdir())) == 1
    with pytest.raises(UnsavedError, match="not saved"):
        session.close()
    session.close(discard=True)
    assert list((tmp_path / "journals").iterdir()) == []


CRASH = """
import sys, os, signal
from pathlib import Path
from visualhfsm import AddState, Project, RenameState
session = Project(Path(sys.argv[1]).parent, journals=Path(sys.argv[2])).open(sys.argv[1])
session.apply(RenameState(automaton=1, state=1, name="a"))
session.save()
session.apply(AddState(automaton=1, x=0.1, y=2.0))
session.apply(RenameState(automaton=1, state=3, name="b"))
session.apply(RenameState(automaton=1, state=3, name="bc"))
session.apply(RenameState(automaton=1, state=2, name="d"))
session.undo()
print("ready", flush=True)
sys.stdin.read()
"""


KILLED_AFTER_SAVES = """
import os, signal, sys
from pathlib import Path
from visualhfsm import Project, RenameState

def opened(name):
    session = project.open(f"{name}.xml")
    session.apply(RenameState(automaton=1, state=1, name="a"))
    session.apply(RenameState(automaton=1, state=1, name="b"))
    session.save()
    return session

project = Project(sys.argv[1], journals=Path(sys.argv[2]))
kept = [opened(name) for name in ("saved", "again", "changed", "before", "branched", "outside", "deleted")]
_, again, changed, before, branched, _, _ = kept
for session in (before, branched, again):
    session.undo()
again.redo()
for session in (changed, branched):
    session.apply(RenameState(automaton=1, state=1, name="c"))
unchanged = project.open("unchanged.xml")
unchanged.apply(RenameState(automaton=1, state=1, name="a"))
unchanged.undo()
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_after_a_kill_only_what_differs_from_its_file_is_to_be_recovered(path: Path, tmp_path: Path) -> None:
    folder, journals = tmp_path / "root", tmp_path / "journals"
    folder.mkdir()
    for name in ("saved", "again", "changed", "before", "branched", "outside", "deleted", "unchanged"):
        shutil.copy(path, folder / f"{name}.xml")
    command = [sys.executable, "-c", KILLED_AFTER_SAVES, str(folder), str(journals)]
    killed = subprocess.run(command, env=child_environment([Path.cwd()]), check=False)
    assert killed.returncode == -signal.SIGKILL
    (folder / "outside.xml").write_bytes(path.read_bytes())
    (folder / "deleted.xml").unlink()
    found = {each.name: each.file for each in find_abandoned(journals)}
    assert sorted(found) == ["before", "branched", "changed", "deleted", "outside"]
    assert sorted(journals.iterdir()) == sorted(found.values())
    kept = Project(folder, journals=journals)
    for name, state in {"before": "wait", "branched": "c", "changed": "c"}.items():
        recovered = kept.recover(found[name].name)
        assert (recovered.version.dirty, recovered.version.document.automata[0].states[0].name) == (
            True,
            state,
        )
        recovered.close(discard=True)


@pytest.mark.slow
def test_a_killed_process_loses_nothing(path: Path, tmp_path: Path) -> None:
    journals = tmp_path / "journals"
    process = subprocess.Popen(
        [sys.executable, "-c", CRASH, str(path), str(journals)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=child_environment([Path.cwd()]),
        text=True,
    )
    with process:
        assert process.stdout is not None
        try:
            assert process.stdout.readline() == "ready\n"
            assert find_abandoned(journals) == [], "it is alive"
            (file,) = journals.iterdir()
            with pytest.raises(EditError, match="open in another process"):
                recover(file)
        finally:
            process.send_signal(signal.SIGKILL)
    (found,) = find_abandoned(journals)
    assert (found.path, found.name) == (path, "waver")
    recovered = recover_only(tmp_path)
    assert [state.name for state in recovered.version.document.automata[0].states] == ["a", "work", "bc"]
    assert step_names(recovered.version.undo) == ["Rename “state 3”", "Add a state", "Rename “wait”"]
    assert step_names(recovered.version.redo) == ["Rename “work”"]
    assert recovered.version.dirty
    assert recovered.refresh() == "same"
    recovered.undo()
    recovered.undo()
    assert not recovered.version.dirty, "this is what was saved"
    recovered.redo()
    recovered.save()
    recovered.close()
    assert list(journals.iterdir()) == []


def test_a_new_document_that_was_saved_is_found_under_the_name_of_its_file(tmp_path: Path) -> None:
    journals = tmp_path / "journals"
    session = project(tmp_path).open_text("untitled", written(tree()))
    session.apply(rename("a"))
    session.save(tmp_path / "walk.xml")
    session.apply(rename("b"))
    session.abandon()
    (found,) = find_abandoned(journals)
    assert (found.path, found.name) == (tmp_path / "walk.xml", "walk")


def test_a_journal_that_was_cut_off_gives_what_it_has(path: Path, tmp_path: Path) -> None:
    session = project(tmp_path).open(path)
    for name in ("a", "b"):
        session.apply(rename(name))
    session.abandon()
    (file,) = (tmp_path / "journals").iterdir()
    file.write_bytes(file.read_bytes()[:-20])
    recovered = recover_only(tmp_path)
    assert recovered.version.document.automata[0].states[0].name == "a"
    recovered.apply(rename("c"))
    recovered.abandon()
    again = recover_only(tmp_path)
    assert again.version.document.automata[0].states[0].name == "c"
    again.close(discard=True)


def test_a_journal_that_means_nothing_from_some_entry_on_is_continued_there(
    path: Path, tmp_path: Path
) -> None:
    session = project(tmp_path).open(path)
    session.apply(rename("a"))
    session.abandon()
    (file,) = (tmp_path / "journals").iterdir()
    for lost in (
        b'{"entry":"do","command":{"command":"renameState","automaton":9,"state":1,"name":"x"}}\n',
        b"?\n",
    ):
        file.write_bytes(file.read_bytes() + lost + b'{"entry":"undo"}\n')
        recovered = recover_only(tmp_path)
        assert step_names(recovered.version.undo) == ["Rename “wait”"]
        recovered.abandon()
    recovered = recover_only(tmp_path)
    recovered.apply(rename("b", 2))
    recovered.abandon()
    again = recover_only(tmp_path)
    assert step_names(again.version.undo) == ["Rename “work”", "Rename “wait”"]
    again.close(discard=True)


def test_a_journal_recovers_from_a_full_disk(path: Path, tmp_path: Path, monkeypatch) -> None:
    real = os.write
    full = False

    def write(descriptor: int, content: bytes) -> int:
        if full:
            real(descriptor, content[:7])
            raise OSError(28, "No space left on device")
        return real(descriptor, content)

    monkeypatch.setattr("visualhfsm.project._editing.journal.os.write", write)
    session = project(tmp_path).open(path)
    full = True
    session.apply(rename("a"))
    full = False
    session.apply(rename("b", 2))
    full = True
    session.undo()
    session.apply(AddState(automaton=1, x=0, y=0))
    full = False
    session.undo()
    session.undo()
    session.redo()
    session.apply(rename("c", 2))
    expected = session.version.document
    session.abandon()
    recovered = recover_only(tmp_path)
    assert recovered.version.document == expected
    recovered.close(discard=True)


@pytest.mark.parametrize("saves", ["nowhere", "at the beginning", "between", "at the end"])
def test_a_journal_that_has_grown_large_begins_anew_and_loses_nothing(
    path: Path, tmp_path: Path, saves: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    journals = tmp_path / "journals"
    monkeypatch.setattr("visualhfsm.project._editing.journal.LARGEST_JOURNAL", 3000)
    session = project(tmp_path).open(path)
    largest = 0
    for number in range(200):
        session.apply(
            SetText(place=Place(kind="automaton", automaton=1, part="functions"), text=f"n = {number}\n" * 40)
        )
        session.apply(rename(f"s{number}"))
        if (saves == "at the beginning" and number == 0) or (saves == "between" and number % 7 == 3):
            session.save()
        if number % 5 == 0:
            session.undo()
        if number % 9 == 0:
            session.undo()
            session.redo()
        (file,) = journals.iterdir()
        largest = max(largest, file.stat().st_size)
    if saves == "at the end":
        session.save()
    expected, dirty, saved = session.version.document, session.version.dirty, path.read_bytes()
    session.abandon()
    assert largest < 40_000, "without beginning anew it has some 130,000 bytes"
    if not dirty:
        assert list(journals.iterdir()) == []
        return
    (found,) = find_abandoned(journals)
    assert (found.path, found.name) == (path, path.stem)
    recovered = recover_only(tmp_path)
    assert recovered.version.document == expected
    assert recovered.version.dirty
    assert recovered.refresh() == "same"
    while recovered.version.undo:
        recovered.undo()
    recovered.apply(rename("end"))
    last = recovered.version.document
    recovered.abandon()
    again = recover_only(tmp_path)
    assert again.version.document == last
    assert path.read_bytes() == saved
    again.save()
    again.close()


def test_a_journal_begins_anew_once_there_is_room_for_it(path: Path, tmp_path: Path, monkeypatch) -> None:
    real, full = os.open, False

    def open_(name: Any, flags: int, *rest: int, **options: Any) -> int:
        if full and flags & os.O_CREAT:
            raise OSError(28, "No space left on device")
        return real(name, flags, *rest, **options)

    monkeypatch.setattr("visualhfsm.project._editing.journal.LARGEST_JOURNAL", 1)
    session = project(tmp_path).open_text("untitled", written(tree()))
    session.apply(rename("a"))
    monkeypatch.setattr("visualhfsm.project._editing.journal.os.open", open_)
    full = True
    session.apply(rename("b", 2))
    full = False
    session.apply(rename("c"))
    session.undo()
    session.abandon()
    recovered = recover_only(tmp_path)
    assert [each.name for each in recovered.version.document.automata[0].states[:2]] == ["a", "b"]
    recovered.close(discard=True)


def test_a_crash_right_after_saving_leaves_nothing_to_save(session: OpenDocument, path: Path) -> None:
    session.apply(rename("a"))
    path.write_text(session.text())  # and the process dies before it is in the journal
    session.abandon()
    (found,) = find_abandoned(path.parent / "journals")
    recovered = recover(found.file)
    assert not recovered.dirty
    assert not recovered.file.is_changed_outside()
    recovered.steps.undo()
    recovered.file.require_ours()
    recovered.journal.close()


def test_the_only_copy_of_a_file_that_was_removed_is_recovered(session: OpenDocument, path: Path) -> None:
    path.unlink()
    session.resolve(Choice.MINE)
    with pytest.raises(UnsavedError, match="not saved"):
        session.close()
    session.abandon()
    recovered = recover_only(path.parent)
    assert recovered.version.document == tree()
    recovered.close(discard=True)


def test_a_file_that_is_no_journal_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "x.journal"
    file.write_bytes(b"{}\nand more")
    assert find_abandoned(tmp_path) == []
    with pytest.raises(EditError, match="it contains no document"):
        recover(file)
    assert file.read_bytes() == b"{}\nand more"


def test_an_undone_session_is_not_kept(path: Path, tmp_path: Path) -> None:
    session = project(tmp_path).open(path)
    session.apply(rename("a"))
    session.undo()
    session.abandon()
    assert list((tmp_path / "journals").iterdir()) == []


def test_what_another_process_closes_in_the_same_moment_is_not_recovered(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = Project(tmp_path, journals=tmp_path).open(path)
    session.apply(AddState(automaton=1, x=0, y=0))
    session.abandon()
    (found,) = find_abandoned(tmp_path)

    def lock(_: int, _how: int) -> None:
        found.file.unlink(missing_ok=True)

    monkeypatch.setattr("fcntl.flock", lock)
    with pytest.raises(EditError, match="recovered already"):
        recover(found.file)
