"""What an open document imports, as its files were read last."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

from codegen.hfsm.document import Automaton, Document
from visualhfsm._document.imported_places import ImportedPlaces

_Stamp = tuple[int, int] | None
"""Time of the last change and size of a file; None where there is none."""


@dataclass(frozen=True)
class Imports:
    """The automata that a document imports; `number` counts the changes."""

    automata: Mapping[int, Automaton] = field(default_factory=dict)
    stamps: Mapping[Path, _Stamp] = field(default_factory=dict)
    number: int = 0

    @classmethod
    def read(cls, places: ImportedPlaces, former: Self) -> Self:
        """Read the imported files; return the former imports if they are the same."""
        before = {file: _stamp(file) for file in places.files}
        automata = {each.id: each for each in places.whole.automata if each.path is not None}
        if automata == former.automata and before == former.stamps:
            return former
        return cls(automata, before, former.number + 1)

    def differ(self) -> bool:
        """Return whether a file is another one than when it was read."""
        return any(_stamp(file) != stamp for file, stamp in self.stamps.items())

    def within(self, document: Document) -> Document:
        """Return a document with the imported automata."""
        if not self.automata:
            return document
        written = {each.id for each in document.automata if each.imported is None}
        own = (each for each in document.automata if each.id in written or each.id not in self.automata)
        imported = (each for each in self.automata.values() if each.id not in written)
        return replace(document, automata=(*own, *imported))


def _stamp(file: Path) -> _Stamp:
    try:
        status = file.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
