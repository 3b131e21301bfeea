"""Read the source map at the end of a generated component; `codegen.hfsm.source_map` writes it.

Everything in it is relative, so that branches of a component merge where those of its document do: nothing in
it changes with code, and nothing with what stands elsewhere in the document. People's code in the component
stands between marks, `# <code 1.2>` and `# </code 1.2>`, or before one at the end of its line,
`# <trigger 1.2/>`: the kind of the code, then the ids of its automaton and of its state or transition. A
library is found by its statement. The component ends with `SOURCE_MAP`, which has a row for each element of
the document, in its order: how many lines without code it has, around the codes in it. The lines of each
code are counted between its marks.

A running component reads it, too, so that this module needs nothing of the compiler.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

from .parsing import parse_python

SOURCE_MAP: Final = "SOURCE_MAP"
"""The name of the table in the component."""
BEGIN: Final = f"\n{SOURCE_MAP} = source_map(__file__, ("
"""The text before the table."""
END: Final = "\n))"
"""The text behind it."""
FILE: Final = "file "
"""The beginning of the first row of a file."""
MARK: Final = re.compile(r"(?:^ *|  )# <(?P<key>[a-z]+ .+?)(?P<only>/?)>$")
"""A mark before code, or at the end of its only line."""
_LIBRARIES: Final = ("from ", "import ")

TableRow = Sequence[str | int]
"""The kind of an element, then numbers of its lines without code, with keys of code between them."""


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

    def place_of(self, line: int) -> str:
        """Return where a line of the component stands in the document, as `FILE:LINE`."""
        return f"{self.file}:{self.line_of(line)}"


def read_rows(component: str) -> tuple[SourceRow, ...]:
    """Return the rows of the map in a component's text, in the order of its lines; none without a map.

    The map of a component that an older version generated has none, either.
    """
    _, found, table = component.rpartition(BEGIN)
    if not found:
        return ()
    try:
        tree = parse_python(f"({table.partition(END)[0]}\n)", mode="eval")
        return source_rows(component, ast.literal_eval(tree))
    except (SyntaxError, TypeError, ValueError):  # somebody has edited it
        return ()


def source_rows(component: str, table: Iterable[TableRow]) -> tuple[SourceRow, ...]:
    """Return the rows of a table, with the lines of each code from the marks around it."""
    return tuple(sorted(_rows(_pieces(component.split("\n")), table)))


def _rows(pieces: dict[str, tuple[int, int]], table: Iterable[TableRow]) -> Iterator[SourceRow]:
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


def _pieces(lines: Sequence[str]) -> dict[str, tuple[int, int]]:
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
        elif "# <" in line and (mark := MARK.search(line)):
            key = mark["key"]
            if mark["only"]:
                found[key] = (number, number)
            else:
                first, end = number + 1, line.replace("# <", "# </", 1)
    return found


def _owner(key: str) -> tuple[str, int, int]:
    """Return the kind of the code with a key, and the ids of its automaton and its state or transition."""
    part, owner, *_ = key.split(" ")
    if part == "library":
        return part, 0, 0
    automaton, _, number = owner.rstrip("+").partition(".")
    return part, int(automaton), int(number or 0)
