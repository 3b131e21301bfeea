"""Write an automaton document in the native format: stable order and indentation, code byte for byte."""

from __future__ import annotations

import re
from typing import Final

from .document import (
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

__all__ = ["DocumentNotWritableError", "write_document"]

_INDENT: Final = "  "
# What XML 1.0 cannot hold, not even as a reference.
_UNWRITABLE: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_TEXT_ESCAPES: Final = {"&": "&amp;", "<": "&lt;", ">": "&gt;", "\r": "&#13;"}
_ATTRIBUTE_ESCAPES: Final = {**_TEXT_ESCAPES, '"': "&quot;", "\n": "&#10;", "\t": "&#9;"}


class DocumentNotWritableError(ValueError):
    """A text of the document holds a character that XML cannot hold."""


def write_document(document: Document) -> str:
    """Return the document as a file's text, which ends with a newline.

    Raises DocumentNotWritableError.
    """
    return _Writer().document(document)


class _Writer:
    def __init__(self) -> None:
        self._lines: list[str] = ['<?xml version="1.0" encoding="UTF-8"?>']
        self._depth = 0

    def document(self, document: Document) -> str:
        self._comments(document.comments)
        self._open(document.root_tag, document.attributes)
        if document.description.text:
            self._leaf("description", document.description)
        if document.on_error.text:
            self._leaf("onerror", document.on_error)
        if document.language.text:
            self._leaf("language", document.language)
        self._parameters(document)
        self._events(document)
        self._properties(document)
        for automaton in document.automata:
            self._automaton(automaton)
        self._libraries(document)
        self._config(document)
        self._extras(document.extras)
        self._close(document.root_tag)
        return "\n".join(self._lines) + "\n"

    def _automaton(self, automaton: Automaton) -> None:
        self._comments(automaton.comments)
        ids = (("id", str(automaton.id)), ("idFather", str(automaton.father)))
        self._open("SubAutomata", ids + automaton.attributes)
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
        self._extras(automaton.extras)
        self._close("SubAutomata")

    def _state(self, state: State) -> None:
        self._comments(state.comments)
        initial = "true" if state.initial else "false"
        self._open("state", (("initial", initial), ("id", str(state.id)), *state.attributes))
        self._leaf("posx", _number(state.x))
        self._leaf("posy", _number(state.y))
        self._leaf("name", state.name)
        self._leaf("idSubautomataSon", str(state.children[0] if state.children else NO_CHILD))
        for child in state.children[1:]:
            self._leaf("child", str(child))
        if state.final:
            self._leaf("final", "true")
        self._optional("history", state.history)
        self._optional("entry", state.entry)
        self._leaf("code", state.code)
        self._optional("exit", state.exit)
        for argument in state.arguments:
            self._argument(argument)
        self._extras(state.extras)
        self._close("state")

    def _transition(self, transition: Transition) -> None:
        self._comments(transition.comments)
        self._open("transition", (("id", str(transition.id)), *transition.attributes))
        self._leaf("posx", _number(transition.x))
        self._leaf("posy", _number(transition.y))
        self._leaf("origin", str(transition.origin))
        self._leaf("destiny", str(transition.destination))
        self._leaf("transcode", transition.code)
        self._leaf("name", transition.name)
        self._leaf("trans", transition.trigger, (("type", transition.type),))
        self._optional("guard", transition.guard)
        self._optional("priority", transition.priority)
        self._extras(transition.extras)
        self._close("transition")

    def _argument(self, argument: Argument) -> None:
        self._comments(argument.comments)
        child = () if argument.child == NO_CHILD else (("child", str(argument.child)),)
        if argument.extras:
            raise DocumentNotWritableError(f"the argument `{argument.name}` holds only text")
        self._leaf("argument", argument.value, (("name", argument.name), *child, *argument.attributes))

    def _parameters(self, document: Document) -> None:
        if document.parameters:
            self._open("parameters")
            for parameter in document.parameters:
                self._parameter("parameter", parameter)
            self._close("parameters")

    def _parameter(self, tag: str, parameter: Parameter) -> None:
        self._comments(parameter.comments)
        self._open(tag, parameter.attributes)
        self._leaf("name", parameter.name)
        self._leaf("type", parameter.type)
        self._optional("default", parameter.default)
        self._optional("description", parameter.description)
        self._extras(parameter.extras)
        self._close(tag)

    def _import(self, imported: Import) -> None:
        automaton = () if imported.automaton == NO_CHILD else (("automaton", str(imported.automaton)),)
        self._leaf("import", imported.file, automaton + imported.attributes)

    def _events(self, document: Document) -> None:
        if document.events:
            self._open("events")
            for event in document.events:
                self._event(event)
            self._close("events")

    def _event(self, event: Event) -> None:
        self._comments(event.comments)
        self._open("event", event.attributes)
        self._leaf("name", event.name)
        self._optional("description", event.description)
        self._extras(event.extras)
        self._close("event")

    def _properties(self, document: Document) -> None:
        if document.properties:
            self._open("properties")
            for item in document.properties:
                self._property(item)
            self._close("properties")

    def _property(self, item: Property) -> None:
        self._comments(item.comments)
        self._open("property", (("kind", item.kind), *item.attributes))
        self._leaf("name", item.name)
        self._optional("within", item.within)
        self._leaf("expression", item.expression)
        self._extras(item.extras)
        self._close("property")

    def _optional(self, tag: str, text: Text) -> None:
        if text.text:
            self._leaf(tag, text)

    def _libraries(self, document: Document) -> None:
        if not document.libraries and not document.libraries_extras:
            self._line("<libraries/>")
            return
        self._open("libraries")
        for library in document.libraries:
            self._library(library)
        self._extras(document.libraries_extras)
        self._close("libraries")

    def _library(self, library: Library) -> None:
        self._comments(library.comments)
        if not library.extras:
            self._leaf("lib", library.name, library.attributes)
            return
        self._extra(Element("lib", library.attributes, library.name.text, library.extras))

    def _config(self, document: Document) -> None:
        if not document.interfaces and not document.config_extras:
            self._line("<config/>")
            return
        self._open("config")
        for interface in document.interfaces:
            self._interface(interface)
        self._extras(document.config_extras)
        self._close("config")

    def _interface(self, interface: Interface) -> None:
        self._comments(interface.comments)
        self._open("iceinterface", interface.attributes)
        self._leaf("nameinterface", interface.name)
        for tag, value in (("nameproxy", interface.proxy), ("ip", interface.ip), ("port", interface.port)):
            if value is not None:
                self._leaf(tag, value)
        self._leaf("interface", interface.type)
        self._extras(interface.extras)
        self._close("iceinterface")

    def _comments(self, comments: tuple[Comment, ...]) -> None:
        self._extras(comments)

    def _extras(self, extras: tuple[Extra, ...]) -> None:
        for extra in extras:
            self._extra(extra)

    def _extra(self, extra: Extra) -> None:
        if isinstance(extra, Comment):
            if "--" in extra.text or extra.text.endswith("-"):
                raise DocumentNotWritableError("a comment cannot hold `--` or end with `-`")
            self._line(f"<!--{_checked(extra.text)}-->")
        elif extra.children and not extra.text:
            self._open(extra.tag, extra.attributes)
            self._extras(extra.children)
            self._close(extra.tag)
        elif extra.children:
            # Text and elements side by side: indentation would become part of the text.
            self._line(_inline(extra))
        elif extra.text:
            self._leaf(extra.tag, extra.text, extra.attributes)
        else:
            self._line(f"<{extra.tag}{_attributes(extra.attributes)}/>")

    def _open(self, tag: str, attributes: tuple[tuple[str, str], ...] = ()) -> None:
        self._line(f"<{tag}{_attributes(attributes)}>")
        self._depth += 1

    def _close(self, tag: str) -> None:
        self._depth -= 1
        self._line(f"</{tag}>")

    def _leaf(self, tag: str, text: Text | str, attributes: tuple[tuple[str, str], ...] = ()) -> None:
        content = text if isinstance(text, str) else text.text
        self._line(f"<{tag}{_attributes(attributes)}>{_escaped(content)}</{tag}>")

    def _line(self, text: str) -> None:
        self._lines.append(_INDENT * self._depth + text)


def _number(value: float) -> str:
    return str(int(value)) if value.is_integer() else repr(value)


def _inline(extra: Extra) -> str:
    if isinstance(extra, Comment):
        return f"<!--{_checked(extra.text)}-->"
    content = _escaped(extra.text) + "".join(_inline(child) for child in extra.children)
    return f"<{extra.tag}{_attributes(extra.attributes)}>{content}</{extra.tag}>"


def _attributes(attributes: tuple[tuple[str, str], ...]) -> str:
    return "".join(
        f' {name}="{"".join(_ATTRIBUTE_ESCAPES.get(c, c) for c in _checked(value))}"'
        for name, value in attributes
    )


def _escaped(text: str) -> str:
    return "".join(_TEXT_ESCAPES.get(character, character) for character in _checked(text))


def _checked(text: str) -> str:
    found = _UNWRITABLE.search(text)
    if found:
        raise DocumentNotWritableError(f"XML cannot hold the character {found.group()!r} in `{text[:40]!r}`")
    return text
