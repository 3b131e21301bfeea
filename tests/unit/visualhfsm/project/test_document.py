"""An open document: changed by any thread, checked once a version, completed, generated and simulated."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from codegen.hfsm import write_document
from tests.support.editing import tree
from tests.support.limits import EVENT_LIMIT
from visualhfsm import (
    AddState,
    ChangedOutsideError,
    EditError,
    Findings,
    OpenDocument,
    Place,
    Project,
    RenameState,
    SetText,
    UnsavedError,
    decode_command,
)
from visualhfsm.project._check_process import CheckProcess

pytestmark = pytest.mark.slow

CODE = Place(kind="state", automaton=1, id=1, part="code")


def heard_by(document: OpenDocument) -> list[Any]:
    heard: list[Any] = []
    document.subscribe(heard.append)
    return heard


def states(document: OpenDocument) -> list[str]:
    return [each.name for each in document.automata[0].states]


# -- changes -----------------------------------------------------------------------------------------------


def test_a_change_says_what_is_new_and_is_undone(document: OpenDocument) -> None:
    before = states(document)
    change = document.apply(AddState(automaton=1, x=0, y=0, name="new"))
    assert [each.states for each in change.added] == [(max(s.id for s in change.after.automata[0].states),)]
    assert states(document) == [*before, "new"]
    document.undo()
    assert states(document) == before
    document.redo()
    assert states(document) == [*before, "new"]
    document.go_to(0)
    assert states(document) == before


def test_of_several_commands_all_are_applied_or_none(document: OpenDocument) -> None:
    heard, before = heard_by(document), document.version
    good, bad = RenameState(automaton=1, state=1, name="one"), RenameState(automaton=1, state=99, name="x")
    with pytest.raises(EditError):
        document.apply([good, bad])
    assert (document.version, heard) == (before, [])
    change = document.apply([good, AddState(automaton=1, x=0, y=0)])
    assert change.before is before.document
    assert [type(each).__name__ for each in heard] == ["Changed"]
    assert heard[0].version is document.version
    assert len(document.version.undo) == 2
    with pytest.raises(EditError, match="there is no command"):
        document.apply([])
    with pytest.raises(EditError, match="only one command at a time has a base"):
        document.apply([good], base="text")


@pytest.mark.parametrize(
    "wrong",
    [AddState(automaton="one", x=0, y=0), AddState(automaton=1, x=object(), y=0)],  # type: ignore[arg-type]
)
def test_a_command_with_a_field_of_another_type_is_refused(document: OpenDocument, wrong: AddState) -> None:
    with pytest.raises(EditError, match="Cannot understand the command"):
        document.apply(wrong)
    assert document.version.revision == 0


def test_threads_change_a_document_one_after_the_other(document: OpenDocument) -> None:
    heard, number = heard_by(document), len(states(document))
    together = threading.Barrier(4)

    def change(index: int) -> None:
        together.wait(EVENT_LIMIT)
        for _ in range(5):
            document.apply(AddState(automaton=1, x=index, y=0))

    with ThreadPoolExecutor(4) as threads:
        list(threads.map(change, range(4)))
    assert len({*states(document)}) == number + 20
    assert [each.version.revision for each in heard] == [*range(1, 21)]


def test_of_changes_made_together_listeners_hear_once(document: OpenDocument) -> None:
    heard = heard_by(document)
    with document.together():
        document.apply(AddState(automaton=1, x=0, y=0))
        document.undo()
        document.apply(AddState(automaton=1, x=0, y=0))
        assert heard == []
    assert [each.version.revision for each in heard] == [3]


def test_a_listener_cannot_change_what_it_hears_of(document: OpenDocument) -> None:
    refused: list[str] = []

    def change(_: object) -> None:
        try:
            document.undo()
        except EditError as error:
            refused.append(str(error))

    unsubscribe = document.subscribe(change)
    heard = heard_by(document)
    document.apply(AddState(automaton=1, x=0, y=0))
    assert [each.version.revision for each in heard] == [1]
    assert len(refused) == 1
    assert "listeners are being notified" in refused[0]
    unsubscribe()
    document.undo()


def test_a_closed_document_takes_no_changes_and_leaves_no_journal(project: Project) -> None:
    document = project.new()
    document.apply(AddState(automaton=1, x=0, y=0))
    with pytest.raises(UnsavedError, match="not saved"):
        document.close()
    document.close(discard=True)
    document.close()
    with pytest.raises(EditError, match="it is closed"):
        document.apply(AddState(automaton=1, x=0, y=0))
    assert not [*project.journals.glob("*.journal")]


# -- files -------------------------------------------------------------------------------------------------


def test_a_document_without_changes_becomes_as_its_file_is(document: OpenDocument, root: Path) -> None:
    heard = heard_by(document)
    assert document.refresh() == "same"
    assert heard == []
    (root / "waver.xml").write_text(
        write_document(RenameState(automaton=1, state=1, name="other").apply(tree()))
    )
    assert document.refresh() == "same"
    assert states(document)[0] == "other"
    assert [type(each).__name__ for each in heard] == ["Changed", "FileChanged"]
    assert heard[1].state == "reloaded"
    document.undo()
    assert states(document)[0] != "other"


def test_changes_of_both_are_merged_and_nothing_is_overwritten(document: OpenDocument, root: Path) -> None:
    heard = heard_by(document)
    document.apply(AddState(automaton=1, x=0, y=0, name="mine"))
    (root / "waver.xml").write_text(
        write_document(RenameState(automaton=1, state=1, name="theirs").apply(tree()))
    )
    assert document.refresh() == document.refresh() == document.version.file == "changed"
    assert [each.state for each in heard if hasattr(each, "state")] == ["changed"]
    with pytest.raises(ChangedOutsideError, match="another program has changed it"):
        document.save()
    assert document.resolve("merge").conflicts == ()
    assert {"mine", "theirs"} <= {*states(document)}
    assert document.version.dirty
    document.save()
    assert (document.version.file, document.version.dirty, document.refresh()) == ("same", False, "same")
    assert "mine" in (root / "waver.xml").read_text()
    document.undo()
    assert "mine" in states(document)
    assert "theirs" not in states(document)


def test_a_file_that_is_no_document_is_reported_until_it_is_one_again(
    document: OpenDocument, root: Path
) -> None:
    heard, file = heard_by(document), root / "waver.xml"
    whole = file.read_text()
    file.write_text(whole[:50])
    assert document.refresh() == "changed"
    assert heard[-1].message
    file.unlink()
    assert document.refresh() == "deleted"
    file.write_text(whole)
    assert document.refresh() == "same"
    assert [each.state for each in heard if hasattr(each, "state")] == ["changed", "deleted", "same"]


def test_of_several_commands_that_are_too_large_together_none_is_applied(document: OpenDocument) -> None:
    before = document.version
    escaped = "#" + "<" * 1_000_000
    large = [
        SetText(place=Place(kind="state", automaton=1, id=state, part=part), text=escaped)
        for state in (1, 2)
        for part in ("entry", "code", "exit")
    ]
    with pytest.raises(EditError, match="larger"):
        document.apply(large)
    assert document.version == before


def test_half_a_character_is_refused(document: OpenDocument) -> None:
    with pytest.raises(EditError):
        document.apply(RenameState(automaton=1, state=1, name="\ud800"))
    with pytest.raises(EditError):
        decode_command("\ud800")


def test_the_end_is_the_last_of_the_events(document: OpenDocument) -> None:
    heard = heard_by(document)
    with document.together():
        document.apply(AddState(automaton=1, x=0, y=0))
        document.close(discard=True)
    assert [type(each).__name__ for each in heard] == ["Changed", "Closed"]


def test_a_check_that_ends_later_is_not_reported_of_a_closed_document(
    document: OpenDocument, monkeypatch: pytest.MonkeyPatch
) -> None:
    def check(*_: object) -> Findings:
        document.close(discard=True)
        return Findings()

    heard = heard_by(document)
    monkeypatch.setattr(CheckProcess, "check", check)
    assert document.check() == Findings()
    assert [type(each).__name__ for each in heard] == ["Closed"]


def test_an_unknown_choice_resolves_nothing(document: OpenDocument) -> None:
    with pytest.raises(EditError, match="mine, theirs, merge"):
        document.resolve("both")
