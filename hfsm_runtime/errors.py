"""Errors of a component: exceptions, and the reaction to one in user code."""

from __future__ import annotations

from enum import StrEnum
from types import TracebackType
from typing import Final

from zenoh_ice.data.text import encodable

_LONGEST_MESSAGE: Final = 4000


class ComponentError(Exception):
    """The base class of the runtime's errors about a component."""


class ArgumentError(ComponentError, TypeError):
    """The arguments of a state do not fit the inputs of its automata."""


class DefinitionError(ComponentError):
    """The automata of a component do not make sense, such as one without an initial state."""


class EventError(ComponentError, ValueError):
    """An event has an invalid name or invalid data, or may not come from outside."""


class MarkError(ComponentError, ValueError):
    """A mark has an invalid camera, place or label."""


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
    """A component cannot be replaced with the present version of its file; it continues unchanged."""


class UnknownElementError(ComponentError):
    """A request names something that the component does not have, or not now."""


class ValueTypeError(ComponentError, TypeError):
    """A value from outside has the wrong type, or is invalid."""


class VariablesError(ComponentError):
    """The variables of a document could not be initialized."""


class OnError(StrEnum):
    """Reaction to an exception in user code."""

    STOP = "stop"
    """The robot is stopped and the component halts."""
    CONTINUE = "continue"
    """Skip the code that failed and continue the cycle; a guard that failed does not hold."""


class OnRefused(StrEnum):
    """Reaction when the robot refuses a command."""

    PAUSE = "pause"
    """The component pauses until the robot accepts commands again."""
    ERROR = "error"
    """It is an exception like any other in user code."""


def describe(error: BaseException) -> str:
    """Return the name and at most 4000 characters of an exception, whose text is user code and may fail."""
    try:
        text = str(error)
    except BaseException:  # noqa: BLE001
        text = "its message is not available"
    return encodable(f"{type(error).__name__}: {text[:_LONGEST_MESSAGE]}")[:_LONGEST_MESSAGE]


def exit_code_of(end: SystemExit) -> int:
    """Return the exit code for which `sys.exit` was called."""
    if end.code is None:
        return 0
    return end.code & 0xFF if isinstance(end.code, int) else 1


def part_of_component(error: BaseException, file: str) -> TracebackType | None:
    """Return the traceback of an exception from a component's own code on, without its callers."""
    found = error.__traceback__
    while found is not None and found.tb_frame.f_code.co_filename != file:
        found = found.tb_next
    return found or error.__traceback__
