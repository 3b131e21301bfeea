"""Write the source map of a generated component, and read it from the file for the editor.

The component ends with the map as a table, `SOURCE_MAP`: a tuple with a `SourceRow` for each piece of code,
as plain tuples in the order of their lines, without zeros at the end. The lines of a piece follow each other
in both files. This module defines the format. `hfsm_runtime.source_map` reads it in the running component,
which has no compiler; a test reads what is written here with both.
"""

from __future__ import annotations

import ast
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

__all__ = ["SOURCE_MAP", "SourceMap", "SourceRow"]

SOURCE_MAP: Final = "SOURCE_MAP"
"""The name of the table in the component."""


class SourceRow(NamedTuple):
    """A piece of code in lines `first` to `last` of the component.

    `source` is where it begins in a document, as `follow_ball.xml:47`. `part` is `library`, `functions`,
    `variables`, or `automaton` where a whole one is imported; of a state `entry`, `code`, `exit` or
    `argument`; of a transition `trigger`, `guard` or `fired`. `automaton` and `id` are 0 where they mean
    nothing.
    """

    first: int
    last: int
    source: str
    part: str
    automaton: int = 0
    id: int = 0

    @property
    def file(self) -> str:
        """The name of the document's file."""
        return self.source.rpartition(":")[0]

    def line_of(self, line: int) -> int:
        """Return the document's line of a line of the component."""
        return int(self.source.rpartition(":")[2]) + line - self.first


class SourceMap:
    """The pieces of code of a component, in its order."""

    def __init__(self, rows: Iterable[SourceRow] = ()) -> None:
        self.rows = tuple(rows)
        self._starts = [row.first for row in self.rows]

    def find(self, line: int) -> SourceRow | None:
        """Return the piece of code in a line of the component, None for a line that the generator wrote."""
        index = bisect_right(self._starts, line) - 1
        if index < 0 or line > self.rows[index].last:
            return None
        return self.rows[index]

    def table(self) -> Iterator[str]:
        """Yield the lines of the table."""
        yield f"{SOURCE_MAP} = (  # lines of this file, where they come from, and which code they are"
        for row in self.rows:
            source = '"' + row.source.replace("\\", "\\\\").replace('"', '\\"') + '"'
            ids = "".join(f", {number}" for number in row[4:] if number)
            yield f'    ({row.first}, {row.last}, {source}, "{row.part}"{ids}),'
        yield ")"

    @classmethod
    def read(cls, component: str) -> SourceMap:
        """Return the map at the end of a component's text; an empty map if there is none."""
        begin = component.rfind(f"\n{SOURCE_MAP} = (")
        end = component.find("\n)", begin)
        if begin < 0 or end < 0:
            return cls()
        try:
            _, _, table = component[begin : end + 2].partition("=")
            return cls(SourceRow(*row) for row in ast.literal_eval(table.strip()))
        except (SyntaxError, TypeError, ValueError):  # somebody has edited it
            return cls()
