"""What an element of a document holds, sorted, and how what is unknown in it is kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, TypedDict

from ...document import Comment, Element, Extra, Leaf, Text
from ..xml_tree import XmlComment, XmlElement

__all__ = [
    "KEPT",
    "NOTHING",
    "NodeFields",
    "Parts",
    "kept_children",
    "kept_element",
    "node_fields",
    "own_text",
    "text_of",
]

KEPT: Final = "kept"
"""Holds an unknown element of an old dialect whose name means something in the native one."""


@dataclass(frozen=True, slots=True)
class Parts:
    """The children of an element, sorted: known ones by tag, what stands around them, and the rest."""

    known: dict[str, list[XmlElement]]
    comments: dict[XmlElement, tuple[Comment, ...]]
    details: dict[str, Leaf]
    extras: tuple[Extra, ...]

    def first(self, tag: str) -> XmlElement | None:
        """Return the first known child with this tag, or None."""
        return next(iter(self.known.get(tag, ())), None)

    def all(self, tag: str) -> list[XmlElement]:
        """Return the known children with this tag."""
        return self.known.get(tag, [])

    def comments_before(self, element: XmlElement) -> tuple[Comment, ...]:
        """Return the comments in front of a known child that there may be several of."""
        return self.comments.get(element, ())

    def leaves(self, native: Mapping[str, str]) -> tuple[Leaf, ...]:
        """Return what the leaves have beside their text, by their names in the native dialect."""
        found = (
            replace(leaf, tag=native.get(tag, tag))
            for tag, leaf in self.details.items()
            if native.get(tag, tag)
        )
        return tuple(sorted(found, key=lambda leaf: leaf.tag))

    def lost_details(self, native: Mapping[str, str]) -> tuple[Extra, ...]:
        """Return what stands around leaves that the native dialect has not, so that it can be kept."""
        found: list[Extra] = []
        for tag, leaf in self.details.items():
            if not native.get(tag, tag):
                found += leaf.comments
                if leaf.attributes or leaf.children:
                    inside = Element(tag, leaf.attributes, leaf.text, leaf.children)
                    found.append(Element(KEPT, children=(inside,)))
        return tuple(found)


NOTHING: Final = Parts({}, {}, {}, ())
"""The parts of an element that is not there."""


class NodeFields(TypedDict):
    """What every element of the model has."""

    comments: tuple[Comment, ...]
    extras: tuple[Extra, ...]
    leaves: tuple[Leaf, ...]
    attributes: tuple[tuple[str, str], ...]
    line: int
    column: int


def node_fields(
    element: XmlElement,
    parts: Parts,
    *known: str,
    comments: tuple[Comment, ...] = (),
    native: Mapping[str, str] | None = None,
) -> NodeFields:
    """Return what every element of the model has; `known` are the attributes that the model has by name.

    `native` are the native names of leaves that are called otherwise, blank for those that it has not.
    """
    native = native or {}
    return NodeFields(
        comments=comments,
        extras=parts.lost_details(native) + parts.extras,
        leaves=parts.leaves(native),
        attributes=tuple((name, value) for name, value in element.attributes.items() if name not in known),
        line=element.line,
        column=element.column,
    )


def text_of(element: XmlElement | None, default: str = "") -> Text:
    """Return the text in an element with its place."""
    if element is None:
        return Text(default)
    return Text(element.text, element.text_line, element.text_column)


def own_text(element: XmlElement, tag: str | None = None) -> Parts:
    """Return the parts of a node that holds a text: what it has inside beside that.

    `tag` is the name that the node has in the native dialect, where that is another.
    """
    if not element.children:
        return NOTHING
    tag = tag or element.tag
    leaf = Leaf(tag, (), (), element.head, kept_children(element, mixed=True))
    return Parts({}, {}, {tag: leaf}, ())


def kept_element(element: XmlElement) -> Element:
    """Return an element with all in it; white space that only indents its children is not kept."""
    mixed = bool(element.text.strip())
    text = element.head if mixed or not element.children else ""
    return Element(element.tag, tuple(element.attributes.items()), text, kept_children(element, mixed=mixed))


def kept_children(element: XmlElement, *, mixed: bool) -> tuple[Extra, ...]:
    """Return the children of an element, with the text between them when it is `mixed` with text."""
    return tuple(_kept_child(child, child.tail if mixed else "") for child in element.children)


def _kept_child(child: XmlElement | XmlComment, tail: str) -> Extra:
    if isinstance(child, XmlComment):
        return Comment(child.text, tail)
    return replace(kept_element(child), tail=tail)
