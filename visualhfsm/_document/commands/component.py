"""Commands for the data of a document: texts, and lists of parameters, events, properties and the like.

An entry of a list is named by the list and its index.
"""

# ruff: noqa: ARG002 - `Command` documents its methods and their parameters

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any, Final, Literal, NamedTuple, Self, TypeVar, get_args

import msgspec

from codegen.hfsm import document as model
from codegen.hfsm.code.names import component_name
from codegen.messages import Message
from visualhfsm._base.errors import EditError

from .. import nodes
from .base import Command, Id, Index, Language, made_up, only_text

ListName = Literal[
    "parameters",
    "events",
    "properties",
    "survives",
    "libraries",
    "interfaces",
    "ros",
    "inputs",
    "outputs",
]
PropertyKind = Literal["always", "eventually", "never"]
RosKind = Literal["publish", "subscribe", "service", "action"]
_KINDS: Final = {"properties": get_args(PropertyKind), "ros": get_args(RosKind)}
"""The kinds of the entries of a list, where there are only these."""
Entries = tuple[Any, ...]
_OwnerT = TypeVar("_OwnerT", model.Document, model.Automaton)


class _List(NamedTuple):
    """The noun for an entry of a list, a new entry, and the fields that can be changed.

    A new entry without a name gets the noun with a number behind the `separator`, if there is one.
    """

    noun: Message
    one: Message
    blank: model.Node
    fields: tuple[str, ...]
    separator: str = ""


_PARAMETER: Final = model.Parameter(name="", type=model.Text("float"), default=model.Text("0.0"))
_PARAMETER_FIELDS: Final = ("name", "type", "default", "description")
_LISTS: Final[dict[str, _List]] = {
    "parameters": _List(Message("parameter"), Message("a parameter"), _PARAMETER, _PARAMETER_FIELDS, "_"),
    "inputs": _List(Message("input"), Message("an input"), _PARAMETER, _PARAMETER_FIELDS, "_"),
    "outputs": _List(Message("output"), Message("an output"), _PARAMETER, _PARAMETER_FIELDS, "_"),
    "events": _List(
        Message("event"), Message("an event"), model.Event(name=""), ("name", "description"), " "
    ),
    "properties": _List(
        Message("property"),
        Message("a property"),
        model.Property(),
        ("name", "kind", "within", "expression"),
        " ",
    ),
    "survives": _List(
        Message("failure to survive"),
        Message("a failure to survive"),
        model.Survives(part="Camera", kind="black"),
        ("part", "kind", "amount", "after", "must"),
    ),
    "libraries": _List(
        Message("library"), Message("a library"), model.Library(name=model.Text("math")), ("name",)
    ),
    "interfaces": _List(
        Message("interface"),
        Message("an interface"),
        model.Interface(name="", proxy=""),
        ("name", "proxy", "type"),
        "_",
    ),
    "ros": _List(
        Message("topic"),
        Message("a topic"),
        model.RosInterface(name=""),
        ("name", "kind", "target", "type", "qos", "stop"),
        "_",
    ),
}
_OF_AUTOMATON: Final[Mapping[str, str]] = {"inputs": "arguments", "outputs": "results"}
"""The lists of an automaton, each with the list of the states above that names its entries."""
_FIELDS: Final[dict[str, tuple[str, Message]]] = {
    "description": ("description", Message("the description")),
    "onError": ("on_error", Message("the behavior after errors")),
    "onRefused": ("on_refused", Message("the behavior after refused commands")),
    "world": ("world", Message("the world of the simulation")),
    "language": ("language", Message("the language")),
}
"""For each part, the field of the document and its name in the undo list."""


class SetComponentText(Command, frozen=True, kw_only=True):
    """Set a component's description, world, language, or its policy after an error or a refused command."""

    typed = ("text",)
    part: Literal["description", "onError", "onRefused", "world", "language"]
    text: str

    def apply(self, document: model.Document) -> model.Document:
        return nodes.changed(document, **{_FIELDS[self.part][0]: self.text})

    def title(self, document: model.Document) -> Message:
        return Message("Set {what}", what=_FIELDS[self.part][1])


class _EntryCommand(Command, frozen=True, kw_only=True):
    """A change of a list of the component, or of the inputs or outputs of an `automaton`."""

    list: ListName
    automaton: Id = model.NO_CHILD

    def changed_list(self, document: model.Document, change: Callable[[Entries], Entries]) -> model.Document:
        def change_it(owner: _OwnerT) -> _OwnerT:
            return nodes.changed(owner, **{self.list: change(getattr(owner, self.list))})

        if self.list not in _OF_AUTOMATON:
            return change_it(document)
        return nodes.with_automaton(document, self.automaton, change_it)

    def noun(self) -> Message:
        return _LISTS[self.list].one


