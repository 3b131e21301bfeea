"""Write an automaton document in the native format: stable order and indentation, code byte for byte."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from typing import Final

from ..document import (
    NO_CHILD,
    Argument,
    Automaton,
    Comment,
    Document,
    Event,
    Extra,
    Import,
    Interface,
    Leaf,
    Library,
    Node,
    Parameter,
    Property,
    State,
    Text,
    Transition,
)

__all__ = [
    "INDENT",
    "UNWRITABLE",
    "DocumentNotWritableError",
    "attributes_text",
    "escaped",
    "is_writable",
    "lines_of",
    "write_document",
]

INDENT: Final = "  "
"""Indentation of one level."""

UNWRITABLE: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot hold, not even as a reference."""

_TEXT_ESCAPES: Final = {"&": "&amp;", "<": "&lt;", ">": "&gt;", "\r": "&#13;"}
_ATTRIBUTE_ESCAPES: Final = {**_TEXT_ESCAPES, '"': "&quot;", "\n": "&#10;", "\t": "&#9;"}


class DocumentNotWritableError(ValueError):
    """A text of the document holds a character that XML cannot hold."""


def lines_of(extra: Extra, depth: int = 0) -> Iterator[str]:
    """Yield the lines of an element or a comment, indented by `depth` levels.

    Raises DocumentNotWritableError.
    """
    indent = INDENT * depth
    if isinstance(extra, Comment):
        if "--" in extra.text or extra.text.endswith("-"):
            raise DocumentNotWritableError("a comment cannot hold `--` or end with `-`")
        yield f"{indent}<!--{_checked(extra.text)}-->"
        return
    start = f"{indent}<{extra.tag}{attributes_text(extra.attributes)}"
    if not extra.children:
        yield f"{start}>{escaped(extra.text)}</{extra.tag}>" if extra.text else f"{start}/>"
        return
    yield f"{start}>"
    for child in extra.children:
        yield from lines_of(child, depth + 1)
    yield f"{indent}</{extra.tag}>"


def attributes_text(attributes: tuple[tuple[str, str], ...]) -> str:
    """Return the attributes of a start tag, each with a blank before it."""
    return "".join(
        f' {name}="{"".join(_ATTRIBUTE_ESCAPES.get(c, c) for c in _checked(value))}"'
        for name, value in attributes
    )


def escaped(text: str) -> str:
    """Return a text as it stands in XML."""
    return "".join(_TEXT_ESCAPES.get(character, character) for character in _checked(text))


def is_writable(text: str) -> bool:
    """Return whether XML can hold a text."""
    return not UNWRITABLE.search(text)


def _checked(text: str) -> str:
    found = UNWRITABLE.search(text)
    if found:
        raise DocumentNotWritableError(f"XML cannot hold the character {found.group()!r} in `{text[:40]!r}`")
    return text


def write_document(document: Document) -> str:
    """Return the document as a file's text, which ends with a newline.

    Raises DocumentNotWritableError.
    """
    return _Writer().document(document)


