"""Make a document for the shelf of states of another one, with what their code uses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import resolve
from codegen.hfsm.document import NO_CHILD, Automaton, Document, State, Text
from codegen.hfsm.document import Shelf as ShelfEntry
from codegen.messages import Message
from visualhfsm._base.errors import EditError
from visualhfsm._document.nodes import find_automaton, find_state
from visualhfsm._document.serialization import written
from visualhfsm._document.subtrees import below

from .imports import with_functions

_NO_LETTERS: Final = re.compile(r"[^\w-]+")


def shelf_file(title: str) -> str:
    """Return the name of the file for a title on the shelf. Raises EditError when it has no letter."""
    stem = _NO_LETTERS.sub("_", title.strip()).strip("_").lower()
    if not stem:
        raise EditError("Cannot put it on the shelf", "it has no title", "type a title")
    return f"{stem}.xml"


def shelf_document(
    document: Document,
    path: Path | None,
    automaton: int,
    states: Sequence[int],
    *,
    entry: ShelfEntry,
    description: str,
) -> Document:
    """Return a document that runs by itself, made of states of an automaton, with all below them.

    A single state without code is there as its automaton; others stand in an automaton like
    theirs, with its variables and functions. Imported automata become parts of it: `path`, the file of
    `document`, is where they are looked for. Of what the document declares, the new one has what the
    states use. Raises EditError.
    """
    what = Message("Cannot put it on the shelf")
    find_automaton(document, automaton)
    if path is not None:
        diagnostics = Diagnostics()
        document = resolve(document, path, diagnostics)
        if diagnostics.has_errors:
            raise EditError(what, diagnostics.errors[0].message, "fix the import first")
    source = find_automaton(document, automaton)
    numbers = {find_state(source, number).id for number in states}
    chosen = [each for each in source.states if each.id in numbers]
    if not chosen:
        raise EditError(what, "no state is selected", "select states first")
    top = _root(document, source, chosen)
    parts = [each for each in below(document, _children(top.states)) if each.id != top.id]
    foreign = [each for each in (top, *parts) if each.imported is not None]
    if foreign:
        raise EditError(what, "the document has no file yet", "save it first: imports are relative to it")
    top = with_functions(replace(top, father=NO_CHILD), document.functions)
    alone = Document(automata=(top, *(replace(each, path=None) for each in parts)))
    code = written(alone)
    return replace(
        alone,
        description=Text(description.strip()),
        shelf=entry,
        dialect=document.dialect,
        language=document.language,
        libraries=document.libraries,
        parameters=tuple(each for each in document.parameters if _uses(code, each.name)),
        interfaces=tuple(each for each in document.interfaces if _uses(code, each.name)),
        ros=tuple(each for each in document.ros if _uses(code, each.name)),
        events=tuple(each for each in document.events if re.search(rf"\b{re.escape(each.name)}\b", code)),
    )


def _root(document: Document, source: Automaton, chosen: Sequence[State]) -> Automaton:
    """Return the root automaton of chosen states."""
    if len(chosen) == 1:
        (state,) = chosen
        is_plain = all(text.is_blank for text in (state.entry, state.code, state.exit))
        if is_plain and len(state.children) == 1:
            return replace(find_automaton(document, state.children[0]), path=None)
    numbers = {each.id for each in chosen}
    if not any(each.initial for each in chosen):
        chosen = [replace(chosen[0], initial=True), *chosen[1:]]
    return replace(
        source,
        path=None,
        states=tuple(chosen),
        transitions=tuple(
            each for each in source.transitions if each.origin in numbers and each.destination in numbers
        ),
        annotations=(),
    )


def _children(states: Iterable[State]) -> list[int]:
    return [child for state in states for child in state.children]


def _uses(code: str, name: str) -> bool:
    return re.search(rf"\bself\s*\.\s*{re.escape(name)}\b", code) is not None
