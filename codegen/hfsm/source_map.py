"""Write the source map of a generated component, and read it from the file for the editor.

Everything in it is relative, so that branches of a component merge where those of its document do: nothing in
it changes with code, and nothing with what stands elsewhere in the document. People's code in the component
stands between marks, `# <code 1.2>` and `# </code 1.2>`, or before one at the end of its line,
`# <trigger 1.2/>`: the kind of the code, then the ids of its automaton and of its state or transition. A
library is found by its statement. The component ends with `SOURCE_MAP`, which has a row for each element of
the document, in its order: how many lines without code it has, around the codes in it. The lines of each
code are counted between its marks.

This module defines the format. `hfsm_runtime.source_map` reads it in the running component, which has no
compiler; a test reads what is written here with both.
"""

from __future__ import annotations

import ast
import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from .code.names import quoted
from .code.text import parse_python

SOURCE_MAP: Final = "SOURCE_MAP"
"""The name of the table in the component."""

_BEGIN: Final = f"\n{SOURCE_MAP} = source_map(__file__, ("
_END: Final = "\n))"
_MARK: Final = re.compile(r"(?:^ *|  )# <(?P<key>[a-z]+ .+?)(?P<only>/?)>$")
_LIBRARIES: Final = ("from ", "import ")
FILE: Final = "file "
"""What the first row of a file begins with."""

TableRow = tuple[str | int, ...]
"""What an element is, then numbers of its lines without code, with keys of code between them."""


def start_mark(key: str) -> str:
    """Return the line before a code."""
    return f"# <{key}>"


def end_mark(key: str) -> str:
    """Return the line after a code."""
    return f"# </{key}>"


def only_mark(key: str) -> str:
    """Return the end of the only line of a code."""
    return f"  # <{key}/>"


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
        """Return the map in a component's text; an empty map if there is none.

        The map of a component that an older version generated is empty, too.
        """
        _, found, table = component.rpartition(_BEGIN)
        if not found:
            return cls()
        try:
            tree = parse_python(f"({table.partition(_END)[0]}\n)", mode="eval")
            rows: list[TableRow] = list(ast.literal_eval(tree))
            return cls(_source_rows(component.split("\n"), rows))
        except (SyntaxError, TypeError, ValueError):  # somebody has edited it
            return cls()


def written(rows: Iterable[TableRow]) -> Iterator[str]:
    """Yield the lines of the table: three for a row, so that changes of neighbors merge."""
    yield f"{_BEGIN.strip()}  # the document, element by element: lines without code, and code"
    for name, *items in rows:
        yield f"    ({quoted(str(name))},"
        if items:
            shown = (str(each) if isinstance(each, int) else quoted(each) for each in items)
            yield f"        {', '.join(shown)},"
        yield "    ),"
    yield _END.strip()


def _source_rows(lines: list[str], table: Iterable[TableRow]) -> Iterator[SourceRow]:
    """Yield the rows of a table, with the lines of each code from the marks around it."""
    pieces = _pieces(lines)
    file = ""
    line = 1
    length = 0
    for name, *items in table:
        if str(name).startswith(FILE):
            file = str(name).removeprefix(FILE)
            line = 1
            length = 0
        for item in items:
            if isinstance(item, int):
                line += length + item
                length = 0
            elif item in pieces:  # somebody may have edited the file
                first, last = pieces[item]
                length = last - first + 1
                yield SourceRow(first, last, f"{file}:{line}", *_owner(item))


def _pieces(lines: list[str]) -> dict[str, tuple[int, int]]:
    """Return the first and the last line of each code of a component, by its key."""
    found: dict[str, tuple[int, int]] = {}
    key = ""
    first = 0
    end = ""
    for number, line in enumerate(lines, 1):
        if end:  # inside of a code
            if line == end:
                found[key] = (first, number - 1)
                end = ""
        elif line.startswith(_LIBRARIES):
            found[f"library {line}"] = (number, number)
        elif "# <" in line and (mark := _MARK.search(line)):
            key = mark["key"]
            if mark["only"]:
                found[key] = (number, number)
            else:
                first, end = number + 1, line.replace("# <", "# </", 1)
    return found


def _owner(key: str) -> tuple[str, int, int]:
    """Return the kind of the code of a key, and the ids of its automaton and its state or transition."""
    part, owner, *_ = key.split(" ")
    if part == "library":
        return part, 0, 0
    automaton, _, number = owner.rstrip("+").partition(".")
    return part, int(automaton), int(number or 0)
