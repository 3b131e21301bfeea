"""Commands for notes and frames on the canvas."""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from dataclasses import replace
from typing import Final, Literal

from codegen.hfsm.document import Annotation, Automaton, Document, Text
from codegen.messages import Message

from .. import nodes
from .base import AutomatonCommand, Id, Ids

Color = Literal["", "yellow", "blue", "green", "pink", "gray"]
"""A color of `ANNOTATION_COLORS`; blank is that of the kind."""
_COLORS: Final[dict[Color, Message]] = {
    "": Message("as usual"),
    "yellow": Message("yellow"),
    "blue": Message("blue"),
    "green": Message("green"),
    "pink": Message("pink"),
    "gray": Message("gray"),
}


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
        nodes.require_own_content(automaton, Message("Cannot draw in this automaton"))
        made = Annotation(
            id=next(nodes.free_ids(each.id for each in automaton.annotations)),
            kind=self.kind,
            x=nodes.coordinate(self.x),
            y=nodes.coordinate(self.y),
            width=nodes.size(self.width),
            height=nodes.size(self.height),
            color=Text(self.color),
            text=Text(nodes.checked(self.text, Message("the text"))),
        )
        return replace(automaton, annotations=(*automaton.annotations, made))

    def title(self, document: Document) -> Message:
        return Message("Add a frame") if self.kind == "frame" else Message("Add a note")


class _AnnotationCommand(AutomatonCommand, frozen=True, kw_only=True):
    """A change of one annotation."""

    annotation: Id

    def changed_annotation(self, annotation: Annotation) -> Annotation:
        return nodes.changed(annotation, **self.own_fields(_AnnotationCommand))

    def change(self, automaton: Automaton) -> Automaton:
        former = nodes.find_annotation(automaton, self.annotation)
        new = self.changed_annotation(former)
        return nodes.changed(automaton, annotations=nodes.swapped(automaton.annotations, former, new))

    def title(self, document: Document) -> Message:
        return self._titled(nodes.described(self._named(document)))

    def _named(self, document: Document) -> Annotation:
        """Return the annotation with the words that name it."""
        return nodes.find_annotation(nodes.find_automaton(document, self.automaton), self.annotation)

    def _titled(self, what: Message) -> Message:
        raise NotImplementedError


class SetAnnotationText(_AnnotationCommand, frozen=True, kw_only=True):
    """Set the text of a note, or the title of a frame."""

    typed = ("text",)
    text: str

    def _named(self, document: Document) -> Annotation:
        # By the new words, which are seen from then on, unless all were deleted.
        former = super()._named(document)
        return self.changed_annotation(former) if self.text.strip() else former

    def _titled(self, what: Message) -> Message:
        return Message("Edit {what}", what=what)


class ResizeAnnotation(_AnnotationCommand, frozen=True, kw_only=True):
    """Set the upper left corner and the size of a note or a frame."""

    typed = ("x", "y", "width", "height")
    x: float
    y: float
    width: float
    height: float

    def changed_annotation(self, annotation: Annotation) -> Annotation:
        return nodes.changed(
            annotation,
            x=nodes.coordinate(self.x),
            y=nodes.coordinate(self.y),
            width=nodes.size(self.width),
            height=nodes.size(self.height),
        )

    def _titled(self, what: Message) -> Message:
        return Message("Resize {what}", what=what)


class SetAnnotationColor(AutomatonCommand, frozen=True, kw_only=True):
    """Set the color of notes and frames."""

    annotations: Ids
    color: Color

    def change(self, automaton: Automaton) -> Automaton:
        chosen = {nodes.find_annotation(automaton, number).id for number in self.annotations}
        return nodes.changed(
            automaton,
            annotations=tuple(
                nodes.changed(each, color=self.color) if each.id in chosen else each
                for each in automaton.annotations
            ),
        )

    def title(self, document: Document) -> Message:
        color = _COLORS[self.color]
        if len(self.annotations) != 1:
            return Message("Color notes {color}", color=color)
        found = nodes.find_annotation(nodes.find_automaton(document, self.automaton), self.annotations[0])
        return Message("Color {what} {color}", what=nodes.described(found), color=color)
