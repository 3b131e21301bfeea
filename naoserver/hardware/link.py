"""A link to hardware, the answers to calls over it, and its failures."""

from __future__ import annotations

import threading
from typing import Any, Final, Protocol

from naoserver.errors import HardwareFailure


class CallFailed(HardwareFailure):
    """The hardware refused a call, or does not know it; the message says why, behind the call."""


class CallTimeout(HardwareFailure):
    """The hardware did not answer in time. The call may still be executed."""


class LinkLost(HardwareFailure):
    """There is no link to the hardware, or it broke during the call."""


class Link(Protocol):
    """A link to hardware, such as an open serial line."""

    @property
    def lost(self) -> threading.Event:
        """Set as soon as the link is known to be gone."""

    def close(self) -> None:
        """Close the link; running calls end with LinkLost. Does nothing the second time."""


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
