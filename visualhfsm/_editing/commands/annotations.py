"""Commands for notes and frames on the canvas."""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from codegen.hfsm.document import SMALLEST_ANNOTATION, Annotation, Automaton, Document, Text
from visualhfsm._errors import EditError

from ..nodes import (
    changed,
    checked,
    coordinate,
    find_annotation,
    find_automaton,
    free_ids,
    label,
    swapped,
)
from .base import AutomatonCommand, Id, Ids

Color = Literal["", "yellow", "blue", "green", "pink", "gray"]
"""A color of `ANNOTATION_COLORS`; blank is that of the kind."""


class AddAnnotation(AutomatonCommand, frozen=True, kw_only=True):
    """Add a note or a frame with its upper left corner at `x`, `y`."""

    kind: Literal["note", "frame"]
    x: float
    y: float
    width: float
    height: float
    color: Color = ""
    text: str = ""

    def change(self, automaton: Automaton) -> Automaton:
        if automaton.imported is not None:
            why = "its content comes from another file"
            raise EditError("Cannot draw in this automaton", why, "change that file, or inline it first")
        made = Annotation(
            id=next(free_ids(each.id for each in automaton.annotations)),
            kind=self.kind,
            x=coordinate(self.x),
            y=coordinate(self.y),
            width=_size(self.width),
            height=_size(self.height),
            color=Text(self.color),
            text=Text(checked(self.text, "the text")),
        )
        return replace(automaton, annotations=(*automaton.annotations, made))

    def title(self, document: Document) -> str:
        return f"Add a {self.kind}"


class _AnnotationCommand(AutomatonCommand, frozen=True, kw_only=True):
    """A change of one annotation."""

    annotation: Id

    def changed_annotation(self, annotation: Annotation) -> Annotation:
        return changed(annotation, **self.own_fields(_AnnotationCommand))

    def change(self, automaton: Automaton) -> Automaton:
        former = find_annotation(automaton, self.annotation)
        new = self.changed_annotation(former)
        return changed(automaton, annotations=swapped(automaton.annotations, former, new))

    def title(self, document: Document) -> str:
        found = find_annotation(find_automaton(document, self.automaton), self.annotation)
        return f"{self._verb} the {found.kind} {label(found)}"

    @property
    def _verb(self) -> str:
        raise NotImplementedError


class SetAnnotationText(_AnnotationCommand, frozen=True, kw_only=True):
    """Set the text of a note, or the title of a frame."""

    typed = ("text",)
    text: str

    @property
    def _verb(self) -> str:
        return "Edit"


class ResizeAnnotation(_AnnotationCommand, frozen=True, kw_only=True):
    """Set the upper left corner and the size of a note or a frame."""

    typed = ("x", "y", "width", "height")
    x: float
    y: float
    width: float
    height: float

    def changed_annotation(self, annotation: Annotation) -> Annotation:
        return changed(
            annotation,
            x=coordinate(self.x),
            y=coordinate(self.y),
            width=_size(self.width),
            height=_size(self.height),
        )

    @property
    def _verb(self) -> str:
        return "Resize"


class SetAnnotationColor(AutomatonCommand, frozen=True, kw_only=True):
    """Set the color of notes and frames."""

    annotations: Ids
    color: Color

    def change(self, automaton: Automaton) -> Automaton:
        chosen = {find_annotation(automaton, number).id for number in self.annotations}
        return changed(
            automaton,
            annotations=tuple(
                changed(each, color=self.color) if each.id in chosen else each
                for each in automaton.annotations
            ),
        )

    def title(self, document: Document) -> str:
        return f"Color {'notes' if len(self.annotations) > 1 else 'a note'} {self.color or 'as usual'}"


def _size(value: float) -> float:
    """Return a width or height that a file can hold. Raises EditError when it is none."""
    return max(SMALLEST_ANNOTATION, coordinate(value))
