"""Where a name in a piece of code is defined: in the piece itself, or elsewhere in the document."""

from __future__ import annotations

import ast
import textwrap
from contextlib import suppress
from typing import Any, Final

import msgspec
import parso
from parso.python.tree import search_ancestor

from codegen.hfsm.document import Document
from visualhfsm._document.places import Place, texts_in

_HERE: Final = "the piece itself"
_SHARED: Final = ("entry", "code", "exit", "fired")
_OF_AUTOMATON: Final = frozenset(("variables", "inputs", "outputs", *_SHARED))
_PARTS: Final = {
    "event": ("events",),
    "self": ("functions", "interfaces", "parameters", "ros"),
    "": ("variables", "inputs", "outputs", _HERE, *_SHARED, "functions", "libraries"),
}
"""The elements that define a text, a name after `self.`, and another one; the most likely first."""


class Definition(msgspec.Struct, frozen=True):
    """Where a name is defined: a text of the document, and in it line and column, from 1."""

    place: Place
    line: int
    column: int
    length: int


def define(document: Document, place: Place, code: str, line: int, column: int) -> Definition | None:
    """Return where the name at a position of a piece is defined, None if nothing in the document defines it.

    `code` is the piece as it is being typed; `line` counts from 1, `column` from 0.
    """
    with suppress(ValueError, SyntaxError, RecursionError):  # a position outside, or code that is no Python
        name, owner = _asked(code, line, column)
        parts = _PARTS[owner] if owner == "event" or place.part != "functions" else (_HERE, *_PARTS[owner])
        texts = [(at, text) for at, text, _, _ in texts_in(document) if text and at != place]
        for part in parts if name else ():
            if part == _HERE and (found := _in_code(place, code, name, line)):
                return found
            for at, text in texts:
                if at.part != part or (part in _OF_AUTOMATON and at.automaton != place.automaton):
                    continue
                if at.name == "name" and text.strip() == name:
                    return Definition(at, 1, 1, len(name))
                if not at.name and (found := _in_code(at, text, name)):
                    return found
    return None


def _asked(code: str, line: int, column: int) -> tuple[str, str]:
    """Return the name at a position, and what has it: `self`, `event` for a text, or ""."""
    tree: Any = parso.parse(code)
    sides = (tree.get_leaf_for_position((line, at)) for at in (column, column + 1))
    leaf = next((each for each in sides if each is not None and each.type in ("name", "string")), None)
    if leaf is not None and leaf.type == "string":
        return str(ast.literal_eval(leaf.value)), "event"
    names: list[str] = []
    while leaf is not None and leaf.type == "name":
        names.insert(0, leaf.value)
        dot = leaf.get_previous_leaf()
        if dot is None or dot.value != ".":
            return ("".join(names[1:2]), "self") if names[0] == "self" else (names[0], "")
        leaf = dot.get_previous_leaf()
    return "", ""  # nothing says what a call returns


def _in_code(place: Place, code: str, name: str, line: int = 0) -> Definition | None:
    """Return where a piece of code defines a name: for a line of it, or for other pieces."""
    tree: Any = parso.parse(textwrap.dedent(code))
    scopes = [None, search_ancestor(tree.get_leaf_for_position((line, 0), True), "funcdef") if line else None]
    for each in tree.get_used_names().get(name, ()):
        node = each.get_definition()
        if node is not None and search_ancestor(node, "funcdef", "lambdef", "classdef") in scopes:
            at = code.split("\n")[each.line - 1].find(name, each.column)
            return Definition(place, each.line, at + 1, len(name))
    return None
