"""Commands for notes and frames."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import pytest

from codegen.hfsm.document import Annotation, Document, Import, Text
from tests.support.editing import automaton, state, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import decode_command
from visualhfsm._document.commands.items import DeleteItems, MoveItems, PlaceItems, Placement
from visualhfsm._document.commands.notes import (
    AddAnnotation,
    ResizeAnnotation,
    SetAnnotationColor,
    SetAnnotationText,
)
from visualhfsm._document.commands.paste import PasteStates
from visualhfsm._document.places import Place, search
from visualhfsm._document.serialization import copy_states
from visualhfsm.project._editing.merge import merge_documents


def noted() -> Document:
    """A document with a note and a frame around its first state."""
    document = AddAnnotation(
        automaton=1, kind="note", x=10, y=20, width=180, height=90, text="why\nit waits"
    ).apply(tree())
    return AddAnnotation(
        automaton=1, kind="frame", x=40, y=40, width=120, height=120, color="blue", text="begin"
    ).apply(document)


def notes_of(document: Document) -> tuple[Annotation, ...]:
    return automaton(document).annotations


def test_a_note_is_added_with_its_text_and_the_least_size() -> None:
    add = AddAnnotation(automaton=1, kind="note", x=1, y=2, width=0, height=90, text="why")
    note = Annotation(id=1, kind="note", x=1.0, y=2.0, width=24.0, height=90.0, text=Text("why"))
    assert notes_of(add.apply(tree())) == (note,)
    assert add.title(tree()) == "Add a note"


def test_nothing_is_written_on_an_automaton_of_another_file() -> None:
    root = replace(automaton(tree()), imported=Import(file=Text("a.xml")))
    document = replace(tree(), automata=(root,))
    with pytest.raises(EditError, match="another file"):
        AddAnnotation(automaton=1, kind="note", x=0, y=0, width=90, height=90).apply(document)


def test_text_size_and_color_are_changed() -> None:
    document = SetAnnotationText(automaton=1, annotation=1, text="because").apply(noted())
    document = ResizeAnnotation(automaton=1, annotation=1, x=0, y=5, width=60, height=1).apply(document)
    document = SetAnnotationColor(automaton=1, annotations=(1, 2), color="green").apply(document)
    note, frame = notes_of(document)
    assert (note.text.text, note.x, note.y, note.width, note.height) == ("because", 0.0, 5.0, 60.0, 24.0)
    assert [each.color.text for each in (note, frame)] == ["green", "green"]


def test_a_color_that_there_is_not_is_refused() -> None:
    with pytest.raises(EditError):
        decode_command(
            '{"command": "setAnnotationColor", "automaton": 1, "annotations": [1], "color": "purple"}'
        )


@pytest.mark.parametrize("size", [float("nan"), 1e9])
def test_no_size_is_one_that_a_file_cannot_hold(size: float) -> None:
    with pytest.raises(EditError):
        ResizeAnnotation(automaton=1, annotation=1, x=0, y=0, width=size, height=90).apply(noted())


def test_a_missing_annotation_is_named() -> None:
    with pytest.raises(EditError, match="annotation 9 of automaton 1"):
        SetAnnotationText(automaton=1, annotation=9, text="").apply(noted())


def test_a_frame_moves_with_what_the_command_names() -> None:
    command = MoveItems(automaton=1, states=(1,), annotations=(2,), dx=5, dy=-5)
    document = command.apply(noted())
    assert (state(document, 1).x, state(document, 1).y) == (105.0, 95.0)
    assert [(each.x, each.y) for each in notes_of(document)] == [(10.0, 20.0), (45.0, 35.0)]
    assert command.title(noted()) == "Move the frame “begin”"


def test_deleting_a_frame_leaves_what_it_holds() -> None:
    command = DeleteItems(automaton=1, annotations=(2,))
    document = command.apply(noted())
    assert automaton(document).states == automaton(noted()).states
    assert [each.id for each in notes_of(document)] == [1]
    assert command.title(noted()) == "Delete the frame “begin”"


def test_a_step_names_a_note_by_its_words_as_they_are_seen() -> None:
    blank = AddAnnotation(automaton=1, kind="note", x=0, y=0, width=90, height=90).apply(tree())
    write = SetAnnotationText(automaton=1, annotation=1, text="why\nit waits")
    assert write.title(blank) == "Edit the note “why it waits”"
    assert SetAnnotationText(automaton=1, annotation=2, text=" ").title(noted()) == "Edit the frame “begin”"
    assert SetAnnotationColor(automaton=1, annotations=(2,), color="pink").title(noted()) == (
        "Color the frame “begin” pink"
    )


@pytest.mark.parametrize("kind", ["note", "frame"])
def test_a_step_gives_no_number_to_what_has_no_words(kind: Literal["note", "frame"]) -> None:
    blank = AddAnnotation(automaton=1, kind=kind, x=0, y=0, width=90, height=90).apply(tree())
    commands = (
        SetAnnotationText(automaton=1, annotation=1, text=""),
        ResizeAnnotation(automaton=1, annotation=1, x=0, y=0, width=60, height=60),
        SetAnnotationColor(automaton=1, annotations=(1,), color="pink"),
        MoveItems(automaton=1, annotations=(1,), dx=5, dy=5),
        DeleteItems(automaton=1, annotations=(1,)),
    )
    assert [command.title(blank) for command in commands] == [
        f"Edit a {kind}",
        f"Resize a {kind}",
        f"Color a {kind} pink",
        f"Move a {kind}",
        f"Delete a {kind}",
    ]


def test_annotations_are_placed_by_a_layout() -> None:
    placement = Placement(automaton=1, annotations=((1, 300.0, 310.0, 90.0, 5.0),))
    document = PlaceItems(placements=(placement,)).apply(noted())
    placed, other = notes_of(document)
    assert (placed.x, placed.y, placed.width, placed.height) == (300.0, 310.0, 90.0, 24.0)
    assert (other.x, other.y) == (40.0, 40.0)


def test_a_frame_is_pasted_with_its_states() -> None:
    text = copy_states(noted(), 1, [1], [2])
    document = PasteStates(automaton=1, content=text, x=400.0, y=400.0).apply(noted())
    pasted, frame = automaton(document).states[-1], notes_of(document)[-1]
    assert (pasted.x, pasted.y) == (400.0, 400.0)
    assert (frame.id, frame.x, frame.y, frame.text.text) == (3, 340.0, 340.0, "begin")


def test_a_note_alone_is_pasted_beside_itself() -> None:
    document = PasteStates(automaton=1, content=copy_states(noted(), 1, [], [1])).apply(noted())
    first, *_, last = notes_of(document)
    assert last.text == first.text
    assert (last.x, last.y) != (first.x, first.y)


def test_the_search_finds_what_is_written() -> None:
    (hit,) = search(noted(), "IT WAITS")
    assert hit.place == Place(kind="annotation", automaton=1, id=1, part="text")
    assert (hit.line, hit.column) == (2, 1)


def test_a_merge_keeps_the_new_notes_of_both_sides() -> None:
    base = tree()
    mine, theirs = (
        AddAnnotation(automaton=1, kind="note", x=0, y=0, width=90, height=90, text=text).apply(base)
        for text in ("mine", "theirs")
    )
    merged = merge_documents(base, mine, theirs)
    assert [(each.id, each.text.text) for each in notes_of(merged.document)] == [
        (1, "mine"),
        (2, "theirs"),
    ]
    assert merged.conflicts == ()


def test_a_merge_names_the_note_that_both_rewrote() -> None:
    base = noted()
    mine, theirs = (
        SetAnnotationText(automaton=1, annotation=1, text=text).apply(base) for text in ("mine", "theirs")
    )
    merged = merge_documents(base, mine, theirs)
    assert notes_of(merged.document)[0].text.text == "mine"
    assert merged.conflicts == ("note “mine” (text): yours stays",)
