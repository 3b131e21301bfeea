"""Put marks around people's code in a component, and make the table of its source map.

`source_map.py` explains both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import NamedTuple

from ..source_rows import FILE, SourceRow, TableRow
from ._automaton_writer import CodeLines, Line
from .document import Annotation, Automaton, Document, Node, State, Text, Transition
from .source_map import SourceMap, end_mark, only_mark, start_mark


class _Place(NamedTuple):
    """The place where an element begins; `path` is None in the document itself."""

    path: Path | None
    line: int
    column: int


class _Start(NamedTuple):
    """The line in which an element of a file begins, or a piece of code, which has `lines`."""

    line: int
    name: str
    lines: tuple[str, ...] = ()


class MarkedLines:
    """The lines of the component of a document, and the `pieces` of code among them.

    `name_of` returns the name of a file; None is the document itself.
    """

    def __init__(self, document: Document, name_of: Callable[[Path | None], str]) -> None:
        self.lines: list[str] = []
        self.pieces: list[CodeLines] = []
        self._rows: list[SourceRow] = []
        self._name_of = name_of
        self._keys: set[str] = set()
        self._starts: dict[str, list[_Start]] = {}
        names: dict[_Place, str] = {}
        for place, name in _elements(document):
            names.setdefault(place, name)  # an automaton may be imported several times
        for place, name in names.items():
            self._starts.setdefault(name_of(place.path), []).append(_Start(place.line, name))

    @property
    def source_map(self) -> SourceMap:
        """The source map of the pieces."""
        return SourceMap(self._rows)

    def add(self, item: Line) -> None:
        """Add a generated line, or a piece of code with its marks."""
        if isinstance(item, str):
            self.lines.append(item)
            return
        key, code = self._key(item), list(item.lines)
        before, after = [], []
        if item.is_block:
            indentation = code[0][: len(code[0]) - len(code[0].lstrip())]
            before, after = [indentation + start_mark(key)], [indentation + end_mark(key)]
        elif item.part != "library":
            code[0] += only_mark(key)
        first, file = len(self.lines) + len(before) + 1, self._name_of(item.path)
        self.lines += [*before, *code, *after]
        self.pieces.append(item)
        source = f"{file}:{item.code.line}"
        self._rows.append(SourceRow(first, first + len(code) - 1, source, item.part, item.automaton, item.id))
        self._starts.setdefault(file, []).append(_Start(item.code.line, key, item.code.lines))

    def table(self) -> Iterator[TableRow]:
        """Yield the rows of the table: file by file, the elements in their order."""
        for file, starts in self._starts.items():
            yield from _rows_of(file, starts)

    def _key(self, item: CodeLines) -> str:
        """Return the key of a piece of code, which no other piece has."""
        if item.part == "library":
            return f"library {item.lines[0]}"
        key = f"{item.part} {item.automaton}.{item.id}" if item.id else f"{item.part} {item.automaton}"
        key += f" {item.name}" if item.name else ""
        while key in self._keys:  # two arguments of one name, or ids that an old document repeats
            key += "+"
        self._keys.add(key)
        return key


def _rows_of(file: str, starts: list[_Start]) -> Iterator[TableRow]:
    """Yield the rows of a file."""
    row: list[str | int] = [FILE + file]
    line = 1
    before: _Start | None = None
    for start in sorted(starts, key=lambda start: (start.line, bool(start.lines))):
        if before and (start.line, start.lines) == (before.line, before.lines):
            row.append(start.name)  # the same code: its automaton is imported several times
            continue
        row.append(start.line - line)
        line = start.line + len(start.lines)
        if start.lines:
            row.append(start.name)
            before = start
        else:
            yield tuple(row)
            row = [start.name]
            before = None
    yield tuple(row)


def _elements(document: Document) -> Iterator[tuple[_Place, str]]:
    """Yield the places of elements with their names, in the order of the model.

    Each of them has a row, so that what is added before one changes no other.
    """
    yield from _element(document, "document")
    for each in _children(document):
        if not isinstance(each, Automaton):
            yield from _element(each, f"{type(each).__name__.lower()} {_name(each)}")
            continue
        yield from _element(each, f"automaton {each.id}")
        for item in _children(each):
            kind = type(item).__name__.lower()
            name = item.id if isinstance(item, State | Transition | Annotation) else _name(item)
            yield from _element(item, f"{kind} {each.id}.{name}")


def _element(node: Node, name: str) -> Iterator[tuple[_Place, str]]:
    """Yield the place of an element; of a whole document or automaton, also of its texts."""
    if node.line:
        yield _Place(node.path, node.line, node.column), name
    for each in fields(node) if isinstance(node, Document | Automaton) else ():
        value = getattr(node, each.name)
        if isinstance(value, Text) and value.line:
            yield _Place(node.path, value.line, value.column), f"{each.name} of {name}"


def _children(node: Node) -> Iterator[Node]:
    for each in fields(node):
        value = getattr(node, each.name)
        yield from (item for item in value if isinstance(item, Node)) if isinstance(value, tuple) else ()


def _name(node: Node) -> str:
    name = getattr(node, "name", "")
    return name.text.strip() if isinstance(name, Text) else str(name)
