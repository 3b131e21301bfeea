"""Commands for the lists of a document: parameters, events, properties, libraries, interfaces, and inputs.

An entry is told by its list and its index.
"""

# ruff: noqa: D102, ARG002 - `Command` says what its methods do, and with what

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Literal, TypeVar

from codegen.hfsm.document import NO_CHILD, Document, Node

from ..errors import EditError
from ..nodes import changed, with_automaton
from .base import Command, Id, Index

__all__ = ["NOUNS", "RemoveEntry", "ReorderEntry", "entry_of", "exchanged", "with_article", "with_entry"]

_T = TypeVar("_T")
_Change = Callable[[tuple[Any, ...]], tuple[Any, ...]]

ListName = Literal["parameters", "events", "properties", "libraries", "interfaces", "inputs"]

NOUNS: Final[dict[str, str]] = {
    "parameters": "parameter",
    "events": "event",
    "properties": "property",
    "libraries": "library",
    "interfaces": "interface",
    "inputs": "input",
}


class RemoveEntry(Command, frozen=True, kw_only=True):
    """Remove an entry of a list by its index; `automaton` is needed for inputs alone."""

    list: ListName
    index: Index
    automaton: Id = NO_CHILD

    def apply(self, document: Document) -> Document:
        def remove(entries: tuple[Any, ...]) -> tuple[Any, ...]:
            entry_of(entries, self.list, self.index)
            return entries[: self.index] + entries[self.index + 1 :]

        return _with_list(document, self.list, self.automaton, remove)

    def title(self, document: Document) -> str:
        return f"Remove {with_article(NOUNS[self.list])}"


class ReorderEntry(Command, frozen=True, kw_only=True):
    """Put an entry of a list at another index; `automaton` is needed for inputs alone."""

    list: ListName
    index: Index
    to: Index
    automaton: Id = NO_CHILD

    def apply(self, document: Document) -> Document:
        def reorder(entries: tuple[Any, ...]) -> tuple[Any, ...]:
            order = [*entries]
            entry_of(entries, self.list, self.index)
            order.insert(self.to, order.pop(self.index))
            return tuple(order)

        return _with_list(document, self.list, self.automaton, reorder)

    def title(self, document: Document) -> str:
        return f"Move {with_article(NOUNS[self.list])}"


def with_article(noun: str) -> str:
    """Return a noun with its article."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def entry_of(entries: tuple[_T, ...], list_name: str, index: int) -> _T:
    """Return an entry of a list. Raises EditError when there is none."""
    if index >= len(entries):
        noun = NOUNS[list_name]
        why = f"there are {len(entries)}"
        raise EditError(f"Cannot change {noun} {index + 1}", why, "it may have been removed meanwhile")
    return entries[index]


def exchanged(entries: tuple[_T, ...], index: int, new: _T) -> tuple[_T, ...]:
    """Return entries with another one at an index; the same ones when nothing differs."""
    return entries if entries[index] is new else (*entries[:index], new, *entries[index + 1 :])


def with_entry(document: Document, list_name: str, index: int, change: Callable[[Node], Node]) -> Document:
    """Return a document in which one entry of a list is changed."""
    entries = getattr(document, list_name)
    new = change(entry_of(entries, list_name, index))
    return changed(document, **{list_name: exchanged(entries, index, new)})


def _with_list(
    document: Document, list_name: str, automaton: int, change: Callable[[tuple[Any, ...]], tuple[Any, ...]]
) -> Document:
    if list_name != "inputs":
        return changed(document, **{list_name: change(getattr(document, list_name))})
    return with_automaton(document, automaton, lambda each: changed(each, inputs=change(each.inputs)))
