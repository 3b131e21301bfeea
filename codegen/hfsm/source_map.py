"""Write the source map of a generated component, and find pieces of code in it for the editor.

`codegen.source_rows` explains the map, and reads it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence

from ..python_layout import INDENT
from ..source_rows import BEGIN, END, SourceRow, TableRow, read_rows
from .code.names import literal


def start_mark(key: str) -> str:
    """Return the line before a code."""
    return f"# <{key}>"


def end_mark(key: str) -> str:
    """Return the line after a code."""
    return f"# </{key}>"


def only_mark(key: str) -> str:
    """Return the end of the only line of a code."""
    return f"  # <{key}/>"


class SourceMap:
    """The pieces of code of a component, in its order."""

    def __init__(self, rows: Iterable[SourceRow] = ()) -> None:
        self.rows = tuple(sorted(rows))
        self._starts = [row.first for row in self.rows]

    def find(self, line: int) -> SourceRow | None:
        """Return the piece of code in a line of the component, None for a line that the generator wrote."""
        index = bisect_right(self._starts, line) - 1
        if index < 0 or line > self.rows[index].last:
            return None
        return self.rows[index]

    @classmethod
    def read(cls, component: str) -> SourceMap:
        """Return the map in a component's text; an empty map if there is none."""
        return cls(read_rows(component))


def written(rows: Iterable[TableRow]) -> Iterator[str]:
    """Yield the lines of the table."""
    yield f"{BEGIN.strip()}  # the document, element by element: lines without code, and code"
    yield from row_lines(rows, INDENT)
    yield END.strip()


def row_lines(rows: Iterable[Sequence[object]], indent: str) -> Iterator[str]:
    """Yield the lines of rows of literals: three for a row, so that changes of neighbors merge."""
    for name, *items in rows:
        yield f"{indent}({literal(name)},"
        if items:
            yield f"{indent}{INDENT}{', '.join(map(literal, items))},"
        yield f"{indent}),"
