"""Read the native format with its tables.

Unknown elements and attributes, and comments, are kept with their node.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, Final, cast

from codegen.diagnostics import Diagnostics, Location, Note, did_you_mean
from codegen.hfsm.formats.schema import (
    ANNOTATION,
    DOCUMENT,
    TRANSITION,
    Items,
    Leaf,
    NodeKind,
    enclosing_tags,
)

from ...messages import Message, any_of
from ..codes import Code
from ..document import NO_CHILD, Document, Element, Extra, Node, Text
from .xml_tree import XmlElement

MAX_ID: Final = 2**31 - 1
"""The largest id."""

_KEPT: Final = "kept"
"""The tag around an unknown element of an old dialect whose name has a meaning in the native format."""
_FORMER: Final = frozenset({"servertype", "topic"})
"""Elements of the editor of 2017 in the current format, which choose between Ice and ROS 1."""
_PREFIX: Final = ":"
"""After it comes the name that another program has given to its own element."""
_MOST_LINES: Final = 20  # in the list of a remark

Translation = Callable[[XmlElement], list[XmlElement]]
"""Translates an element of an old dialect to native elements."""


class NativeReader:
    """Builds a document from a tree of XML; after errors it has `failed`.

    `remarks` gets notes about what an old document has that is kept but not used, except about the elements
    in `expected`. With `unique_ids` transitions get such ones: the original generators ignored them.
    """

    def __init__(
        self,
        path: Path,
        diagnostics: Diagnostics,
        remarks: Diagnostics | None,
        *,
        is_old: bool = False,
        unique_ids: bool = False,
    ) -> None:
        self.path = path
        self.diagnostics = diagnostics
        self.remarks = remarks
        self.failed = False
        self._is_old = is_old
        self._unique_ids = unique_ids
        self.expected: set[XmlElement] = set()
        self._remarked: dict[Message, list[XmlElement]] = {}
        self._lists: list[Element] = []

    def document(self, root: XmlElement) -> Document:
        """Return the document; it is useless if the reader has `failed` afterwards."""
        document = cast("Document", self._node(root, DOCUMENT))
        self._report_remarks()
        return replace(document, root_tag=root.tag, lists=tuple(self._lists))

    def _node(self, element: XmlElement, kind: NodeKind) -> Node:
        fields: dict[str, Any] = {}
        self._check_attributes(element, kind)
        for name, leaf in kind.attributes.items():
            if name in element.attributes:
                fields[leaf.field] = self._value(element, name, element.attributes[name], leaf.type)
            elif leaf.type is str and not leaf.optional:
                message = Message("`{element}` needs the attribute `{name}`", element=element.name, name=name)
                self.error(element, Code.MALFORMED_ELEMENT, message)
                fields[leaf.field] = ""
        extras: tuple[Extra, ...] = ()
        if kind.text:
            self.check_leaf(element, *element.attributes)
            fields[kind.text] = element.content
        else:
            found, extras = self._sorted(element, kind.children)
            for tag, child in kind.children.items():
                if isinstance(child, Items):
                    fields[child.field] = self._items(child, found.get(tag, []))
                else:
                    self._leaf(fields, element, tag, child, found.get(tag, []))
        return kind.model(
            **fields,
            comments=tuple(element.comments),
            extras=extras,
            attributes=tuple(each for each in element.attributes.items() if each[0] not in kind.attributes),
            line=element.line,
            column=element.column,
        )

    def _sorted(
        self, element: XmlElement, known: Mapping[str, Leaf | Items]
    ) -> tuple[dict[str, list[XmlElement]], tuple[Extra, ...]]:
        """Return the known children of an element, and its other content.

        A comment belongs to the following node, or to the enclosing element if another element follows.
        """
        found: dict[str, list[XmlElement]] = {}
        extras: list[Extra] = []
        if element.text.strip():
            message = Message("text directly in `{element}` is lost on saving", element=element.name)
            self.warn(element, Code.LOST_ON_SAVING, message)
        for child in element.children:
            expected = known.get(child.tag)
            if not isinstance(expected, Items) or expected.listed:
                extras += child.comments
            if expected is None:
                self._report_unknown(child, element, known)
                extras.append(self._kept(child))
            elif child.tag in found and not expected.repeats:
                first = Note(Message("the first is here"), self.place(found[child.tag][0]))
                message = Message("a second `{element}`", element=child.name)
                self.error(child, Code.REPEATED_ELEMENT, message, first)
            else:
                found.setdefault(child.tag, []).append(child)
        return found, (*extras, *element.trailing)

    def _check_attributes(self, element: XmlElement, kind: NodeKind) -> None:
        """Warn about unknown attributes that resemble known ones; others are somebody's own."""
        for name in element.attributes.keys() - kind.attributes.keys():
            if not self._is_old and (notes := did_you_mean(name, kind.attributes)):
                message = Message(
                    "`{element}` has no attribute `{name}`: it is kept, but not used",
                    element=element.name,
                    name=name,
                )
                self.warn(element, Code.UNKNOWN_ELEMENT, message, *notes)

    def _report_unknown(self, element: XmlElement, around: XmlElement, known: Collection[str]) -> None:
        """Warn about an unknown element; in an old document, which has many, it is a remark."""
        if self._is_old or element.tag in _FORMER or _PREFIX in element.tag:
            self.remark_unknown(element)
            return
        notes = did_you_mean(element.name, known)
        if not notes and (places := enclosing_tags(element.tag)):
            where = any_of([f"`{place}`" for place in places])
            notes = (Note(Message("it belongs into {places}", places=where)),)
        message = Message(
            "`{element}` means nothing in `{around}`: it is kept, but not used",
            element=element.name,
            around=around.name,
        )
        self.warn(element, Code.UNKNOWN_ELEMENT, message, *notes)

    def _kept(self, element: XmlElement) -> Element:
        """Return an unknown element with its text or its children."""
        attributes = tuple(element.attributes.items())
        if element.text.strip() or not (element.children or element.trailing):
            self.check_leaf(element, *element.attributes)
            return Element(element.tag, attributes, element.text)
        children: list[Extra] = []
        for each in element.children:
            children += [*each.comments, self._kept(each)]
        return Element(element.tag, attributes, "", (*children, *element.trailing))

    def _items(self, items: Items, found: list[XmlElement]) -> tuple[Node, ...] | Node | None:
        if items.listed and found:
            container = found[0]
            inside, extras = self._sorted(container, {items.kind.tag: Items(items.field, items.kind)})
            if extras or container.attributes:
                self._lists.append(Element(container.tag, tuple(container.attributes.items()), "", extras))
            found = inside.get(items.kind.tag, [])
        if "id" in items.kind.attributes:
            is_unique = items.kind is ANNOTATION or (items.kind is TRANSITION and self._unique_ids)
            self.number(found, unique=is_unique)
        nodes = tuple(self._node(element, items.kind) for element in found)
        return next(iter(nodes), None) if items.one else nodes

    def _leaf(
        self, fields: dict[str, Any], parent: XmlElement, tag: str, leaf: Leaf, found: Sequence[XmlElement]
    ) -> None:
        """Add the fields of a leaf, except a missing one that has a default."""
        for element in found:
            self.check_leaf(element, *(["type"] if tag == "trans" else []))
        if leaf.field == "children":
            ids = (self._value(each, each.name, each.text, int) for each in found)
            fields[leaf.field] = fields.get(leaf.field, ()) + tuple(each for each in ids if each != NO_CHILD)
        elif leaf.is_id and not (found and found[0].text.strip()):
            element = found[0] if found else parent
            name = found[0].name if found else tag
            message = Message("`{element}` has no `{name}`", element=parent.name, name=name)
            self.warn(element, Code.MISSING_ID, message)
            fields[leaf.field] = 0
        elif found:
            fields[leaf.field] = self._value(found[0], found[0].name, found[0].text, leaf.type)
            if tag == "trans":
                fields["type"] = self._type_of(found[0])
        elif leaf.type is str:
            fields[leaf.field] = ""

    def _type_of(self, trigger: XmlElement) -> str:
        if "type" in trigger.attributes:
            return trigger.attributes["type"]
        kind = "time" if trigger.text.strip().isdecimal() else "condition"
        message = Message("`{element}` has no `type`: its text is read as a condition", element=trigger.name)
        if kind == "time":
            message = Message("`{element}` has no `type`: its text is read as a time", element=trigger.name)
        self.warn(trigger, Code.TRIGGER_WITHOUT_TYPE, message)
        return kind

    def check_leaf(self, element: XmlElement, *known: str) -> None:
        """Warn about attributes and children of an element with a value, which are not kept."""
        if element.attributes.keys() - known:
            message = Message("attributes of `{element}` are lost on saving", element=element.name)
            self.warn(element, Code.LOST_ON_SAVING, message)
        if element.children or element.trailing:
            message = Message(
                "comments and elements inside the text of `{element}` are lost on saving",
                element=element.name,
            )
            self.warn(element, Code.LOST_ON_SAVING, message)

    # Elements of old dialects.

    def translated(
        self,
        element: XmlElement,
        tag: str,
        native: Collection[str],
        names: Mapping[str, str | None],
        nodes: Mapping[str, Translation] | None = None,
    ) -> XmlElement:
        """Return an element of an old dialect in the native format, which `document` can read.

        `names` has the native names of children with a value: blank for a value, None for an element that is
        read elsewhere. Of repeated children the first is used and the others are kept. `nodes` has functions
        that translate children, which may repeat. An unknown child with one of the `native` names is put into
        an element `kept`.
        """
        made = replace(
            element, tag=tag, attributes=dict(element.attributes), children=[], trailing=[*element.trailing]
        )
        seen: dict[str, XmlElement] = {}
        for child in element.children:
            if nodes and child.tag in nodes:
                made.children += nodes[child.tag](child)
            elif child.tag not in names:
                made.children.append(self._without_meaning(child, native))
            else:
                name = names[child.tag]
                first = seen.setdefault(name or child.tag, child)
                if first is not child:
                    message = Message(
                        "a second `{element}` is kept, but the first is used", element=child.name
                    )
                    note = Note(Message("the first is here"), self.place(first))
                    self.warn(child, Code.OLD_REPEATED_ELEMENT, message, note)
                    self.expected.add(child)
                    made.children.append(self._without_meaning(child, native))
                elif name:
                    made.children.append(replace(child, tag=name))
                else:
                    made.trailing += child.comments
                    child.comments = []
                    if name is not None:
                        self.check_leaf(child)
        return made

    def _without_meaning(self, element: XmlElement, native: Collection[str]) -> XmlElement:
        if element.tag not in native:
            return element
        kept = XmlElement(_KEPT, {}, element.line, element.column, children=[element], name=element.name)
        if element in self.expected:
            self.expected.add(kept)
        return kept

    def inline(
        self,
        target: XmlElement,
        around: XmlElement | None,
        native: Collection[str],
        nodes: Mapping[str, Translation],
    ) -> None:
        """Add the content of an element to the enclosing one, translated by `nodes`."""
        if around is not None:
            self.check_leaf(replace(around, children=[], trailing=[]))
            inside = self.translated(around, around.tag, native, {}, nodes)
            target.children += inside.children
            target.trailing += inside.trailing

    # Values.

    def number(self, elements: Sequence[XmlElement], *, expected: bool = True, unique: bool = False) -> None:
        """Set the missing ids of elements of one kind, with a warning if ids are `expected`.

        With `unique`, repeated ids and 0 are replaced, too.
        """
        given = [each for each in elements if each.attributes.get("id", "").strip()]
        for element in given:
            element.attributes["id"] = str(self.parse_id(element, "id", element.attributes["id"]))
        used = {each.attributes["id"] for each in given}
        free = (str(each) for each in count(1) if str(each) not in used)
        first: dict[str, XmlElement] = {}
        for element in elements:
            number = element.attributes.get("id", "").strip()
            known = first.setdefault(number, element)
            if not number:
                element.attributes["id"] = next(free)
                message = Message(
                    "`{element}` has no id: it gets {new}", element=element.name, new=element.attributes["id"]
                )
                if expected:
                    self.warn(element, Code.MISSING_ID, message)
            elif unique and (known is not element or number == "0"):
                element.attributes["id"] = next(free)
                new = element.attributes["id"]
                if element.tag == ANNOTATION.tag:
                    message = Message(
                        "the id {id} of an annotation is not unique: it gets {new}", id=number, new=new
                    )
                else:
                    message = Message(
                        "the id {id} of a transition is not unique: it gets {new}", id=number, new=new
                    )
                if known is element:
                    message = Message(
                        "the id {id} of a transition is less than 1: it gets {new}", id=number, new=new
                    )
                notes = [] if known is element else [Note(Message("the other is here"), self.place(known))]
                self.warn(element, Code.OLD_REPEATED_ID, message, *notes)

    def _value(self, element: XmlElement, name: str, text: str, kind: object) -> Any:  # noqa: ANN401
        if kind is Text:
            return element.content
        if kind is float:
            return self._pixels(element, name, text)
        if kind is bool:
            return self._flag(element, name, text)
        if kind is int:
            return self.parse_id(element, name, text) if text.strip() else 0
        return text

    def parse_id(self, element: XmlElement, name: str, value: str) -> int:
        """Return the id in a text, or report an error."""
        digits = value.strip()
        if digits.isascii() and digits.isdigit() and len(digits) <= 10 and int(digits) <= MAX_ID:
            return int(digits)
        self.error(
            element,
            Code.MALFORMED_ELEMENT,
            Message(
                "`{name}` must be a number from 0 to {limit}, not `{value}`",
                name=name,
                limit=MAX_ID,
                value=value[:40],
            ),
        )
        return 0

    def _pixels(self, element: XmlElement, name: str, text: str) -> float:
        """Return the number in a text, 0 if it is blank."""
        for written in (text.strip() or "0", text.strip().replace(",", ".", 1)):
            with suppress(ValueError):
                number = float(written)
                if math.isfinite(number):
                    if "," in text:
                        message = Message(
                            "`{name}` has a comma: `{text}` is read as {number}",
                            name=name,
                            text=text.strip()[:40],
                            number=number,
                        )
                        self.warn(element, Code.COMMA_IN_NUMBER, message)
                    return number
        message = Message("`{name}` must be a number of pixels, not `{text}`", name=name, text=text[:40])
        self.error(element, Code.MALFORMED_ELEMENT, message)
        return 0.0

    def _flag(self, element: XmlElement, name: str, text: str) -> bool:
        """Return whether a text is true; blank means false."""
        value = text.strip().lower()
        if value not in ("true", "false", "1", "0", ""):
            self.error(
                element,
                Code.MALFORMED_ELEMENT,
                Message("`{name}` must be `true` or `false`, not `{value}`", name=name, value=value[:40]),
            )
        return value in ("true", "1")

    # Reports.

    def place(self, element: XmlElement) -> Location:
        """Return the place of the start tag of an element."""
        return Location(self.path, element.line, element.column, len(element.name) + 1)

    def error(self, element: XmlElement, code: str, message: Message, *notes: Note) -> None:
        """Report an error: the file cannot be read."""
        self.failed = True
        self.diagnostics.error(code, message, self.place(element), notes)

    def warn(self, element: XmlElement, code: str, message: Message, *notes: Note) -> None:
        """Report an ambiguity that was resolved."""
        self.diagnostics.warning(code, message, self.place(element), notes)

    def remark(self, element: XmlElement, message: Message) -> None:
        """Remember an element that is kept but not used."""
        self._remarked.setdefault(message, []).append(element)

    def remark_unknown(self, element: XmlElement) -> None:
        """Remember an unknown element, unless it is empty or expected."""
        if element not in self.expected and (element.text.strip() or element.children or element.attributes):
            self.remark(
                element, Message("`{element}` is unknown: it is kept, but not used", element=element.name)
            )

    def _report_remarks(self) -> None:
        """Report what is kept but not used: each kind once, with all its lines."""
        if self.remarks is None or self.failed:
            return
        for message, (first, *others) in self._remarked.items():
            lines = sorted({element.line for element in others} - {first.line})
            listed = ", ".join(map(str, lines[:_MOST_LINES]))
            where = Message.counted(
                "also in line {listed}", "also in lines {listed}", count=len(lines), listed=listed
            )
            if len(lines) > _MOST_LINES:
                more = len(lines) - _MOST_LINES
                where = Message("also in lines {listed} and {more} more", listed=listed, more=more)
            self.remarks.note(Code.KEPT_UNUSED, message, self.place(first), [Note(where)] if lines else [])
