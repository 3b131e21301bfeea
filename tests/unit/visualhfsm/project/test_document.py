"""An open document: changed by any thread, checked once a version, completed, generated and simulated."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from codegen.hfsm import write_document
from tests.support.editing import tree
from tests.support.limits import EVENT_LIMIT
from visualhfsm import (
    AddEntry,
    AddState,
    AddTransition,
    ChangedOutsideError,
    EditError,
    MissingError,
    MoveItems,
    OpenDocument,
    Place,
    Project,
    RenameState,
    SetPeriod,
    SetStateCode,
    SetTransitionCode,
    UnsavedError,
    VisualHfsmError,
)

CODE = Place(kind="state", automaton=1, id=1, part="code")


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
        document.complete(CODE)
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
    made.apply(SetTransitionCode(automaton=1, transition=1, part="trigger", text="1000"))
    yield made
    made.close(discard=True)


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
    document.save()
    assert (document.version.file, document.version.dirty, document.refresh()) == ("same", False, "same")
    assert "mine" in (root / "waver.xml").read_text()


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


# -- checks ------------------------------------------------------------------------------------------------


def test_problems_have_places_and_are_found_once_a_version(document: OpenDocument) -> None:
    heard = heard_by(document)
    document.apply(SetStateCode(automaton=1, state=1, part="code", text="undefined_name + 1"))
    problems = document.problems()
    assert [each.place for each in problems if "undefined_name" in each.message] == [CODE]
    assert document.problems() == problems
    checked = [each for each in heard if type(each).__name__ == "Checked"]
    assert [each.version for each in checked] == [document.version]
    assert document.check(again=True) == checked[0].findings
    document.undo()
    assert not any("undefined_name" in each.message for each in document.problems())
    assert len([each for each in heard if type(each).__name__ == "Checked"]) == 3


def test_properties_are_proved_or_have_a_counterexample(blinker: OpenDocument) -> None:
    assert blinker.prove() == []
    for name, kind, expression in (("lights", "eventually", "on"), ("dark", "never", "on")):
        fields = {"name": name, "kind": kind, "expression": expression}
        blinker.apply(AddEntry(list="properties", fields=fields))
    lights, dark = blinker.prove()
    assert (lights.name, lights.verdict, lights.counterexample) == ("lights", "holds", None)
    assert (dark.kind, dark.verdict) == ("never", "violated")
    assert dark.counterexample is not None
    assert dark.counterexample.steps[-1].state == 2
    blinker.apply(SetPeriod(automaton=1, period="soon"))
    with pytest.raises(EditError, match="fix the errors first"):
        blinker.prove()


# -- code --------------------------------------------------------------------------------------------------


def test_code_is_completed_and_explained(document: OpenDocument) -> None:
    document.apply(SetStateCode(automaton=1, state=1, part="code", text="self.sl"))
    found = document.complete(CODE, column=len("self.sl"))
    assert (found.typed, [each.label for each in found.options]) == (2, ["sleep"])
    typed = document.complete(CODE, code="self.clock.", column=len("self.clock."))
    assert "now" in [each.label for each in typed.options]
    explanation = document.explain(CODE, code="self.sleep(1)", column=6)
    assert explanation is not None
    assert explanation.name == "sleep"
    signature = document.signature(CODE, code="self.sleep(", column=11)
    assert signature is not None
    assert len(signature.parameters) == 1
    assert document.signature(CODE, code="1", column=1) is None
    with pytest.raises(VisualHfsmError, match="there is no code"):
        document.complete(Place(kind="document", part="world"))


def test_a_component_is_generated_with_unsaved_changes(document: OpenDocument, root: Path) -> None:
    document.apply(SetStateCode(automaton=1, state=1, part="code", text="marker = 1"))
    file = document.generate()
    assert file == root / "waver.py"
    assert "marker = 1" in file.read_text()
    assert "marker" not in (root / "waver.xml").read_text()
    document.apply(SetStateCode(automaton=1, state=1, part="code", text="1 +"))
    with pytest.raises(VisualHfsmError, match="nothing was generated"):
        document.generate()
    assert "marker = 1" in file.read_text()


def test_a_document_without_a_file_is_generated_into_a_directory(
    blinker: OpenDocument, tmp_path: Path
) -> None:
    with pytest.raises(EditError, match="save it first, or name a directory"):
        blinker.generate()
    assert blinker.generate(tmp_path) == tmp_path / "untitled.py"
    assert [*tmp_path.iterdir()] == [tmp_path / "untitled.py"]


def test_a_document_is_simulated_as_it_is(blinker: OpenDocument) -> None:
    with blinker.simulate() as run:
        run.advance(0.9)
        assert run.is_active("off")
        blinker.apply(MoveItems(automaton=1, states=(1,), dx=10, dy=0))
        run.advance(0.2)
        assert run.is_active("on")
    blinker.apply(SetStateCode(automaton=1, state=1, part="code", text="1 +"))
    with pytest.raises(VisualHfsmError, match="cannot be run"):
        blinker.simulate()


def test_an_automaton_is_drawn_with_unsaved_changes(blinker: OpenDocument) -> None:
    assert ">off<" in blinker.svg()
    assert blinker.svg(1) == blinker.svg() == blinker._repr_svg_()
    with pytest.raises(MissingError, match="no automaton 7"):
        blinker.svg(7)
