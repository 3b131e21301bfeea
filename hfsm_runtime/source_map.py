"""Lead an exception in a generated component back to the line of its document."""

from __future__ import annotations

import linecache
import re
import traceback
from pathlib import Path
from types import TracebackType

__all__ = ["locate", "part_of_component"]


def locate(error: BaseException, file: str, document: str) -> str:
    """Return where an exception was raised in a component, as `follow_ball.py:57 (follow_ball.xml:31)`.

    `file` is the component's file and `document` the name of its document. The innermost line of the file
    counts; above each piece of code the generator writes the line of the next one in the document, or in the
    file that the document imports, as a comment. Where no such comment stands, only the line of the file is
    told; empty when the file is not involved.
    """
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == file and f.lineno]
    if not frames:
        return ""
    line = frames[-1].lineno or 0
    place = f"{Path(file).name}:{line}"
    written = _written_at(file, line, document)
    return f"{place} ({written})" if written else place


def part_of_component(error: BaseException, file: str) -> TracebackType | None:
    """Return the traceback of an exception from a component's own code on, without what called it."""
    found = error.__traceback__
    while found is not None and found.tb_frame.f_code.co_filename != file:
        found = found.tb_next
    return found or error.__traceback__


def _written_at(file: str, line: int, document: str) -> str:
    """Return the file and the line that a person wrote which stands in a line of the component."""
    marker = re.compile(rf"\s*# ({re.escape(document)}|.+\.xml):(\d+)\s*", re.IGNORECASE)
    lines = linecache.getlines(file)
    for number in range(min(line, len(lines)), 0, -1):
        found = marker.fullmatch(lines[number - 1])
        if found:
            return f"{found.group(1)}:{int(found.group(2)) + line - number - 1}"
    return ""
