"""Who types where others type, too, undoes what is his or her own, and nothing else."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Final

import pytest

from codegen.hfsm import write_document
from tests.support.editing import tree
from visualhfsm import OpenDocument, Project
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands.states import RenameState
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.places import Place, texts_at
from visualhfsm.project._editing.undo_stack import Own

A, B = 1, 2
HERE: Final = Place(kind="state", automaton=1, id=1, part="code")
THERE: Final = Place(kind="state", automaton=1, id=2, part="code")
OF_A, OF_B = Own(A, HERE, {B}), Own(B, HERE, {A})
BEGUN: Final = "wait(1)"


@pytest.fixture
def shared(tmp_path: Path):
    file = tmp_path / "shared.xml"
    file.write_text(write_document(tree()))
    opened = Project(tmp_path, journals=tmp_path / "journals", merge_within=0.0).open(file)
    opened.apply(SetText(place=HERE, text=BEGUN))
    yield opened
    opened.close(discard=True)


def text(shared: OpenDocument, place: Place = HERE) -> str:
    return texts_at(shared.version.document, place)[0]


def add(shared: OpenDocument, word: str, by: int, place: Place = HERE) -> None:
    """Add a line with a word."""
    shared.apply(SetText(place=place, text=f"{text(shared, place)}\n{word}"), by=by)


@pytest.mark.parametrize("word", ["beta", "two", "three", "t", "wo t", "2"])
def test_what_another_typed_into_my_words_stays_when_i_undo_them(shared: OpenDocument, word: str) -> None:
    add(shared, "# one two three", A)
    shared.apply(SetText(place=HERE, text=f"{BEGUN}\n# one two {word} three"), by=B)
    undone = shared.undo(OF_A)
    assert (undone.is_own, undone.by, undone.name, undone.place) == (True, A, "Edit the code of “wait”", HERE)
    assert text(shared).split("\n")[0] == BEGUN
    assert text(shared).split("\n")[1].strip() == word
    shared.redo(OF_A)
    assert text(shared) == f"{BEGUN}\n# one two {word} three"


def test_undo_goes_on_with_what_i_typed_before_and_never_leaves_the_place(shared: OpenDocument) -> None:
    add(shared, "a1", A)
    add(shared, "b1", B)
    add(shared, "there", A, THERE)
    add(shared, "a2", A)
    add(shared, "b2", B)
    seen = []
    for _ in range(2):
        shared.undo(OF_A)
        seen.append(text(shared).split("\n")[1:])
    assert seen == [["a1", "b1", "b2"], ["b1", "b2"]]
    with pytest.raises(EditError, match="you have typed nothing here"):
        shared.undo(OF_A)
    assert text(shared, THERE).endswith("there")
    for _ in range(2):
        shared.redo(OF_A)
    assert text(shared).split("\n")[1:] == ["a1", "b1", "a2", "b2"]
    with pytest.raises(EditError, match="nothing to redo"):
        shared.redo(OF_A)


def test_what_i_typed_since_is_undone_first_and_not_redone(shared: OpenDocument) -> None:
    add(shared, "a1", A)
    add(shared, "b1", B)
    shared.undo(OF_A)
    add(shared, "a2", A)
    with pytest.raises(EditError, match="nothing to redo"):
        shared.redo(OF_A)
    assert not shared.undo(OF_A).is_own  # the last step, as it is
    assert text(shared).split("\n")[1:] == ["b1"]


def test_alone_all_steps_are_undone_wherever_they_are(shared: OpenDocument) -> None:
    shared.apply(RenameState(automaton=1, state=1, name="a"), by=A)
    alone = Own(A, HERE, ())
    assert shared.undo(alone).name == "Rename “wait”"
    add(shared, "of a page that was loaded again", B)
    assert shared.undo(alone).by == B
    assert text(shared) == BEGUN


def test_of_a_state_that_is_gone_nothing_is_undone(shared: OpenDocument) -> None:
    add(shared, "a1", A, THERE)
    shared.cut(1, (2,), by=B)
    with pytest.raises(EditError, match="you have typed nothing here"):
        shared.undo(Own(A, THERE, {B}))


def test_on_the_canvas_the_last_step_is_undone_and_says_by_whom(shared: OpenDocument) -> None:
    add(shared, "a1", A)
    shared.apply(RenameState(automaton=1, state=1, name="b"), by=B)
    assert [shared.undo().by, shared.undo().by] == [B, A]
    assert [shared.redo().by, shared.redo().by] == [A, B]


@pytest.mark.parametrize("seed", range(20))
def test_each_undoes_and_redoes_all_own_words_and_no_other(shared: OpenDocument, seed: int) -> None:
    random = Random(seed)
    typed: dict[int, list[str]] = {A: [], B: []}
    add(shared, "a", A)
    add(shared, "b", B)
    for number in range(12):
        by = random.choice((A, B))
        lines = text(shared).split("\n")
        lines.insert(random.randrange(1, len(lines) + 1), f"{by}-{number}")
        typed[by].append(f"{by}-{number}")
        shared.apply(SetText(place=HERE, text="\n".join(lines)), by=by)
    add(shared, "last", B)
    full = text(shared)
    for _ in range(len(typed[A]) + 1):
        shared.undo(OF_A)
    left = text(shared).split("\n")
    assert [each for each in left if each in typed[A]] == []
    assert [each for each in left if each in typed[B]] == [
        each for each in full.split("\n") if each in typed[B]
    ]
    for _ in range(len(typed[A]) + 1):
        shared.redo(OF_A)
    assert sorted(text(shared).split("\n")) == sorted(full.split("\n"))


def test_a_journal_has_what_was_taken_back(shared: OpenDocument, tmp_path: Path) -> None:
    add(shared, "a1", A)
    add(shared, "b1", B)
    shared.undo(OF_A)
    expected = text(shared)
    shared.abandon()
    project = Project(tmp_path, journals=tmp_path / "journals")
    (journal,) = project.recoverable()
    recovered = project.recover(journal.file.name)
    assert text(recovered) == expected
    recovered.close(discard=True)
