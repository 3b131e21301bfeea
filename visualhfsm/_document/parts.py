"""A document in parts, of which only those that have changed are read again.

Each automaton is a part, and so is what a file has before the automata, and behind them. A part has separate
lines, so that its places stay the same whatever changes in the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.document import Automaton, Document
from zenoh_ice.data import typed

from .serialization import written

_LINES: Final = 1 << 24
"""Lines of a part: more than the largest document has."""
_BEHIND: Final = frozenset({"libraries", "config", "ros"})
"""The lists that stand behind the automata."""
_MOST_DOCUMENTS: Final = 8


def split(document: Document) -> list[msgspec.Raw]:
    """Return the parts of a document as JSON, in the order of its file."""
    # Without any automaton, it would be taken for one of another editor.
    first = (Automaton(id=0),) if document.automata else ()
    alone = Document(root_tag=document.root_tag, dialect=document.dialect)
    behind = tuple(each for each in document.lists if each.tag in _BEHIND)
    before = tuple(each for each in document.lists if each.tag not in _BEHIND)
    parts = [
        replace(document, automata=first, libraries=(), interfaces=(), ros=(), lists=before, extras=()),
        *(replace(alone, automata=(automaton,)) for automaton in document.automata),
        replace(
            alone,
            automata=first,
            libraries=document.libraries,
            interfaces=document.interfaces,
            ros=document.ros,
            lists=behind,
            extras=document.extras,
        ),
    ]
    return [msgspec.Raw(msgspec.json.encode(each)) for each in parts]


class Parts:
    """The parts of the documents that were read last, as they are when their text is read."""

    def __init__(self) -> None:
        self._known: dict[Path, dict[tuple[int, bytes], tuple[Document | None, Diagnostics]]] = {}

    def read(self, parts: Sequence[msgspec.Raw], path: Path, diagnostics: Diagnostics) -> Document | None:
        """Return the document in parts, or None after reporting errors. Raises EditError as `written`."""
        known = self._known.pop(path, {})
        kept = {}
        for key in enumerate(map(bytes, parts)):
            kept[key] = known.get(key) or _read(*key, path)
            diagnostics.add_all(kept[key][1])
        self._known[path] = kept
        if len(self._known) > _MOST_DOCUMENTS:
            del self._known[next(iter(self._known))]
        before, *automata, behind = [document for document, _ in kept.values()]
        if before is None or behind is None:
            return None
        return replace(
            before,
            automata=tuple(only for each in automata if each is not None for only in each.automata),
            libraries=behind.libraries,
            interfaces=behind.interfaces,
            ros=behind.ros,
            lists=before.lists + behind.lists,
            extras=behind.extras,
        )


def _read(number: int, part: bytes, path: Path) -> tuple[Document | None, Diagnostics]:
    diagnostics = Diagnostics(decoded=True)
    text = written(typed.from_json(part, Document))
    return parse_document(text, path, diagnostics, above=number * _LINES), diagnostics