class AddEntry(_EntryCommand, frozen=True, kw_only=True):
    """Add an entry to a list; without a name it gets a free one."""

    fields: dict[str, str] = msgspec.field(default_factory=dict)
    language: Language = ""

    def apply(self, document: model.Document) -> model.Document:
        if self.list in _OF_AUTOMATON:
            what = Message("Cannot add {noun}", noun=self.noun())
            nodes.require_own_content(nodes.find_automaton(document, self.automaton), what)

        def add(entries: Entries) -> Entries:
            noun, _, blank, _, separator = _LISTS[self.list]
            fields = _checked_fields(self.list, self.fields)
            if separator and not fields.get("name"):
                name = made_up(noun, self.language)
                if separator == "_":  # code calls it by that, and so do options of the command line
                    name = component_name(name)
                fields["name"] = nodes.free_name(name, {each.name for each in entries}, separator)
            return (*entries, nodes.changed(blank, **fields))

        return self.changed_list(document, add)

    def title(self, document: model.Document) -> Message:
        return Message("Add {noun}", noun=self.noun())


class ChangeEntry(_EntryCommand, frozen=True, kw_only=True):
    """Change fields of an entry.

    When an input or an output is renamed, so are the arguments and results of states for it.
    """

    index: Index
    fields: dict[str, str]

    def apply(self, document: model.Document) -> model.Document:
        former = ""

        def change(entries: Entries) -> Entries:
            nonlocal former
            entry = _entry_of(entries, self.list, self.index)
            former = getattr(entry, "name", "")
            new = nodes.changed(entry, **_checked_fields(self.list, self.fields))
            if new is entry:
                return entries
            return (*entries[: self.index], new, *entries[self.index + 1 :])

        document = self.changed_list(document, change)
        name = self.fields.get("name", former)
        if self.list not in _OF_AUTOMATON or name == former:
            return document
        return _with_renamed(document, self.automaton, self.list, former, name)

    def title(self, document: model.Document) -> Message:
        return Message("Change {noun}", noun=self.noun())

    @property
    def merge_key(self) -> Hashable:
        return type(self), self.list, self.automaton, self.index, tuple(self.fields)

    @property
    def text_typed(self) -> str:
        return self.fields[self._text_field()]

    def with_text(self, text: str) -> Self:
        return msgspec.structs.replace(self, fields={self._text_field(): text})

    def _text_field(self) -> str:
        return only_text(self, tuple(self.fields))


class RemoveEntry(_EntryCommand, frozen=True, kw_only=True):
    """Remove an entry of a list."""

    index: Index

    def apply(self, document: model.Document) -> model.Document:
        def remove(entries: Entries) -> Entries:
            _entry_of(entries, self.list, self.index)
            return entries[: self.index] + entries[self.index + 1 :]

        return self.changed_list(document, remove)

    def title(self, document: model.Document) -> Message:
        return Message("Remove {noun}", noun=self.noun())


class ReorderEntry(_EntryCommand, frozen=True, kw_only=True):
    """Move an entry of a list to another index."""

    index: Index
    to: Index

    def apply(self, document: model.Document) -> model.Document:
        def reorder(entries: Entries) -> Entries:
            order = [*entries]
            _entry_of(entries, self.list, self.index)
            order.insert(self.to, order.pop(self.index))
            return tuple(order)

        return self.changed_list(document, reorder)

    def title(self, document: model.Document) -> Message:
        return Message("Move {noun}", noun=self.noun())


def _checked_fields(list_name: str, fields: dict[str, str]) -> dict[str, str]:
    """Return the new fields of an entry of a list. Raises EditError for an unknown field."""
    noun, _, _, known, _ = _LISTS[list_name]
    for name in fields:
        if name not in known:
            raise EditError(
                Message("Cannot set {name!r} of the {noun}", name=name[:40], noun=noun),
                Message("it has only {known}", known=", ".join(known)),
            )
    kinds, kind = _KINDS.get(list_name, ()), fields.get("kind")
    if kinds and kind is not None and kind not in kinds:
        raise EditError(
            Message("Cannot make a {noun} of the kind {kind!r}", noun=noun, kind=kind[:40]),
            Message("it is one of {kinds}", kinds=", ".join(kinds)),
        )
    return dict(fields)


def _entry_of(entries: Entries, list_name: str, index: int) -> Any:  # noqa: ANN401 - whatever the list holds
    """Return an entry of a list. Raises EditError when there is none."""
    if index >= len(entries):
        why = Message("there are {count}", count=len(entries))
        what = Message("Cannot change {noun} {index}", noun=_LISTS[list_name].noun, index=index + 1)
        raise EditError(what, why, "it may have been removed meanwhile")
    return entries[index]


def _with_renamed(
    document: model.Document, automaton: int, kind: ListName, former: str, name: str
) -> model.Document:
    """Return a document in which the arguments for an input, or the results for an output, are renamed."""
    others = {
        each.id
        for each in document.automata
        if each.id != automaton and any(item.name == former for item in getattr(each, kind))
    }
    field = _OF_AUTOMATON[kind]

    def rename(state: model.State) -> model.State:
        if automaton not in state.children:
            return state
        # Without a `child` it is about the only automaton of the state that has the input or output.
        is_only = others.isdisjoint(state.children)
        renamed = tuple(
            nodes.changed(each, name=name)
            if each.name == former and (each.child == automaton or (each.child == model.NO_CHILD and is_only))
            else each
            for each in getattr(state, field)
        )
        return nodes.changed(state, **{field: renamed})

    automata = tuple(
        nodes.changed(each, states=tuple(rename(state) for state in each.states))
        if any(automaton in state.children for state in each.states)
        else each
        for each in document.automata
    )
    return nodes.changed(document, automata=automata)
