"""Commands for the data of a document: texts, and lists of parameters, events, properties and the like.

An entry of a list is named by the list and its index.
"""

# ruff: noqa: D102, ARG002 - `Command` says what its methods do, and with what

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any, Final, Literal, TypeVar

from codegen.hfsm.document import (
    NO_CHILD,
    Automaton,
    Document,
    Event,
    Interface,
    Library,
    Node,
    Parameter,
    Property,
    State,
    Text,
)

from ..errors import EditError
from ..nodes import changed, find_automaton, free_name, with_automaton
from .base import Command, Id, Index

__all__ = [
    "AddEvent",
    "AddInterface",
    "AddLibrary",
    "AddParameter",
    "AddProperty",
    "ChangeEvent",
    "ChangeInterface",
    "ChangeLibrary",
    "ChangeParameter",
    "ChangeProperty",
    "RemoveEntry",
    "ReorderEntry",
    "SetComponentText",
]

_T = TypeVar("_T")
ListName = Literal["parameters", "events", "properties", "libraries", "interfaces", "inputs"]

_NOUNS: Final[dict[str, str]] = {
    "parameters": "parameter",
    "events": "event",
    "properties": "property",
    "libraries": "library",
    "interfaces": "interface",
    "inputs": "input",
}
_FIELDS: Final[dict[str, tuple[str, str]]] = {
    "description": ("description", "description"),
    "onError": ("on_error", "behavior after errors"),
    "onRefused": ("on_refused", "behavior after refused commands"),
    "language": ("language", "language"),
}
"""For each part the field of the document, and what it is called in the list of changes."""


class SetComponentText(Command, frozen=True, kw_only=True):
    """Set what a component is for, its language, or what follows an error or a refused command."""

    part: Literal["description", "onError", "onRefused", "language"]
    text: str

    def apply(self, document: Document) -> Document:
        return changed(document, **{_FIELDS[self.part][0]: self.text})

    def title(self, document: Document) -> str:
        return f"Set the {_FIELDS[self.part][1]}"

    @property
    def merge_key(self) -> Hashable:
        return type(self), self.part


class _AddCommand(Command, frozen=True, kw_only=True):
    def entry(self, document: Document) -> Node:
        raise NotImplementedError

    def list_name(self) -> str:
        raise NotImplementedError

    def apply(self, document: Document) -> Document:
        entries = (*getattr(document, self.list_name()), self.entry(document))
        return changed(document, **{self.list_name(): entries})

    def title(self, document: Document) -> str:
        return f"Add {_with_article(_NOUNS[self.list_name()])}"


class _ChangeCommand(Command, frozen=True, kw_only=True):
    index: Index

    def list_name(self) -> str:
        raise NotImplementedError

    def apply(self, document: Document) -> Document:
        fields = {
            name: getattr(self, name)
            for name in self.__struct_fields__
            if name not in ("index", "automaton") and getattr(self, name) is not None
        }
        return _with_entry(document, self.list_name(), self.index, lambda entry: changed(entry, **fields))

    def title(self, document: Document) -> str:
        return f"Change {_with_article(_NOUNS[self.list_name()])}"

    @property
    def merge_key(self) -> Hashable:
        given = tuple(name for name in self.__struct_fields__ if getattr(self, name) is not None)
        return type(self), self.index, given, getattr(self, "automaton", None)


class AddParameter(_AddCommand, frozen=True, kw_only=True):
    """Add a parameter to the component, or an input to an automaton when one is named."""

    automaton: Id = NO_CHILD
    name: str = ""
    type: str = "float"
    default: str = "0.0"
    description: str = ""

    def list_name(self) -> str:
        return "parameters" if self.automaton == NO_CHILD else "inputs"

    def entry(self, document: Document) -> Node:
        raise NotImplementedError

    def apply(self, document: Document) -> Document:
        if self.automaton == NO_CHILD:
            return replace(document, parameters=(*document.parameters, self._made(document.parameters)))

        def add(automaton: Automaton) -> Automaton:
            if automaton.imported is not None:
                why = "its content comes from another file"
                raise EditError("Cannot add an input", why, "change that file, or inline it first")
            return replace(automaton, inputs=(*automaton.inputs, self._made(automaton.inputs)))

        return with_automaton(document, self.automaton, add)

    def _made(self, others: tuple[Parameter, ...]) -> Parameter:
        noun = _NOUNS[self.list_name()]
        name = self.name or free_name(noun, {other.name for other in others}, "_")
        return changed(
            Parameter(name=""), name=name, type=self.type, default=self.default, description=self.description
        )


