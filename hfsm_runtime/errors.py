"""What goes wrong with a component: exceptions, what follows one in user code, and where one was raised."""

from __future__ import annotations

import linecache
import re
import traceback
from enum import StrEnum
from pathlib import Path
from types import TracebackType
from typing import Final

_LONGEST: Final = 4000
_MARKER: Final = re.compile(r"\s*# (.+):(\d{1,9})(?:-(\d{1,9}))?\s*")
"""What the generator writes above each piece of code: file, first line, and the last of several."""


class ComponentError(Exception):
    """The root of what the runtime raises about a component."""


class ArgumentError(ComponentError, TypeError):
    """A state hands something to an input of its automata that the input cannot be."""


class DefinitionError(ComponentError):
    """The automata of a component do not make sense, such as one without an initial state."""


class EventError(ComponentError, ValueError):
    """An event cannot be sent with such a name or such data."""


class MarkError(ComponentError, ValueError):
    """Nothing can be marked on a picture like this."""


class MissingLibraryError(ComponentError, ImportError):
    """A library that the document names is not installed, or cannot be imported."""


class ComponentStoppedError(BaseException):
    """The component ends: raised out of `self.sleep`, so that no cycle outlives its component.

    It is no Exception, so that `except Exception` in user code lets it pass.
    """


class CycleCutError(BaseException):
    """The running cycle has to end now: raised out of `self.sleep`, and not reported.

    Either an ancestor has left the state above, or the component pauses. It is no Exception, so that
    `except Exception` in user code lets it pass.
    """


class NotConnectedError(ComponentError, AttributeError):
    """A proxy was used before the component was connected."""


class ReloadRefusedError(ComponentError):
    """A component cannot be replaced by what its file holds now; it runs on as it was."""


class UnknownElementError(ComponentError):
    """A request names something that the component does not have, or not now."""


class ValueTypeError(ComponentError, TypeError):
    """A value from outside is not of the type of what it is for, or is no value at all."""


class VariablesError(ComponentError):
    """The variables of a document could not be given their first values."""


class OnError(StrEnum):
    """What follows an exception in user code."""

    STOP = "stop"
    """The robot is stopped and the component halts."""
    CONTINUE = "continue"
    """The piece of code that failed is left and the cycle goes on; a guard that failed does not hold."""


class OnRefused(StrEnum):
    """What follows when the robot refuses a command."""

    PAUSE = "pause"
    """The component pauses until the robot takes commands again."""
    ERROR = "error"
    """It is an exception like any other in user code."""


def describe(error: BaseException) -> str:
    """Return the name and at most 4000 characters of an exception, whose text is user code and may fail."""
    try:
        text = str(error)
    except Exception:  # noqa: BLE001
        text = "its text cannot be had"
    return f"{type(error).__name__}: {text}"[:_LONGEST]


def locate(error: BaseException, file: str, document: str) -> str:
    """Return where an exception was raised in a component, as `follow_ball.py:57 (follow_ball.xml:31)`.

    `file` is the component's file and `document` the name of its document. The innermost line of the file
    counts; above each piece of code the generator writes its lines in the document, or in the file that the
    document imports, as a comment. For any other line only that of the file is returned; the text is empty
    when the file is not involved.
    """
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == file and f.lineno]
    if not frames:
        return ""
    line = frames[-1].lineno or 0
    place = f"{Path(file).name}:{line}"
    written = _written_at(file, line) if document else ""
    return f"{place} ({written})" if written else place


def part_of_component(error: BaseException, file: str) -> TracebackType | None:
    """Return the traceback of an exception from a component's own code on, without what called it."""
    found = error.__traceback__
    while found is not None and found.tb_frame.f_code.co_filename != file:
        found = found.tb_next
    return found or error.__traceback__


def _written_at(file: str, line: int) -> str:
    """Return the file and the line that a person wrote which stands in a line of the component.

    The lines below a comment of the generator are skipped: a person's comment there may look the same.
    """
    lines = linecache.getlines(file)
    number = 1
    while number < min(line, len(lines)):
        found = _MARKER.fullmatch(lines[number - 1])
        number += 1
        if found:
            first = int(found[2])
            count = max(0, int(found[3] or first) - first + 1)
            if line < number + count:
                return f"{found[1]}:{first + line - number}"
            number += count
    return ""
