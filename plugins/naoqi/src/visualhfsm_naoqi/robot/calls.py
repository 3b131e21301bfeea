"""Calls by name over a link to hardware, whose answers may come late, or never."""

from __future__ import annotations

from typing import Any, Final, Protocol, TypeAlias

from naoserver.errors import HardwareFailure
from naoserver.hardware.connection import Connection, Link


class CallTimeout(HardwareFailure):
    """The hardware did not answer in time. The call may still be executed."""


class Reply(Protocol):
    """The answer to a call that was begun."""

    @property
    def done(self) -> bool:
        """Whether the answer has arrived, or can no longer arrive."""

    def result(self, timeout: float) -> Any:  # noqa: ANN401 - whatever the hardware answers
        """Return the answer within some seconds. Raises CallFailed, CallTimeout or LinkLost."""


class CallLink(Link, Protocol):
    """A link over which calls are made by name. Any thread may use it."""

    def begin(self, operation: str, *arguments: object) -> Reply:
        """Begin a call such as `ALMotion.setAngles` without waiting for the answer.

        The reply reports every failure.
        """


class Failure:
    """The answer to a call that could not be begun. Implements Reply."""

    done: Final = True

    def __init__(self, error: Exception) -> None:
        self._error = error

    def result(self, timeout: float) -> Any:  # noqa: ANN401, ARG002
        """Raise the reason."""
        raise self._error


def call(link: CallLink, operation: str, *arguments: object, timeout: float = 2.0) -> Any:  # noqa: ANN401
    """Return the answer to a call within some seconds. Raises CallFailed, CallTimeout or LinkLost."""
    return link.begin(operation, *arguments).result(timeout)


CallConnection: TypeAlias = Connection[CallLink]
"""The connection to hardware that answers calls by name."""
