"""Which events can arrive: those from outside, and those that code of the document sends."""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

from ..code.trees import parse_python
from ..document import Document, Text
from .model import AutomatonModel, Model

__all__ = ["Events", "events_of"]

_MENTIONED: Final = re.compile(r"\bsend\b")


@dataclass(frozen=True)
class Events:
    """The events of a document. Those from `outside` and from functions may arrive at any time."""

    all: frozenset[str]
    outside: frozenset[str]

    def sent_in(
        self, possible: Iterable[tuple[AutomatonModel, Collection[int], Collection[int]]]
    ) -> frozenset[str]:
        """Return the events that may arrive when these states and transitions of automata are possible."""
        sent = set(self.outside)
        for automaton, states, transitions in possible:
            for state in automaton.states:
                if state.index in states:
                    source = state.source
                    values = [argument.value for argument in source.arguments]
                    sent |= self._sent(source.entry, source.code, source.exit, *values)
            for transition in automaton.transitions:
                if transition.index in transitions:
                    sent |= self._sent(transition.source.code)
            if states:  # guards are asked although they do not hold
                sent |= self._sent(
                    *(
                        text
                        for item in automaton.transitions
                        for text in (item.source.guard, item.source.trigger)
                    )
                )
        return frozenset(sent)

    def _sent(self, *pieces: Text) -> frozenset[str]:
        found: set[str] = set()
        for piece in pieces:
            sent = _sent_by(piece.text)
            found |= self.all if sent is None else sent
        return frozenset(found)


def events_of(model: Model) -> Events:
    """Return the events that the transitions of a document wait for, and those that come from outside.

    What functions, variables and the hand-written code beside the document send counts as from outside: they
    may be called from anywhere.
    """
    document = model.document
    waited_for = frozenset(
        transition.event
        for automaton in model.automata
        for transition in automaton.transitions
        if transition.event
    )
    outside = {event.name.strip() for event in document.events}
    if _has_extension(model.path) or not _is_python(document):
        outside |= waited_for
    texts = [text for automaton in document.automata for text in (automaton.functions, automaton.variables)]
    for text in (*texts, *(functions.text for functions in document.functions)):
        sent = _sent_by(text.text)
        outside |= waited_for if sent is None else sent
    return Events(waited_for, frozenset(outside))


def _has_extension(path: Path) -> bool:
    try:
        return path.with_name(f"{path.stem}_ext.py").is_file()
    except (OSError, ValueError):
        return False


def _is_python(document: Document) -> bool:
    return document.language.text.strip().lower() in ("", "python", "python3", "python 3")


@cache
def _sent_by(source: str) -> frozenset[str] | None:
    """Return the names of the events that code sends, or None when that may be any."""
    if not _MENTIONED.search(source):
        return frozenset()
    try:
        tree = parse_python(textwrap.dedent(source))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
    sent: set[str] = set()
    understood: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and _is_send(node.func):
            name = (
                node.args[0] if node.args else next((k.value for k in node.keywords if k.arg == "name"), None)
            )
            if not isinstance(name, ast.Constant) or not isinstance(name.value, str):
                return None
            sent.add(name.value.strip())
            understood.add(node.func)
        elif (_is_send(node) and node not in understood) or (
            isinstance(node, ast.Constant) and node.value == "send"
        ):
            return None
    return frozenset(sent)


def _is_send(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Attribute)
        and node.attr == "send"
        and isinstance(node.value, ast.Name)
        and node.value.id == "self"
    )
