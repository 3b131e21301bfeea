"""Read the elements of a document, whatever its dialect: sort them, and understand their ids and numbers.

What a dialect does not know is kept, in order, so that a document can be written back whole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Final, TypedDict

from codegen.diagnostics import Diagnostics, Location, Note

from ..codes import Code
from ..document import Comment, Element, Extra, Leaf, Text
from .xml_tree import XmlComment, XmlElement

__all__ = [
    "KEPT",
    "MAX_ID",
    "NOTHING",
    "ElementReader",
    "NodeFields",
    "Parts",
    "node_fields",
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
                if leaf.attributes:
                    found.append(Element(KEPT, children=(Element(tag, leaf.attributes),)))
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


_MOST_LINES: Final = 20
"""Lines of which a remark tells."""

MAX_ID: Final = 2**31 - 1
"""The largest id."""


class ElementReader:
    """What the readers of all dialects share; `failed` says that the file cannot be understood.

    A dialect whose editor is gone is not `strict`: what it has twice is kept, the first counts. `remarks`
    gets what is kept but has no use here, where anyone wants to know.
    """

    strict = True
    leaf_attributes: frozenset[tuple[str, str]] = frozenset()
    """The attributes of leaves that the dialect knows, each with its leaf."""

    def __init__(self, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None) -> None:
        self.path = path
        self.diagnostics = diagnostics
        self.remarks = remarks
        self.failed = False
        self._remarked: dict[str, list[XmlElement]] = {}

    def parts(
        self,
        element: XmlElement,
        nodes: Collection[str] = (),
        leaves: Collection[str] = (),
        containers: Collection[str] = (),
        *,
        taken: Collection[str] = (),
    ) -> Parts:
        """Sort the children of an element: nodes may repeat, leaves hold text, containers hold nodes.

        `taken` are the names that unknown elements cannot keep, because they mean something in the native
        dialect. A comment belongs to the known element that follows it; before anything else it is an extra.
        """
        known: dict[str, list[XmlElement]] = {}
        comments: dict[XmlElement, tuple[Comment, ...]] = {}
        details: dict[str, Leaf] = {}
        extras: list[Extra] = []
        pending: list[Comment] = []
        if element.text.strip():
            self.warn(
                element, Code.LOST_ON_SAVING, f"text of its own in `{element.tag}` is not kept on saving"
            )
        for child in element.children:
            if isinstance(child, XmlComment):
                pending.append(Comment(child.text))
                continue
            if child.tag in nodes:
                comments[child] = tuple(pending)
                known.setdefault(child.tag, []).append(child)
            elif (child.tag in leaves or child.tag in containers) and not self._is_second(child, known):
                known[child.tag] = [child]
                leaf = self._details(child, tuple(pending), content=child.tag in leaves)
                if leaf != Leaf(child.tag):
                    details[child.tag] = leaf
            else:
                extras += pending
                says_something = child.text.strip() or child.children or child.attributes
                if says_something and child.tag not in leaves and child.tag not in containers:
                    self.remark(child, f"`{child.tag}` has no meaning here: it is kept, and not used")
                kept = self.kept(child)
                extras.append(Element(KEPT, children=(kept,)) if child.tag in taken else kept)
            pending.clear()
        extras += pending
        return Parts(known, comments, details, tuple(extras))

    def _is_second(self, child: XmlElement, known: Mapping[str, Sequence[XmlElement]]) -> bool:
        """Tell of a second leaf of one kind, which is kept as an unknown element unless that is an error."""
        if child.tag not in known:
            return False
        first = Note("the first is here", self.place(known[child.tag][0]))
        if self.strict:
            self.error(child, Code.REPEATED_ELEMENT, f"a second `{child.tag}`", first)
        else:
            self.warn(
                child,
                Code.OLD_REPEATED_ELEMENT,
                f"a second `{child.tag}` is kept, and the first counts",
                first,
            )
        return True

    def _details(self, child: XmlElement, comments: tuple[Comment, ...], *, content: bool) -> Leaf:
        if content and child.children:
            self._warn_of_loss(child)
        attributes = tuple(
            (name, value)
            for name, value in child.attributes.items()
            if (child.tag, name) not in self.leaf_attributes
        )
        return Leaf(child.tag, comments, attributes)

    def kept(self, element: XmlElement) -> Element:
        """Return an unknown element as it is kept: with its text, or else with its children."""
        is_text = bool(element.text.strip()) or not element.children
        if is_text and element.children:
            self._warn_of_loss(element)
        children = () if is_text else tuple(map(self._kept_child, element.children))
        text = element.text if is_text else ""
        return Element(element.tag, tuple(element.attributes.items()), text, children)

    def _kept_child(self, child: XmlElement | XmlComment) -> Extra:
        return Comment(child.text) if isinstance(child, XmlComment) else self.kept(child)

    def text_fields(self, element: XmlElement, *known: str, comments: tuple[Comment, ...] = ()) -> NodeFields:
        """Return what a node that holds only a text has besides."""
        if element.children:
            self._warn_of_loss(element)
        return node_fields(element, NOTHING, *known, comments=comments)

    def _warn_of_loss(self, element: XmlElement) -> None:
        message = f"comments and elements inside the text of `{element.tag}` are not kept on saving"
        self.warn(element, Code.LOST_ON_SAVING, message)

    def ids(
        self,
        elements: Sequence[XmlElement],
        given: Callable[[XmlElement], str | None],
        *,
        expected: bool = True,
    ) -> dict[XmlElement, int]:
        """Return the ids of elements of one kind; who has none gets a free one, told if one is `expected`."""
        found: dict[XmlElement, int] = {}
        for element in elements:
            text = given(element)
            if text is not None and text.strip():
                found[element] = self.parse_id(element, "id", text)
        used = set(found.values())
        free = (number for number in count(1) if number not in used)
        for element in elements:
            if element not in found:
                found[element] = next(free)
            if expected and not (given(element) or "").strip():
                self.warn(
                    element, Code.MISSING_ID, f"`{element.tag}` has no id: it is given {found[element]}"
                )
        return found

    def reference(self, parent: XmlElement, element: XmlElement | None, name: str) -> int:
        """Return the id that an element refers to; 0, with a warning, when nothing is said."""
        if element is None or not element.text.strip():
            self.warn(element or parent, Code.MISSING_ID, f"`{parent.tag}` does not say its `{name}`")
            return 0
        return self.parse_id(element, name, element.text)

    def optional_id(self, element: XmlElement, name: str, text: str | None) -> int:
        """Return an id, or 0 when the text is blank or None."""
        return 0 if text is None or not text.strip() else self.parse_id(element, name, text)

    def parse_id(self, element: XmlElement, name: str, value: str) -> int:
        """Return the id in a text; reports an error when it is none."""
        digits = value.strip()
        if digits.isascii() and digits.isdigit() and len(digits) <= 10 and int(digits) <= MAX_ID:
            return int(digits)
        self.error(
            element, Code.MALFORMED_ELEMENT, f"`{name}` is a number from 0 to {MAX_ID}, not `{value[:40]}`"
        )
        return 0

    def number(self, element: XmlElement | None) -> float:
        """Return a number of pixels, 0 when there is none; reports an error when it cannot be read."""
        return 0.0 if element is None else self.parse_number(element, element.tag, element.text)

    def parse_number(self, element: XmlElement, name: str, text: str) -> float:
        """Return the number in a text, 0 when it is blank."""
        if not text.strip():
            return 0.0
        number = _finite(text)
        if number is None and text.count(",") == 1:
            number = _finite(text.replace(",", "."))
            if number is not None:
                message = f"`{name}` is written with a comma: `{text.strip()[:40]}` is taken for {number}"
                self.warn(element, Code.COMMA_IN_NUMBER, message)
        if number is None:
            self.error(element, Code.MALFORMED_ELEMENT, f"`{name}` is a number of pixels, not `{text[:40]}`")
            return 0.0
        return number

    def parse_flag(self, element: XmlElement, name: str, text: str | None) -> bool:
        """Return whether a text says true; blank and None are false."""
        value = (text or "").strip().lower()
        if value not in ("true", "false", "1", "0", ""):
            self.error(element, Code.MALFORMED_ELEMENT, f"`{name}` is `true` or `false`, not `{value[:40]}`")
        return value in ("true", "1")

    def place(self, element: XmlElement) -> Location:
        """Return where the start tag of an element stands."""
        return Location(self.path, element.line, element.column, len(element.tag) + 1)

    def error(self, element: XmlElement, code: str, message: str, *notes: Note) -> None:
        """Report what keeps the file from being understood."""
        self.failed = True
        self.diagnostics.error(code, message, self.place(element), notes)

    def warn(self, element: XmlElement, code: str, message: str, *notes: Note) -> None:
        """Report what was understood in one of several ways."""
        self.diagnostics.warning(code, message, self.place(element), notes)

    def remark(self, element: XmlElement, message: str) -> None:
        """Remember what is kept without being used."""
        self._remarked.setdefault(message, []).append(element)

    def tell_remarks(self) -> None:
        """Tell what is kept without being used: each kind once, with all its lines."""
        if self.remarks is None:
            return
        for message, (first, *others) in self._remarked.items():
            lines = sorted({element.line for element in others} - {first.line})
            listed = ", ".join(map(str, lines[:_MOST_LINES]))
            more = f" and {len(lines) - _MOST_LINES} more" if len(lines) > _MOST_LINES else ""
            where = f"also in line{'s' if len(lines) > 1 else ''} {listed}{more}"
            self.remarks.note(Code.KEPT_UNUSED, message, self.place(first), [Note(where)] if lines else [])


def _finite(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None
