"""Documents as text: whole ones of any dialect, and fragments for the clipboard.

A fragment is a document in the native format. Its first automaton has the copied states, the transitions
among them and the copied annotations; the others are the automata below these. It can go through any
clipboard.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostic, Diagnostics
from codegen.hfsm import DocumentNotWritableError, parse_document, write_document
from codegen.hfsm.codes import LOST
from codegen.hfsm.document import Automaton, Document
from codegen.hfsm.formats.others import Format
from codegen.hfsm.formats.xml_tree import parse_xml
from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError

from .geometry import with_default_handles
from .nodes import find_annotation, find_automaton, find_state
from .subtrees import below

MAX_SIZE: Final = 12 << 20
"""Bytes of the largest document that can be saved: fewer than the reader takes in size and in elements."""


def copy_states(
    document: Document, automaton: int, states: Sequence[int], annotations: Sequence[int] = ()
) -> str:
    """Return states and annotations as a fragment: with the transitions among them and all automata below.

    Raises EditError when one of them does not exist.
    """
    source = find_automaton(document, automaton)
    chosen = {find_state(source, number).id for number in states}
    noted = {find_annotation(source, number).id for number in annotations}
    if not chosen and not noted:
        raise EditError("Cannot copy", "no state is selected", "select states first")
    top = Automaton(
        id=source.id,
        states=tuple(state for state in source.states if state.id in chosen),
        transitions=tuple(
            each for each in source.transitions if each.origin in chosen and each.destination in chosen
        ),
        annotations=tuple(each for each in source.annotations if each.id in noted),
    )
    children = [child for state in top.states for child in state.children]
    others = tuple(each for each in below(document, children) if each.id != source.id)
    return written(Document(automata=(top, *others)))


def parse(text: str | bytes, what: Message, path: Path | None = None) -> Document:
    """Return the document in a text of any dialect. Raises EditError, which begins with `what`."""
    diagnostics = Diagnostics()
    document = parse_document(text, path or Path("document.xml"), diagnostics)
    if document is None:
        why = _with_line(diagnostics.errors[0])
        raise EditError(what, why, "it must be a document with automata")
    return document


def parse_file(content: bytes, path: Path) -> Document:
    """Return the document in a file of any dialect. Raises EditError."""
    with _without_garbage_collection():
        return parse(content, Message("Cannot open {file}", file=path.name), path)


def written(document: Document) -> str:
    """Return the text of a document. Raises EditError when it is too large or cannot be written."""
    try:
        text = write_document(document)
    except DocumentNotWritableError as error:
        raise EditError("Cannot write the document", reason(error), "remove that character") from error
    if len(text) > MAX_SIZE or len(text.encode()) > MAX_SIZE:
        why = Message("it is larger than {limit} MiB", limit=MAX_SIZE >> 20)
        raise EditError("Cannot write the document", why, "move parts of it to separate documents")
    return text


@contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """Pause the garbage collection: it would find nothing and take a third of the time of a parser."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def read_imported(other: Format, content: bytes, path: Path, diagnostics: Diagnostics) -> Document | None:
    """Return the document made from a file of another program, or None after errors were reported.

    Where a transition has no handle, it gets one, beside the others between the same states.
    """
    root = parse_xml(content, path, diagnostics)
    document = None if root is None else other.read(root, path, diagnostics, diagnostics)
    if document is None:
        return None
    placed = (
        with_default_handles(
            automaton, frozenset(each.id for each in automaton.transitions if not (each.x or each.y))
        )
        for automaton in document.automata
    )
    return replace(document, automata=tuple(placed))


def import_document(other: Format, content: bytes, name: str) -> tuple[Document, list[Message]]:
    """Return a document made from another format, with remarks: what is lost, then what is not the same.

    Raises EditError.
    """
    diagnostics = Diagnostics()
    document = read_imported(other, content, Path(name), diagnostics)
    if document is None:
        why = _with_line(diagnostics.errors[0])
        advice = Message("see {page} for what is understood", page=other.guide)
        raise EditError(Message("Cannot open {file}", file=name), why, advice)
    return document, [
        _with_line(each) for each in sorted(diagnostics, key=lambda each: each.code not in LOST)
    ]


def _with_line(found: Diagnostic) -> Message:
    if not found.location.line:
        return found.message
    return Message("line {line}: {problem}", line=found.location.line, problem=found.message)
