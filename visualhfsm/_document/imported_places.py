"""Where the content of imported files is in the document that imports it.

It is below the states that own the imported automata: its places there are those of the document with all
that it imports, which have the ids that `resolve` gives.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document, resolve
from codegen.hfsm.document import Automaton, Document
from codegen.messages import NO_MESSAGE, Message

from .places import Located, Locator, Place


class Imported(msgspec.Struct, frozen=True, kw_only=True):
    """A place in an imported file, and where a document has it.

    `file` is its path as `shown_path` returns it. `source` is the place in that file, `name` the same in
    words; they are None and empty for the file as a whole. `places` are those in the document, one for each
    import of the automaton; none for what belongs to no automaton. `owners` are the states whose automata
    come from other files, down to the place, the outermost ones first.
    """

    file: str
    source: Located | None = None
    name: Message = NO_MESSAGE
    places: tuple[Place, ...] = ()
    owners: tuple[Place, ...] = ()


class _Source(NamedTuple):
    """A place in an imported file, the automaton there, and the place in words."""

    located: Located
    automaton: Automaton | None
    name: Message


class ImportedPlaces:
    """The places of all files that a document imports; `path` is its own, `include` are as for `resolve`.

    Files are shown as seen from `home`, by default the path, which differs for a copy of a document.
    """

    def __init__(
        self, document: Document, path: Path, include: Sequence[Path] = (), *, home: Path | None = None
    ) -> None:
        self._document = document
        self._path = path
        self._home = home or path
        self._include = tuple(include)
        self._locators: dict[Path, tuple[Document, Locator]] = {}

    @cached_property
    def whole(self) -> Document:
        """The document with all that it imports, as far as that can be read."""
        return resolve(self._document, self._path, Diagnostics(), self._include)

    @property
    def files(self) -> frozenset[Path]:
        """The files that are imported, and those that would be if they existed."""
        found = {each.path for each in self.whole.automata if each.path is not None}
        return frozenset(found.union(*map(self._wanted, self.whole.automata)))

    def find(self, file: Path, line: int, column: int) -> Imported | None:
        """Return what is at a position of an imported file, line 0 for the whole; None for any other file."""
        tops = [each for each in self.whole.automata if self._is_top(each, file)]
        if not tops:
            return None
        source = self._source(file, line, column) if line else None
        copies = [] if source is None else list(self._copies(file, source.automaton))
        found = (Locator(Document(automata=(copy,))).find(line, column) for copy in copies)
        owners = dict.fromkeys(each for copy in copies or tops for each in self.owners(copy))
        return Imported(
            file=shown_path(file, self._home),
            source=None if source is None else source.located,
            name=NO_MESSAGE if source is None else source.name,
            places=tuple(each.place for each in found if each is not None),
            owners=tuple(owners),
        )

    def owners(self, automaton: Automaton) -> tuple[Place, ...]:
        """Return the states whose automata come from other files, down to an automaton; see `Imported`."""
        found: list[Place] = []
        for each in (automaton, *self.whole.above(automaton)):
            owner = self.whole.owner(each)
            if owner is not None and (each.imported is not None or each.path != owner.path):
                found.insert(0, Place(kind="state", automaton=each.father, id=owner.id))
        return tuple(found)

    def _is_top(self, automaton: Automaton, file: Path) -> bool:
        """Return whether an automaton is imported from a file, or would be if that could be read."""
        if file in self._wanted(automaton):
            return True
        father = self.whole.automaton(automaton.father)
        return automaton.path == file and (father is None or father.path != file)

    def _wanted(self, automaton: Automaton) -> Iterator[Path]:
        """Yield the paths of the file that an automaton imports, if it could not be read."""
        name = "" if automaton.imported is None else automaton.imported.file.text.strip()
        if name and "\0" not in name:
            for folder in ((automaton.path or self._path).parent, *self._include):
                yield Path(os.path.normpath(folder / name))

    def _source(self, file: Path, line: int, column: int) -> _Source | None:
        """Return the place in the file."""
        if file not in self._locators:
            document = read_document(file, Diagnostics()) or Document()
            self._locators[file] = document, Locator(document)
        document, locator = self._locators[file]
        located = locator.find(line, column)
        if located is None:
            return None
        return _Source(located, document.automaton(located.place.automaton), locator.name(located))

    def _copies(self, file: Path, source: Automaton | None) -> Iterator[Automaton]:
        """Yield the automata of the document that an automaton of a file has become."""
        if source is not None:
            for each in self.whole.automata:
                if each.path == file and (each.line, each.column) == (source.line, source.column):
                    yield each


def shown_path(file: Path, document: Path) -> str:
    """Return the path of a file as people read it: from the folder of a document, if it is in it."""
    for path, folder in ((file, document.parent), (file.resolve(), document.parent.resolve())):
        if path.is_relative_to(folder):
            return path.relative_to(folder).as_posix()
    return str(file)