class _Writer:
    def __init__(self) -> None:
        self._lines: list[str] = ['<?xml version="1.0" encoding="UTF-8"?>']
        self._depth = 0
        self._leaves: list[dict[str, Leaf]] = []
        """What the leaves of the elements that are open have beside their text."""

    def document(self, document: Document) -> str:
        self._open(document.root_tag, document)
        self._optional("description", document.description)
        self._optional("onerror", document.on_error)
        self._optional("onrefused", document.on_refused)
        self._optional("dialect", document.dialect)
        self._optional("language", document.language)
        self._list(
            "parameters", [partial(self._parameter, "parameter", each) for each in document.parameters]
        )
        self._list("events", [partial(self._event, event) for event in document.events])
        self._list("properties", [partial(self._property, each) for each in document.properties])
        for automaton in document.automata:
            self._automaton(automaton)
        libraries = [partial(self._library, library) for library in document.libraries]
        self._list("libraries", libraries, document.libraries_extras, always=True)
        interfaces = [partial(self._interface, interface) for interface in document.interfaces]
        self._list("config", interfaces, document.config_extras, always=True)
        self._close(document.root_tag, document)
        return "\n".join(self._lines) + "\n"

    def _automaton(self, automaton: Automaton) -> None:
        self._open("SubAutomata", automaton, (("id", str(automaton.id)), ("idFather", str(automaton.father))))
        for state in automaton.states:
            self._state(state)
        for transition in automaton.transitions:
            self._transition(transition)
        for item in automaton.inputs:
            self._parameter("input", item)
        if automaton.imported is not None:
            self._import(automaton.imported)
        self._leaf("iteration_time", automaton.iteration_time)
        self._leaf("variables", automaton.variables)
        self._leaf("functions", automaton.functions)
        self._close("SubAutomata", automaton)

    def _state(self, state: State) -> None:
        initial = "true" if state.initial else "false"
        self._open("state", state, (("initial", initial), ("id", str(state.id))))
        self._leaf("posx", _number(state.x))
        self._leaf("posy", _number(state.y))
        self._leaf("name", state.name)
        self._leaf("idSubautomataSon", str(state.children[0] if state.children else NO_CHILD))
        for child in state.children[1:]:
            self._leaf("child", str(child))
        if state.final or "final" in self._leaves[-1]:
            self._leaf("final", "true" if state.final else "false")
        self._optional("history", state.history)
        self._optional("entry", state.entry)
        self._leaf("code", state.code)
        self._optional("exit", state.exit)
        for argument in state.arguments:
            self._argument(argument)
        self._close("state", state)

    def _transition(self, transition: Transition) -> None:
        self._open("transition", transition, (("id", str(transition.id)),))
        self._leaf("posx", _number(transition.x))
        self._leaf("posy", _number(transition.y))
        self._leaf("origin", str(transition.origin))
        self._leaf("destiny", str(transition.destination))
        self._leaf("transcode", transition.code)
        self._leaf("name", transition.name)
        self._leaf("trans", transition.trigger, (("type", transition.type),))
        self._optional("guard", transition.guard)
        self._optional("priority", transition.priority)
        self._close("transition", transition)

    def _argument(self, argument: Argument) -> None:
        child = () if argument.child == NO_CHILD else (("child", str(argument.child)),)
        if argument.extras:
            raise DocumentNotWritableError(f"the argument `{argument.name}` holds only text")
        self._text_node("argument", argument, argument.value, (("name", argument.name), *child))

    def _import(self, imported: Import) -> None:
        automaton = () if imported.automaton == NO_CHILD else (("automaton", str(imported.automaton)),)
        self._leaf("import", imported.file, automaton + imported.attributes)

    def _library(self, library: Library) -> None:
        kind = () if library.kind == "module" else (("kind", library.kind),)
        self._text_node("lib", library, library.name, kind)

    def _text_node(
        self, tag: str, node: Argument | Library, text: Text, attributes: tuple[tuple[str, str], ...]
    ) -> None:
        self._extras(node.comments)
        self._leaves.append({leaf.tag: leaf for leaf in node.leaves})
        self._leaf(tag, text, attributes + node.attributes)
        self._leaves.pop()

    def _parameter(self, tag: str, parameter: Parameter) -> None:
        self._open(tag, parameter)
        self._leaf("name", parameter.name)
        self._leaf("type", parameter.type)
        self._optional("default", parameter.default)
        self._optional("description", parameter.description)
        self._close(tag, parameter)

    def _event(self, event: Event) -> None:
        self._open("event", event)
        self._leaf("name", event.name)
        self._optional("description", event.description)
        self._close("event", event)

    def _property(self, item: Property) -> None:
        self._open("property", item, (("kind", item.kind),))
        self._leaf("name", item.name)
        self._optional("within", item.within)
        self._leaf("expression", item.expression)
        self._close("property", item)

    def _interface(self, interface: Interface) -> None:
        self._open("iceinterface", interface)
        self._leaf("nameinterface", interface.name)
        for tag, value in (("nameproxy", interface.proxy), ("ip", interface.ip), ("port", interface.port)):
            if value is not None:
                self._leaf(tag, value)
        self._leaf("interface", interface.type)
        self._close("iceinterface", interface)

    def _list(
        self,
        tag: str,
        items: list[partial[None]],
        extras: tuple[Extra, ...] = (),
        *,
        always: bool = False,
    ) -> None:
        """Write a list of the document, if it is not empty or `always` there."""
        leaf = self._leaves[-1].get(tag, Leaf(tag))
        extras += leaf.children
        self._extras(leaf.comments)
        if not items and not extras:
            if always or leaf.comments or leaf.attributes:
                self._line(f"<{tag}{attributes_text(leaf.attributes)}/>")
            return
        self._line(f"<{tag}{attributes_text(leaf.attributes)}>")
        self._depth += 1
        for write in items:
            write()
        self._extras(extras)
        self._depth -= 1
        self._line(f"</{tag}>")

    def _optional(self, tag: str, text: Text | str) -> None:
        if (text if isinstance(text, str) else text.text) or tag in self._leaves[-1]:
            self._leaf(tag, text)

    def _leaf(self, tag: str, text: Text | str, attributes: tuple[tuple[str, str], ...] = ()) -> None:
        """Write an element that holds a text, with what else it has."""
        leaf = self._leaves[-1].get(tag, Leaf(tag))
        self._extras(leaf.comments)
        content = escaped(text if isinstance(text, str) else text.text)
        self._line(f"<{tag}{attributes_text(attributes + leaf.attributes)}>{content}</{tag}>")

    def _open(self, tag: str, node: Node, attributes: tuple[tuple[str, str], ...] = ()) -> None:
        """Write the comments before an element of the model and its start."""
        self._extras(node.comments)
        self._line(f"<{tag}{attributes_text(attributes + node.attributes)}>")
        self._leaves.append({leaf.tag: leaf for leaf in node.leaves})
        self._depth += 1

    def _close(self, tag: str, node: Node) -> None:
        """Write what is unknown in an element of the model, and its end."""
        self._extras(node.extras)
        self._leaves.pop()
        self._depth -= 1
        self._line(f"</{tag}>")

    def _extras(self, extras: tuple[Extra, ...]) -> None:
        for extra in extras:
            self._lines += lines_of(extra, self._depth)

    def _line(self, text: str) -> None:
        self._lines.append(INDENT * self._depth + text)


def _number(value: float) -> str:
    return str(int(value)) if value.is_integer() else repr(value)