class ChangeParameter(_ChangeCommand, frozen=True, kw_only=True):
    """Change a parameter of the component, or an input of an automaton, by its index.

    When an input gets another name, so do the arguments by which states hand it over.
    """

    automaton: Id = NO_CHILD
    name: str | None = None
    type: str | None = None
    default: str | None = None
    description: str | None = None

    def list_name(self) -> str:
        return "parameters" if self.automaton == NO_CHILD else "inputs"

    def apply(self, document: Document) -> Document:
        if self.automaton == NO_CHILD:
            return super().apply(document)
        fields = {
            name: value
            for name in ("name", "type", "default", "description")
            if (value := getattr(self, name)) is not None
        }
        former = _entry_of(find_automaton(document, self.automaton).inputs, "inputs", self.index)
        document = with_automaton(
            document,
            self.automaton,
            lambda automaton: changed(
                automaton, inputs=_exchanged(automaton.inputs, self.index, changed(former, **fields))
            ),
        )
        if self.name is None or self.name == former.name:
            return document
        return _with_renamed_arguments(document, self.automaton, former.name, self.name)


class AddEvent(_AddCommand, frozen=True, kw_only=True):
    """Declare an event that may come from outside."""

    name: str = ""
    description: str = ""

    def list_name(self) -> str:
        return "events"

    def entry(self, document: Document) -> Node:
        name = self.name or free_name("event", {event.name for event in document.events})
        return changed(Event(name=""), name=name, description=self.description)


class ChangeEvent(_ChangeCommand, frozen=True, kw_only=True):
    """Change an event, by its index."""

    name: str | None = None
    description: str | None = None

    def list_name(self) -> str:
        return "events"


class AddProperty(_AddCommand, frozen=True, kw_only=True):
    """Add what the model checker is to prove."""

    name: str = ""
    kind: Literal["always", "eventually", "never"] = "always"
    within: str = ""
    expression: str = ""

    def list_name(self) -> str:
        return "properties"

    def entry(self, document: Document) -> Node:
        name = self.name or free_name("property", {each.name for each in document.properties})
        return changed(Property(), name=name, kind=self.kind, within=self.within, expression=self.expression)


class ChangeProperty(_ChangeCommand, frozen=True, kw_only=True):
    """Change a property, by its index."""

    name: str | None = None
    kind: Literal["always", "eventually", "never"] | None = None
    within: str | None = None
    expression: str | None = None

    def list_name(self) -> str:
        return "properties"


class AddLibrary(_AddCommand, frozen=True, kw_only=True):
    """Import a library into the code: `cv2`, `numpy as np`, `from math import pi`."""

    name: str

    def list_name(self) -> str:
        return "libraries"

    def entry(self, document: Document) -> Node:
        return changed(Library(name=Text()), name=self.name)


class ChangeLibrary(_ChangeCommand, frozen=True, kw_only=True):
    """Change a library, by its index."""

    name: str | None = None

    def list_name(self) -> str:
        return "libraries"


class AddInterface(_AddCommand, frozen=True, kw_only=True):
    """Use a servant: `self.NAME` is the proxy of the servant `proxy`, which has the IDL interface `type`."""

    name: str = ""
    proxy: str = ""
    type: str = ""

    def list_name(self) -> str:
        return "interfaces"

    def entry(self, document: Document) -> Node:
        name = self.name or free_name("proxy", {each.name for each in document.interfaces}, "_")
        return changed(Interface(name="", proxy=""), name=name, proxy=self.proxy, type=self.type)


