"""What is computed of a document: once a version, with unsaved changes, and in its own time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from visualhfsm import (
    AddEntry,
    Checked,
    EditError,
    MissingError,
    MoveItems,
    OpenDocument,
    Place,
    Project,
    SetPeriod,
    SetText,
    VisualHfsmError,
)

pytestmark = pytest.mark.slow

CODE = Place(kind="state", automaton=1, id=1, part="code")


def test_problems_have_places_and_are_found_once_a_version(document: OpenDocument) -> None:
    heard: list[Any] = []
    document.subscribe(heard.append)
    document.apply(
        SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text="undefined_name + 1")
    )
    problems = document.problems()
    assert [each.place for each in problems if "undefined_name" in each.message] == [CODE]
    assert document.problems() == problems
    checked = [each for each in heard if isinstance(each, Checked) and each.findings.complete]
    assert [each.version for each in checked] == [document.version]
    assert document.check(again=True) == checked[0].findings
    document.undo()
    assert not any("undefined_name" in each.message for each in document.problems())
    assert len([each for each in heard if isinstance(each, Checked) and each.findings.complete]) == 3


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
    document.apply(SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text="self.sl"))
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
    document.apply(SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text="marker = 1"))
    file = document.generate()
    assert file == root / "waver.py"
    assert "marker = 1" in file.read_text()
    assert "marker" not in (root / "waver.xml").read_text()
    document.apply(SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text="1 +"))
    said = r"^It is not ready: code of wait \(waver.xml:9\): not valid Python: invalid syntax \[E520\]"
    with pytest.raises(VisualHfsmError, match=said):
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
    blinker.apply(SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text="1 +"))
    with pytest.raises(VisualHfsmError, match="cannot be run"):
        blinker.simulate()


def test_a_document_that_is_kept_elsewhere_is_simulated_as_it_is(
    project: Project, blinker: OpenDocument
) -> None:
    kept = project.open_text("run.mcap", blinker.text(), kept=True)
    with kept.simulate() as run:
        run.advance(1.1)
        assert run.is_active("on")
    kept.close()


def test_a_component_is_that_of_the_document_and_not_of_its_changed_file(
    document: OpenDocument, root: Path
) -> None:
    document.apply(SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text="mine = 1"))
    document.save()
    (root / "waver.xml").write_text("<no document")
    assert document.refresh() == "changed"
    assert "mine = 1" in document.generate().read_text()


def test_an_automaton_is_drawn_with_unsaved_changes(blinker: OpenDocument) -> None:
    assert ">off<" in blinker.svg()
    assert blinker.svg(1) == blinker.svg() == blinker._repr_svg_()
    with pytest.raises(MissingError, match="no automaton 7"):
        blinker.svg(7)


def test_a_document_that_becomes_as_it_was_checked_is_reported_again(document: OpenDocument) -> None:
    findings = document.check()
    heard: list[Any] = []
    document.apply(SetPeriod(automaton=1, period="50"))
    document.undo()
    document.subscribe(heard.append)
    assert document.check() is findings
    assert [each.version for each in heard] == [document.version]
    assert document.check() is findings
    assert len(heard) == 1


def test_nothing_is_proved_of_a_document_without_states(project: Project) -> None:
    made = project.new()
    with pytest.raises(EditError, match="no states"):
        made.prove()
    made.close()


@pytest.mark.parametrize("outside", ["another", "deleted"])
def test_what_another_program_did_just_now_is_neither_simulated_nor_generated(
    blinker: OpenDocument, outside: str
) -> None:
    file = blinker.save(f"{outside}.xml")
    file.write_text(blinker.text().replace(">off<", ">somewhere<"))
    if outside == "deleted":
        file.unlink()
    with blinker.simulate() as run:
        run.advance(0.5)
        assert run.active == "off"
    assert "somewhere" not in blinker.generate().read_text()


def test_half_a_character_is_no_code(document: OpenDocument) -> None:
    with pytest.raises(VisualHfsmError, match="no help"):
        document.complete(CODE, code="self.\ud800", column=5)
