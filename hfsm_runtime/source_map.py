"""Look up lines of the running component in the source map at its end.

`codegen.source_rows` explains the map, and reads it. Components that an older version generated have a table
of rows, which is used as it is.
"""

from __future__ import annotations

import dis
import linecache
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from operator import itemgetter
from pathlib import Path
from traceback import walk_stack, walk_tb
from types import CodeType, FrameType
from typing import Any, Final

from codegen.source_rows import MARK, SOURCE_MAP, SourceRow, TableRow, read_rows, source_rows

PLACE: Final = "_hfsm_place"
"""The attribute of an exception that has its place with it, as text."""


def source_map(file: str, table: Iterable[TableRow]) -> tuple[SourceRow, ...]:
    """Return the rows of the table at the end of a component, in the order of its lines.

    The component's `file` is read now, so that the map stays that of the running code when the file changes.
    """
    linecache.checkcache(file)
    return source_rows("".join(linecache.getlines(file)), table)


def sources_of(namespace: Mapping[str, object]) -> set[str]:
    """Return the names of the files in which the code of a component stands; `namespace` is its module's."""
    return {SourceRow(*row).file for row in _rows(namespace)}


def last_line(error: BaseException, file: str) -> tuple[int, SourceRow | None]:
    """Return the innermost line of a component's file in a traceback, and the row of its code.

    The line is 0 when the file is not involved; the row is None for a generated line.
    """
    return _first_line(reversed([*walk_tb(error.__traceback__)]), file)


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


def line_of_frame(frame: FrameType, file: str) -> tuple[int, SourceRow | None]:
    """Return which line of a component a thread executes, and the row of its code, as `last_line` does."""
    return _first_line(walk_stack(frame), file)


def _first_line(lines: Iterable[tuple[FrameType, int]], file: str) -> tuple[int, SourceRow | None]:
    for frame, line in lines:
        if frame.f_code.co_filename == file:
            return line, _row_of(line, frame.f_globals, file)
    return 0, None


def tell_place(error: Exception, place: str) -> None:
    """Give an exception its place, if that is known, where `locate` would find none in the document."""
    if place:
        with suppress(Exception):  # it may be of a class of the document
            setattr(error, PLACE, place)


def place_of_result(function: Callable[..., object]) -> tuple[str, str]:
    """Return where a function of a component returns its value, in the form of `locate`, and its file.

    Of several places it is the first; the texts are empty for what is no function of a component.
    """
    code = getattr(function, "__code__", None)
    if not isinstance(code, CodeType):
        return "", ""
    lines = [
        each.positions.lineno
        for each in dis.get_instructions(code)
        if each.opname.startswith("RETURN_") and each.positions is not None and each.positions.lineno
    ]
    namespace = getattr(function, "__globals__", {})
    rows = [(line, _row_of(line, namespace, code.co_filename)) for line in lines]
    line, row = next(((line, row) for line, row in rows if row is not None), (0, None))
    return (_place(line, row, code.co_filename) if line else ""), code.co_filename


def place_of_assignment(functions: Iterable[Callable[..., object]], name: str) -> str:
    """Return where the first function that assigns an outer variable does so last, in the form of `locate`.

    To delete it counts, too. The text is empty if none of them does.
    """
    for function in functions:
        code = getattr(function, "__code__", None)
        if not isinstance(code, CodeType):
            continue
        stores = [
            each.positions.lineno
            for each in dis.get_instructions(code)
            if each.opname in ("STORE_DEREF", "DELETE_DEREF")
            and each.argval == name
            and each.positions is not None
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
    row = SourceRow(*rows[index])  # the code that follows the `def`
    lines = linecache.getlines(code.co_filename)[row.first - 1 : row.last]
    return " ".join(" ".join(MARK.sub("", line) for line in lines).split()).removeprefix("return ")


def _place(line: int, row: SourceRow | None, file: str) -> str:
    place = f"{Path(file).name}:{line}"
    return f"{place} ({row.place_of(line)})" if row else place


def _row_of(line: int, namespace: Mapping[str, object], file: str) -> SourceRow | None:
    """Return the row of a line of a component; None for a generated line."""
    # While the module is being imported it has no map yet.
    rows = _rows(namespace) or read_rows("".join(linecache.getlines(file)))
    index = bisect_right(rows, line, key=itemgetter(0)) - 1
    row = SourceRow(*rows[index]) if index >= 0 else None
    return row if row and line <= row.last else None


def _rows(namespace: Mapping[str, object]) -> tuple[Any, ...]:
    table = namespace.get(SOURCE_MAP)
    return table if isinstance(table, tuple) else ()