class ChangeInterface(_ChangeCommand, frozen=True, kw_only=True):
    """Change an interface, by its index."""

    name: str | None = None
    proxy: str | None = None
    type: str | None = None

    def list_name(self) -> str:
        return "interfaces"


def _with_renamed_arguments(document: Document, automaton: int, former: str, name: str) -> Document:
    """Return a document in which states hand over an input of an automaton by another name."""
    others = {
        each.id
        for each in document.automata
        if each.id != automaton and any(i.name == former for i in each.inputs)
    }

    def rename(state: State) -> State:
        if automaton not in state.children:
            return state
        # Without a `child` an argument is for the only automaton of the state that has the input.
        is_only = others.isdisjoint(state.children)
        arguments = tuple(
            changed(each, name=name)
            if each.name == former and (each.child == automaton or (each.child == NO_CHILD and is_only))
            else each
            for each in state.arguments
        )
        return changed(state, arguments=arguments)

    automata = tuple(
        changed(each, states=tuple(rename(state) for state in each.states))
        if any(automaton in state.children for state in each.states)
        else each
        for each in document.automata
    )
    return changed(document, automata=automata)


class RemoveEntry(Command, frozen=True, kw_only=True):
    """Remove an entry of a list by its index; `automaton` is needed for inputs alone."""

    list: ListName
    index: Index
    automaton: Id = NO_CHILD

    def apply(self, document: Document) -> Document:
        def remove(entries: tuple[Any, ...]) -> tuple[Any, ...]:
            _entry_of(entries, self.list, self.index)
            return entries[: self.index] + entries[self.index + 1 :]

        return _with_list(document, self.list, self.automaton, remove)

    def title(self, document: Document) -> str:
        return f"Remove {_with_article(_NOUNS[self.list])}"


class ReorderEntry(Command, frozen=True, kw_only=True):
    """Put an entry of a list at another index; `automaton` is needed for inputs alone."""

    list: ListName
    index: Index
    to: Index
    automaton: Id = NO_CHILD

    def apply(self, document: Document) -> Document:
        def reorder(entries: tuple[Any, ...]) -> tuple[Any, ...]:
            order = [*entries]
            _entry_of(entries, self.list, self.index)
            order.insert(self.to, order.pop(self.index))
            return tuple(order)

        return _with_list(document, self.list, self.automaton, reorder)

    def title(self, document: Document) -> str:
        return f"Move {_with_article(_NOUNS[self.list])}"


def _with_article(noun: str) -> str:
    """Return a noun with its article."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def _entry_of(entries: tuple[_T, ...], list_name: str, index: int) -> _T:
    """Return an entry of a list. Raises EditError when there is none."""
    if index >= len(entries):
        noun = _NOUNS[list_name]
        why = f"there are {len(entries)}"
        raise EditError(f"Cannot change {noun} {index + 1}", why, "it may have been removed meanwhile")
    return entries[index]


def _exchanged(entries: tuple[_T, ...], index: int, new: _T) -> tuple[_T, ...]:
    """Return entries with another one at an index; the same ones when nothing differs."""
    return entries if entries[index] is new else (*entries[:index], new, *entries[index + 1 :])


def _with_entry(document: Document, list_name: str, index: int, change: Callable[[Node], Node]) -> Document:
    """Return a document in which one entry of a list is changed."""
    entries = getattr(document, list_name)
    new = change(_entry_of(entries, list_name, index))
    return changed(document, **{list_name: _exchanged(entries, index, new)})


def _with_list(
    document: Document, list_name: str, automaton: int, change: Callable[[tuple[Any, ...]], tuple[Any, ...]]
) -> Document:
    if list_name != "inputs":
        return changed(document, **{list_name: change(getattr(document, list_name))})
    return with_automaton(document, automaton, lambda each: changed(each, inputs=change(each.inputs)))
