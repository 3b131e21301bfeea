"""Look up lines of the running component in the source map at its end.

`codegen.hfsm.source_map` defines and writes that table, and the marks around code that it relies on. It is
read here again because a component runs without the compiler. Components that an older version generated
have a table of rows, which is used as it is.
"""

from __future__ import annotations

import ast
import dis
import linecache
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from types import CodeType, FrameType, TracebackType
from typing import Any, Final, NamedTuple

from ._parsing import parse_expression

PLACE: Final = "_hfsm_place"
"""The attribute of an exception that has its place with it, as text."""
_NAME: Final = "SOURCE_MAP"
_BEGIN: Final = f"\n{_NAME} = source_map(__file__, ("
_END: Final = "\n))"
_MARK: Final = re.compile(r"(?:^ *|  )# <(?P<key>[a-z]+ .+?)(?P<only>/?)>$")
_LIBRARIES: Final = ("from ", "import ")
_FILE: Final = "file "


class Row(NamedTuple):
    """A row of the table: code in lines `first` to `last`; `source` is where it begins, as `FILE:LINE`."""

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

    def place_of(self, line: int) -> str:
        """Return where a line of the component stands in the document, as `FILE:LINE`."""
        file, _, number = self.source.rpartition(":")
        return f"{file}:{int(number) + line - self.first}"


def source_map(file: str, table: Iterable[Sequence[str | int]]) -> tuple[Row, ...]:
    """Return the rows of the table at the end of a component, in the order of its lines.

    The component's `file` is read now, so that the map stays that of the running code when the file changes.
    """
    linecache.checkcache(file)
    lines = "".join(linecache.getlines(file)).split("\n")
    return tuple(sorted(_source_rows(lines, table)))


def _source_rows(lines: Sequence[str], table: Iterable[Sequence[str | int]]) -> Iterator[Row]:
    """Yield the rows of a table, with the lines of each code from the marks around it."""
    pieces = _pieces(lines)
    source = ""
    line = 1
    length = 0
    for name, *items in table:
        if str(name).startswith(_FILE):
            source = str(name).removeprefix(_FILE)
            line = 1
            length = 0
        for item in items:
            if isinstance(item, int):
                line += length + item
                length = 0
            elif item in pieces:  # somebody may have edited the file
                first, last = pieces[item]
                length = last - first + 1
                yield Row(first, last, f"{source}:{line}", *_owner(item))


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
        elif "# <" in line and (mark := _MARK.search(line)):
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


def sources_of(namespace: Mapping[str, object]) -> set[str]:
    """Return the names of the files in which the code of a component stands; `namespace` is its module's."""
    return {Row(*row).file for row in _rows(namespace)}


def last_line(error: BaseException, file: str) -> tuple[int, Row | None]:
    """Return the innermost line of a component's file in a traceback, and the row of its code.

    The line is 0 when the file is not involved; the row is None for a generated line.
    """
    found: TracebackType | None = None
    trace = error.__traceback__
    while trace is not None:
        found = trace if trace.tb_frame.f_code.co_filename == file else found
        trace = trace.tb_next
    if found is None:
        return 0, None
    line = found.tb_lineno
    return line, _row_of(line, found.tb_frame.f_globals, file)


def locate(error: BaseException, file: str) -> str:
    """Return where an exception was raised in a component, as `follow_ball.py:57 (follow_ball.xml:31)`.

    The innermost line of the component's `file` counts. A generated line has only its place in that file; the
    text is empty when the file is not involved. An exception from another process has its place with it.
    """
    place: object = getattr(error, PLACE, None)
    if isinstance(place, str):
        return place
    line, row = last_line(error, file)
    return _place(line, row, file) if line else ""


def locate_frame(frame: FrameType, file: str) -> str:
    """Return which line of a component a thread executes, in the same form; `frame` is its innermost one."""
    line, row = line_of_frame(frame, file)
    return _place(line, row, file) if line else ""


def line_of_frame(frame: FrameType, file: str) -> tuple[int, Row | None]:
    """Return which line of a component a thread executes, and the row of its code, as `last_line` does."""
    outer: FrameType | None = frame
    while outer is not None:
        if outer.f_code.co_filename == file:
            line = outer.f_lineno
            return line, _row_of(line, outer.f_globals, file)
        outer = outer.f_back
    return 0, None


def place_of_assignment(functions: Iterable[Callable[..., object]], name: str) -> str:
    """Return where the first function that assigns an outer variable does so last, in the form of `locate`.

    The text is empty if none of them assigns it.
    """
    for function in functions:
        code = getattr(function, "__code__", None)
        if not isinstance(code, CodeType):
            continue
        stores = [
            each.positions.lineno
            for each in dis.get_instructions(code)
            if each.opname == "STORE_DEREF" and each.argval == name and each.positions is not None
        ]
        if stores and (line := stores[-1]):
            row = _row_of(line, getattr(function, "__globals__", {}), code.co_filename)
            return _place(line, row, code.co_filename)
    return ""


def text_of_guard(guard: Callable[..., object]) -> str:
    """Return the condition of a guard on one line; empty for one outside a generated component."""
    code = getattr(guard, "__code__", None)
    rows = _rows(getattr(guard, "__globals__", {}))
    index = bisect_right(rows, code.co_firstlineno, key=itemgetter(0)) if code else len(rows)
    if code is None or index == len(rows):
        return ""
    row = Row(*rows[index])  # the code that follows the `def`
    lines = linecache.getlines(code.co_filename)[row.first - 1 : row.last]
    return " ".join(" ".join(_MARK.sub("", line) for line in lines).split()).removeprefix("return ")


def _place(line: int, row: Row | None, file: str) -> str:
    place = f"{Path(file).name}:{line}"
    return f"{place} ({row.place_of(line)})" if row else place


def _row_of(line: int, namespace: Mapping[str, object], file: str) -> Row | None:
    """Return the row of a line of a component; None for a generated line."""
    rows = _rows(namespace) or _read(file)  # while the module is being imported it has no map yet
    index = bisect_right(rows, line, key=itemgetter(0)) - 1
    row = Row(*rows[index]) if index >= 0 else None
    return row if row and line <= row.last else None


def _rows(namespace: Mapping[str, object]) -> tuple[Any, ...]:
    table = namespace.get(_NAME)
    return table if isinstance(table, tuple) else ()


def _read(file: str) -> tuple[Row, ...]:
    """Return the source map in the file of a component."""
    _, found, table = "".join(linecache.getlines(file)).rpartition(_BEGIN)
    if not found:
        return ()
    try:
        return source_map(file, ast.literal_eval(parse_expression(f"({table.partition(_END)[0]}\n)")))
    except (SyntaxError, TypeError, ValueError):  # somebody has edited it
        return ()
