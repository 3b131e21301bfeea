"""Resolve the imports of a document: replace the automata that import by those of the other files.

The result is one document whose imported parts know their file. An imported automaton has the id and the
owner of the automaton that imports it; those below it get the id `1000 * its id + their own id`, or the next
free one. Libraries, interfaces, parameters, events and functions of the other file are imported as well, its
properties are not.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import islice
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, Final, NamedTuple, TypeVar

from ..diagnostics import Diagnostics, Location, Note, did_you_mean
from ..files import is_regular
from ..messages import Message
from .analysis import library_names
from .code.language import change_code, first_foreign, report_foreign
from .codes import Code
from .document import (
    NO_CHILD,
    Automaton,
    Document,
    Event,
    Functions,
    Import,
    Interface,
    Library,
    Node,
    Parameter,
    RosInterface,
    State,
    Text,
)
from .formats.reader import read_document

_MAX_DEPTH: Final = 16
"""The longest chain of files that import one another."""
_MOST_AUTOMATA: Final = 10_000
"""The most automata in a document, with those that are imported."""
_MAX_ID: Final = 2**31 - 1
_IDS_EACH: Final = 1000
_MOST_NAMES: Final = 1000  # among which one is searched that is meant

_N = TypeVar("_N", Interface, RosInterface, Parameter, Event)
_NodeT = TypeVar("_NodeT", bound=Node)


def resolve(
    document: Document,
    path: Path,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    most_automata: int = _MOST_AUTOMATA,
) -> Document:
    """Return a document with everything that it imports; after errors, with as much as possible.

    Automata that are still `imported` then could not be. `path` is that of the document. Imported files must
    be in or below its directory, or below one of the directories in `include`.
    """
    if not any(automaton.imported for automaton in document.automata):
        return document
    resolver = _Resolver(path, tuple(include), diagnostics, most_automata)
    resolved = _share_functions(resolver.resolve(document, path, (_Stacked(path.resolve(), None),)))
    # Text is copied if it is imported twice, since an analysis identifies code by its text object.
    return change_code(resolved, replace)


class _Stacked(NamedTuple):
    """A file that is being resolved, and the place that imports it, None for the outermost file."""

    file: Path
    place: Location | None


@dataclass(frozen=True, slots=True)
class _Part:
    """An automaton of a document with all automata below it."""

    document: Document
    automata: tuple[Automaton, ...]


class _Resolver:
    def __init__(
        self, path: Path, include: tuple[Path, ...], diagnostics: Diagnostics, most_automata: int
    ) -> None:
        self._directories = (path.parent, *include)
        self._most_automata = most_automata
        self._diagnostics = diagnostics
        self._documents: dict[Path, Document | None] = {}

    def resolve(self, document: Document, path: Path, stack: tuple[_Stacked, ...]) -> Document:
        """Return a document with its imports; `stack` has the files that import it, and itself."""
        automata: list[Automaton] = []
        taken = {automaton.id for automaton in document.automata}
        for index, stub in enumerate(document.automata):
            part = None if stub.imported is None else self._part(stub, stub.imported, path, stack)
            if part is None:
                automata.append(stub)
            elif len(automata) + len(part.automata) > self._most_automata:
                message = Message("more than {limit} automata in total", limit=self._most_automata)
                self._error(Code.RECURSIVE_IMPORT, message, _place(stub, path))
                automata += document.automata[index:]
                break
            else:
                automata += _graft(part.automata, stub, taken)
                document = self._merge(document, part.document, path)
                document = replace(document, functions=document.functions + tuple(_other_functions(part)))
        return replace(document, automata=tuple(automata))

    def _part(
        self, stub: Automaton, imported: Import, path: Path, stack: tuple[_Stacked, ...]
    ) -> _Part | None:
        """Return the part that an automaton imports, or None after an error."""
        place = _place(imported, path)
        if stub.states or stub.transitions or stub.inputs or stub.outputs:
            message = Message(
                "automaton {id} is imported, but also has states, transitions, inputs or outputs here",
                id=stub.id,
            )
            note = Note(Message("they belong into the imported file"))
            self._error(Code.IMPORT_OF_WRONG_KIND, message, place, note)
            return None
        file = self._find(imported, path, place)
        if file is None or not self._may_follow(file, place, stack):
            return None
        document = self._document(file, place, stack)
        if document is None:
            return None
        top = document.automaton(imported.automaton) if imported.automaton != NO_CHILD else document.root
        if top is None:
            message = Message("`{file}` has not exactly one root", file=_shown(imported))
            if imported.automaton:
                message = Message(
                    "`{file}` has no automaton {id}", file=_shown(imported), id=imported.automaton
                )
            self._error(Code.IMPORT_OF_WRONG_KIND, message, place)
            return None
        return _Part(document, tuple(_with_all_below(top, document)))

    def _find(self, imported: Import, path: Path, place: Location) -> Path | None:
        """Return the path of an imported file, or None after an error."""
        name = imported.file.text.strip()
        if not name:
            message = Message("the import has no file: write its path, relative to this document")
            self._error(Code.IMPORT_OUTSIDE_DIRECTORY, message, place)
            return None
        shown = _shown(imported)
        if PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or "\0" in name:
            message = Message("`{file}` is not a path relative to this document", file=shown)
            self._error(Code.IMPORT_OUTSIDE_DIRECTORY, message, place)
            return None
        searched = (path.parent, *self._directories[1:])
        found = [file for file in (Path(os.path.normpath(at / name)) for at in searched) if is_regular(file)]
        allowed = [directory.resolve() for directory in self._directories]
        for file in found:
            if any(file.resolve().is_relative_to(directory) for directory in allowed):
                return file
        if found:
            note = Note(Message("allow its directory with -I"))
            message = Message("`{file}` is outside the directory of the document", file=shown)
            self._error(Code.IMPORT_OUTSIDE_DIRECTORY, message, place, note)
        else:
            files = (
                (at, each) for at in searched for below in ("*", "*/*") for each in at.glob(f"{below}.xml")
            )
            others = (each.relative_to(at).as_posix() for at, each in files if each != path)
            notes = did_you_mean(name, islice(others, _MOST_NAMES), "file")
            note = Note(Message("searched in {folders}", folders=", ".join(map(str, searched))))
            message = Message("`{file}` is not found", file=shown)
            self._error(Code.IMPORT_NOT_FOUND, message, place, *notes, note)
        return None

    def _may_follow(self, file: Path, place: Location, stack: tuple[_Stacked, ...]) -> bool:
        files = [stacked.file for stacked in stack]
        if file.resolve() in files:
            first = files.index(file.resolve())
            circle = " -> ".join(f"`{file.name}`" for file in (*files[first:], file))
            notes = [
                Note(Message("imported here"), stacked.place) for stacked in stack[first:] if stacked.place
            ]
            message = Message("the files import one another: {circle}", circle=circle)
            self._error(Code.RECURSIVE_IMPORT, message, place, *notes)
            return False
        if len(stack) > _MAX_DEPTH:
            message = Message("more than {limit} files import one another in a chain", limit=_MAX_DEPTH)
            self._error(Code.RECURSIVE_IMPORT, message, place)
            return False
        return True

    def _document(self, file: Path, place: Location, stack: tuple[_Stacked, ...]) -> Document | None:
        """Return the document in a file with its imports, or None after an error."""
        key = file.resolve()
        if key not in self._documents:
            document = read_document(file, self._diagnostics)
            piece = None if document is None else first_foreign(document, file)
            if document is not None and piece is not None:
                language = document.language.text.strip()[:20]
                report_foreign(piece, language, self._diagnostics, Note(Message("imported here"), place))
                document = None
            if document is not None:
                document = self.resolve(_located(document, file), file, (*stack, _Stacked(key, place)))
            self._documents[key] = document
        return self._documents[key]

    def _merge(self, document: Document, other: Document, path: Path) -> Document:
        """Return a document with the declarations of another one; equal ones are merged.

        Different declarations of one name are reported. `path` is that of the document.
        """
        return replace(
            document,
            libraries=self._merge_libraries(document.libraries, other.libraries, path),
            interfaces=self._merge_named(
                Message("interface"), document.interfaces, other.interfaces, path, _servant
            ),
            ros=self._merge_named(Message("ROS interface"), document.ros, other.ros, path, _endpoint),
            parameters=self._merge_named(
                Message("parameter"), document.parameters, other.parameters, path, _value
            ),
            events=self._merge_named(Message("event"), document.events, other.events, path, lambda _: ()),
        )

    def _merge_named(
        self,
        kind: Message,
        own: tuple[_N, ...],
        others: tuple[_N, ...],
        path: Path,
        meaning: Callable[[_N], object],
    ) -> tuple[_N, ...]:
        """Return both lists with each name once; `meaning` must be equal for equal names."""
        known = {item.name: item for item in own}
        for item in others:
            if item.name in known and meaning(item) != meaning(known[item.name]):
                message = Message(
                    "the {kind} `{name}` differs from the one of the same name", kind=kind, name=item.name
                )
                note = Note(Message("the other one is here"), _place(known[item.name], path))
                self._error(Code.CONFLICTING_IMPORTS, message, _place(item, path), note)
        return own + tuple(item for item in others if item.name not in known)

    def _merge_libraries(
        self, own: tuple[Library, ...], others: tuple[Library, ...], path: Path
    ) -> tuple[Library, ...]:
        """Return both lists; report a name that they bind to different things."""
        written = {library.name.text.strip() for library in own}
        known = {name: (target, each) for each in own for name, target in library_names(each).items()}
        new = [library for library in others if library.name.text.strip() not in written]
        for library in new:
            for name, target in library_names(library).items():
                if name in known and known[name][0] != target:
                    message = Message(
                        "the library `{library}` and another one are both named `{name}`",
                        library=library.name.text.strip(),
                        name=name,
                    )
                    note = Note(Message("the other one is here"), _place(known[name][1], path))
                    self._error(Code.CONFLICTING_IMPORTS, message, _place(library, path), note)
        return (*own, *new)

    def _error(self, code: str, message: Message, place: Location, *notes: Note) -> None:
        self._diagnostics.error(code, message, place, notes)


def _take_id(wanted: int, taken: set[int]) -> int:
    """Reserve an id for an automaton, or the next free one."""
    number = wanted if 0 < wanted <= _MAX_ID else 1
    while number in taken:
        number = number + 1 if number < _MAX_ID else 1
    taken.add(number)
    return number


def _with_all_below(top: Automaton, document: Document) -> Iterator[Automaton]:
    """Yield an automaton and all below it, parents first and each once."""
    left = {automaton.id: automaton for automaton in reversed(document.automata)}
    pending = [top.id]
    while pending:
        automaton = left.pop(pending.pop(), None)
        if automaton is not None:
            yield automaton
            pending += [child for state in reversed(automaton.states) for child in reversed(state.children)]


def _graft(automata: Sequence[Automaton], stub: Automaton, taken: set[int]) -> Iterator[Automaton]:
    """Yield automata of another document, the topmost first, as the replacement of `stub`."""
    top, *below = automata
    numbers = {top.id: stub.id}
    numbers.update({each.id: _take_id(_IDS_EACH * stub.id + each.id, taken) for each in below})
    for automaton in automata:
        yield replace(
            automaton,
            id=numbers[automaton.id],
            father=stub.father if automaton is top else numbers.get(automaton.father, stub.id),
            states=tuple(_renumbered(state, numbers) for state in automaton.states),
            comments=stub.comments if automaton is top else automaton.comments,
        )


def _renumbered(state: State, numbers: Mapping[int, int]) -> State:
    if not (state.children or state.arguments or state.results):
        return state
    arguments = (
        replace(argument, child=numbers.get(argument.child, argument.child)) for argument in state.arguments
    )
    results = (replace(result, child=numbers.get(result.child, result.child)) for result in state.results)
    children = tuple(numbers[child] for child in state.children if child in numbers)
    return replace(state, children=children, arguments=tuple(arguments), results=tuple(results))


def _other_functions(part: _Part) -> Iterator[Functions]:
    """Yield the functions of a document that belong to none of its imported automata."""
    yield from part.document.functions
    inside = {automaton.id for automaton in part.automata}
    for automaton in part.document.automata:
        if automaton.id not in inside and not automaton.functions.is_blank:
            yield Functions(text=automaton.functions, path=automaton.path)


def _share_functions(document: Document) -> Document:
    """Return a document without repeated functions of files that are imported several times."""
    seen: set[tuple[Path | None, int, int]] = set()

    def is_new(text: Text, path: Path | None) -> bool:
        key = (path, text.line, text.column)
        known = key in seen
        seen.add(key)
        return not known

    automata = tuple(
        automaton
        if automaton.path is None or is_new(automaton.functions, automaton.path)
        else replace(automaton, functions=Text())
        for automaton in document.automata
    )
    functions = tuple(item for item in document.functions if is_new(item.text, item.path))
    return replace(document, automata=automata, functions=functions)


def _located(node: _NodeT, path: Path) -> _NodeT:
    """Return a part of a document in which every node has the path of its file."""
    lists = {each.name: getattr(node, each.name) for each in fields(node)}
    changes: dict[str, Any] = {
        name: tuple(_located(item, path) if isinstance(item, Node) else item for item in value)
        for name, value in lists.items()
        if isinstance(value, tuple)
    }
    return replace(node, path=path, **changes)


def _place(item: Node, path: Path) -> Location:
    return Location(item.path or path, item.line, max(1, item.column))


def _shown(imported: Import) -> str:
    return imported.file.text.strip()[:100]


def _servant(interface: Interface) -> object:
    return interface.identity.strip(), interface.type.strip()


def _endpoint(interface: RosInterface) -> object:
    return replace(interface, comments=(), extras=(), attributes=(), path=None)


def _value(parameter: Parameter) -> object:
    return parameter.type.text.strip(), parameter.default.text.strip()
