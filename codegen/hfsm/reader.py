"""Read an automaton document in the native format into the model.

The reader reports what keeps the file from being understood; whether a component can be generated from it is
for `codegen.hfsm.checks` to say.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ..diagnostics import Diagnostics, Location, Note
from .document import (
    DEFAULT_PERIOD,
    NO_CHILD,
    Argument,
    Automaton,
    Comment,
    Document,
    Element,
    Event,
    Extra,
    Import,
    Interface,
    Library,
    Parameter,
    Property,
    State,
    Text,
    Transition,
)
from .xml_tree import MAX_SIZE, XmlElement, parse_xml

__all__ = ["parse_document", "read_document"]

_ROOT_TAGS: Final = ("VisualHFSM", "VisualStates")
_MAX_ID: Final = 2**31 - 1


def read_document(path: Path, diagnostics: Diagnostics) -> Document | None:
    """Return the document in a file, or None after errors were reported."""
    try:
        with path.open("rb") as file:
            content = file.read(MAX_SIZE + 1)
    except OSError as error:
        diagnostics.error("E500", f"cannot be read: {error.strerror or error}", Location(path))
        return None
    return parse_document(content, path, diagnostics)


def parse_document(content: bytes | str, path: Path, diagnostics: Diagnostics) -> Document | None:
    """Return the document in `content`, or None after errors were reported; `path` is for the messages."""
    if isinstance(content, str):
        content = content.encode()
    tree = parse_xml(content, path, diagnostics)
    if tree is None:
        return None
    reader = _Reader(path, diagnostics)
    document = reader.document(*tree)
    return None if reader.failed else document


@dataclass(frozen=True, slots=True)
class _Parts:
    """The children of an element, sorted: known ones by tag, comments before each, and the rest."""

    known: dict[str, list[XmlElement]]
    comments: dict[int, tuple[Comment, ...]]
    extras: tuple[Extra, ...]

    def first(self, tag: str) -> XmlElement | None:
        found = self.known.get(tag)
        return found[0] if found else None

    def comments_before(self, element: XmlElement) -> tuple[Comment, ...]:
        return self.comments.get(id(element), ())


class _Reader:
    def __init__(self, path: Path, diagnostics: Diagnostics) -> None:
        self._path = path
        self._diagnostics = diagnostics
        self.failed = False

    def document(self, root: XmlElement, leading: list[str]) -> Document:
        if root.tag not in _ROOT_TAGS:
            self._error(root, "E504", f"`{root.tag}` is not the root of a document: it is `VisualHFSM`")
        self._refuse_other_dialects(root)
        parts = self._parts(
            root,
            nodes=("SubAutomata",),
            leaves=(
                *("description", "onerror", "language", "parameters", "events", "properties"),
                *("libraries", "config"),
            ),
        )
        parameters = self._container(parts.first("parameters"), "parameter")
        events = self._container(parts.first("events"), "event")
        properties = self._container(parts.first("properties"), "property")
        libraries = self._container(parts.first("libraries"), "lib")
        config = self._container(parts.first("config"), "iceinterface")
        return Document(
            root_tag=root.tag,
            comments=tuple(Comment(text) for text in leading),
            description=_text(parts.first("description")),
            on_error=_text(parts.first("onerror")),
            language=_text(parts.first("language")),
            parameters=self._parameters(parameters, "parameter"),
            events=tuple(
                self._event(element, events.comments_before(element))
                for element in events.known.get("event", ())
            ),
            properties=tuple(
                self._property(element, properties.comments_before(element))
                for element in properties.known.get("property", ())
            ),
            automata=tuple(
                self._automaton(element, parts.comments_before(element))
                for element in parts.known.get("SubAutomata", ())
            ),
            libraries=tuple(
                self._library(element, libraries.comments_before(element))
                for element in libraries.known.get("lib", ())
            ),
            interfaces=tuple(
                self._interface(element, config.comments_before(element))
                for element in config.known.get("iceinterface", ())
            ),
            libraries_extras=libraries.extras,
            config_extras=config.extras,
            extras=parameters.extras + events.extras + properties.extras + parts.extras,
            attributes=tuple(root.attributes.items()),
            line=root.line,
            column=root.column,
        )

    def _refuse_other_dialects(self, root: XmlElement) -> None:
        elements = list(_elements(root))
        spanish = next((e for e in elements if e.tag == "SubAutomata" and "id" not in e.attributes), None)
        if spanish is not None and any(e.tag in ("idSub", "Estado") for e in _elements(spanish)):
            self._error(spanish, "E505", "this is the Spanish format of 2013, which is not read yet")
        nested = next((e for e in elements if e.tag == "state"), None)
        if nested is not None:
            self._error(nested, "E505", "this is VisualStates' format since 2017, which is not read yet")

    def _automaton(self, element: XmlElement, comments: tuple[Comment, ...]) -> Automaton:
        parts = self._parts(
            element,
            nodes=("state", "transition", "input"),
            leaves=("import", "iteration_time", "variables", "functions"),
        )
        return Automaton(
            id=self._id_attribute(element, "id"),
            father=self._id_attribute(element, "idFather", default=NO_CHILD),
            states=tuple(
                self._state(child, parts.comments_before(child)) for child in parts.known.get("state", ())
            ),
            transitions=tuple(
                self._transition(child, parts.comments_before(child))
                for child in parts.known.get("transition", ())
            ),
            inputs=self._parameters(parts, "input"),
            imported=self._import(parts.first("import")),
            iteration_time=_text(parts.first("iteration_time"), default=DEFAULT_PERIOD),
            variables=_text(parts.first("variables")),
            functions=_text(parts.first("functions")),
            comments=comments,
            extras=parts.extras,
            attributes=_other_attributes(element, "id", "idFather"),
            line=element.line,
            column=element.column,
        )

    def _state(self, element: XmlElement, comments: tuple[Comment, ...]) -> State:
        leaves = ("posx", "posy", "name", "idSubautomataSon", "final", "history", "entry", "code", "exit")
        parts = self._parts(element, nodes=("child", "argument"), leaves=leaves)
        return State(
            id=self._id_attribute(element, "id"),
            name=_text(parts.first("name")).text,
            initial=self._flag(element, "initial"),
            x=self._number(parts.first("posx")),
            y=self._number(parts.first("posy")),
            children=self._children(element, parts),
            final=self._is_final(parts.first("final")),
            history=_text(parts.first("history")),
            entry=_text(parts.first("entry")),
            code=_text(parts.first("code")),
            exit=_text(parts.first("exit")),
            arguments=tuple(
                self._argument(child, parts.comments_before(child))
                for child in parts.known.get("argument", ())
            ),
            comments=comments,
            extras=parts.extras,
            attributes=_other_attributes(element, "id", "initial"),
            line=element.line,
            column=element.column,
        )

    def _transition(self, element: XmlElement, comments: tuple[Comment, ...]) -> Transition:
        leaves = ("posx", "posy", "origin", "destiny", "transcode", "name", "trans", "guard", "priority")
        parts = self._parts(element, leaves=leaves)
        trigger = parts.first("trans")
        if trigger is None:
            self._error(element, "E506", 'a transition needs `<trans type="time">` or `type="condition"`')
        elif "type" not in trigger.attributes:
            self._error(trigger, "E506", '`trans` needs the attribute `type`: "time" or "condition"')
        return Transition(
            id=self._id_attribute(element, "id"),
            name=_text(parts.first("name")).text,
            x=self._number(parts.first("posx")),
            y=self._number(parts.first("posy")),
            origin=self._id(element, parts.first("origin"), "origin"),
            destination=self._id(element, parts.first("destiny"), "destiny"),
            type="" if trigger is None else trigger.attributes.get("type", ""),
            trigger=_text(trigger),
            guard=_text(parts.first("guard")),
            priority=_text(parts.first("priority")),
            code=_text(parts.first("transcode")),
            comments=comments,
            extras=parts.extras,
            attributes=_other_attributes(element, "id"),
            line=element.line,
            column=element.column,
        )

    def _children(self, element: XmlElement, parts: _Parts) -> tuple[int, ...]:
        """Return the automata of a state: the one that the origin knows, then the further ones."""
        first = self._id(element, parts.first("idSubautomataSon"), "idSubautomataSon", default=NO_CHILD)
        further = (self._parse_id(child, "child", child.text) for child in parts.known.get("child", ()))
        return tuple(child for child in (first, *further) if child != NO_CHILD)

    def _is_final(self, element: XmlElement | None) -> bool:
        return element is not None and self._parse_flag(element, "final", element.text)

    def _argument(self, element: XmlElement, comments: tuple[Comment, ...]) -> Argument:
        return Argument(
            name=self._attribute(element, "name"),
            child=self._id_attribute(element, "child", default=NO_CHILD),
            value=_text(element),
            comments=comments,
            extras=self._parts(element).extras,
            attributes=_other_attributes(element, "name", "child"),
            line=element.line,
            column=element.column,
        )

    def _parameters(self, container: _Parts, tag: str) -> tuple[Parameter, ...]:
        return tuple(
            self._parameter(element, container.comments_before(element))
            for element in container.known.get(tag, ())
        )

    def _parameter(self, element: XmlElement, comments: tuple[Comment, ...]) -> Parameter:
        parts = self._parts(element, leaves=("name", "type", "default", "description"))
        return Parameter(
            name=_text(parts.first("name")).text,
            type=_text(parts.first("type")),
            default=_text(parts.first("default")),
            description=_text(parts.first("description")),
            comments=comments,
            extras=parts.extras,
            attributes=tuple(element.attributes.items()),
            line=element.line,
            column=element.column,
        )

    def _import(self, element: XmlElement | None) -> Import | None:
        if element is None:
            return None
        return Import(
            file=_text(element),
            automaton=self._id_attribute(element, "automaton", default=NO_CHILD),
            extras=self._parts(element).extras,
            attributes=_other_attributes(element, "automaton"),
            line=element.line,
            column=element.column,
        )

    def _event(self, element: XmlElement, comments: tuple[Comment, ...]) -> Event:
        parts = self._parts(element, leaves=("name", "description"))
        return Event(
            name=_text(parts.first("name")).text,
            description=_text(parts.first("description")),
            comments=comments,
            extras=parts.extras,
            attributes=tuple(element.attributes.items()),
            line=element.line,
            column=element.column,
        )

    def _property(self, element: XmlElement, comments: tuple[Comment, ...]) -> Property:
        parts = self._parts(element, leaves=("name", "within", "expression"))
        return Property(
            name=_text(parts.first("name")).text,
            kind=self._attribute(element, "kind"),
            within=_text(parts.first("within")),
            expression=_text(parts.first("expression")),
            comments=comments,
            extras=parts.extras,
            attributes=_other_attributes(element, "kind"),
            line=element.line,
            column=element.column,
        )

    def _library(self, element: XmlElement, comments: tuple[Comment, ...]) -> Library:
        return Library(
            name=_text(element),
            comments=comments,
            extras=self._parts(element).extras,
            attributes=tuple(element.attributes.items()),
            line=element.line,
            column=element.column,
        )

    def _interface(self, element: XmlElement, comments: tuple[Comment, ...]) -> Interface:
        parts = self._parts(element, leaves=("nameinterface", "nameproxy", "ip", "port", "interface"))
        proxy, ip, port = (parts.first(tag) for tag in ("nameproxy", "ip", "port"))
        return Interface(
            name=_text(parts.first("nameinterface")).text,
            proxy=None if proxy is None else proxy.text,
            ip=None if ip is None else ip.text,
            port=None if port is None else port.text,
            type=_text(parts.first("interface")).text,
            comments=comments,
            extras=parts.extras,
            attributes=tuple(element.attributes.items()),
            line=element.line,
            column=element.column,
        )

    def _container(self, element: XmlElement | None, tag: str) -> _Parts:
        return _Parts({}, {}, ()) if element is None else self._parts(element, nodes=(tag,))

    def _parts(
        self, element: XmlElement, nodes: tuple[str, ...] = (), leaves: tuple[str, ...] = ()
    ) -> _Parts:
        """Sort the children of an element; a second leaf of one tag is an error.

        A comment belongs to the node that follows it; in front of anything else it is an extra.
        """
        known: dict[str, list[XmlElement]] = {}
        comments: dict[int, tuple[Comment, ...]] = {}
        extras: list[Extra] = []
        pending: list[Comment] = []
        for child in element.children:
            if isinstance(child, str):
                pending.append(Comment(child))
                continue
            if child.tag in nodes:
                comments[id(child)] = tuple(pending)
                known.setdefault(child.tag, []).append(child)
            else:
                extras += pending
                if child.tag not in leaves:
                    extras.append(_extra(child))
                elif child.tag in known:
                    first = Note("the first is here", self._place(known[child.tag][0]))
                    self._error(child, "E507", f"a second `{child.tag}` in `{element.tag}`", first)
                else:
                    known[child.tag] = [child]
                    self._warn_of_loss(child)
            pending.clear()
        extras += pending
        return _Parts(known, comments, tuple(extras))

    def _warn_of_loss(self, leaf: XmlElement) -> None:
        """Tell what a leaf holds beside its text, which the model does not keep."""
        if leaf.tag in ("libraries", "config", "parameters", "events", "properties"):
            return
        known = {("trans", "type"), ("import", "automaton")}
        unknown = [name for name in leaf.attributes if (leaf.tag, name) not in known]
        if unknown or leaf.children:
            what = f"attribute `{unknown[0]}`" if unknown else "elements and comments inside it"
            message = f"`{leaf.tag}` has only text: {what} would be lost on saving"
            self._diagnostics.warning("W501", message, self._place(leaf))

    def _attribute(self, element: XmlElement, name: str) -> str:
        if name not in element.attributes:
            self._error(element, "E506", f"`{element.tag}` needs the attribute `{name}`")
        return element.attributes.get(name, "")

    def _id_attribute(self, element: XmlElement, name: str, default: int | None = None) -> int:
        value = element.attributes.get(name)
        if value is None:
            if default is None:
                self._error(element, "E506", f"`{element.tag}` needs the attribute `{name}`")
            return default or 0
        return self._parse_id(element, name, value)

    def _id(
        self, parent: XmlElement, element: XmlElement | None, name: str, default: int | None = None
    ) -> int:
        if element is None:
            if default is None:
                self._error(parent, "E506", f"`{parent.tag}` needs `<{name}>`")
            return default or 0
        return self._parse_id(element, name, element.text)

    def _parse_id(self, element: XmlElement, name: str, value: str) -> int:
        digits = value.strip()
        if digits.isascii() and digits.isdigit() and len(digits) <= 10 and int(digits) <= _MAX_ID:
            return int(digits)
        self._error(element, "E506", f"`{name}` is a number from 0 to {_MAX_ID}, not `{value[:40]}`")
        return 0

    def _number(self, element: XmlElement | None) -> float:
        if element is None or not element.text.strip():
            return 0.0
        try:
            number = float(element.text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            self._error(element, "E506", f"`{element.tag}` is a number of pixels, not `{element.text[:40]}`")
            return 0.0
        return number

    def _flag(self, element: XmlElement, name: str) -> bool:
        return self._parse_flag(element, name, element.attributes.get(name, "false"))

    def _parse_flag(self, element: XmlElement, name: str, text: str) -> bool:
        value = text.strip().lower()
        if value not in ("true", "false", "1", "0"):
            self._error(element, "E506", f"`{name}` is `true` or `false`, not `{value[:40]}`")
        return value in ("true", "1")

    def _place(self, element: XmlElement) -> Location:
        return Location(self._path, element.line, element.column, len(element.tag) + 1)

    def _error(self, element: XmlElement, code: str, message: str, *notes: Note) -> None:
        self.failed = True
        self._diagnostics.error(code, message, self._place(element), notes)


def _elements(element: XmlElement) -> Iterator[XmlElement]:
    return (child for child in element.children if isinstance(child, XmlElement))


def _text(element: XmlElement | None, default: str = "") -> Text:
    if element is None:
        return Text(default)
    return Text(element.text, element.text_line, element.text_column)


def _other_attributes(element: XmlElement, *known: str) -> tuple[tuple[str, str], ...]:
    return tuple((name, value) for name, value in element.attributes.items() if name not in known)


def _extra(element: XmlElement) -> Element:
    """Return an unknown element; the white space by which its children were indented is not kept."""
    children = tuple(Comment(c) if isinstance(c, str) else _extra(c) for c in element.children)
    text = "" if children and not element.text.strip() else element.text
    return Element(element.tag, tuple(element.attributes.items()), text, children)
