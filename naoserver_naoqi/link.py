"""What this package needs of a connection to NAOqi: calls by name, and to be told when it is lost."""

from __future__ import annotations

import threading
from typing import Any, Protocol

from naoserver.errors import HardwareFailure

__all__ = ["CallFailed", "CallTimeout", "Link", "LinkLost", "Reply", "call"]


class CallFailed(HardwareFailure):
    """NAOqi refused a call, or has no such service or method; the message is NAOqi's, behind the call."""


class CallTimeout(HardwareFailure):
    """NAOqi did not answer in time. The call may still be obeyed."""


class LinkLost(HardwareFailure):
    """There is no connection to the robot, or it broke during the call."""


class Reply(Protocol):
    """The answer to a call that was begun."""

    @property
    def done(self) -> bool:
        """Whether it has come, or can come no more."""
        ...

    def result(self, timeout: float) -> Any:  # noqa: ANN401 - whatever NAOqi answers
        """Return what was answered within some seconds. Raises CallFailed, CallTimeout or LinkLost."""
        ...


class Link(Protocol):
    """A connection to NAOqi. Any thread may use it."""

    @property
    def lost(self) -> threading.Event:
        """Set as soon as the connection is known to be gone."""
        ...

    def begin(self, operation: str, *arguments: object) -> Reply:
        """Begin a call such as `ALMotion.setAngles` without waiting for the answer.

        Whatever goes wrong is told by the reply.
        """
        ...

    def close(self) -> None:
        """Hang up; every call that goes on ends with LinkLost. Does nothing the second time."""
        ...


def call(link: Link, operation: str, *arguments: object, timeout: float = 2.0) -> Any:  # noqa: ANN401
    """Return what NAOqi answers to a call within some seconds.

    Raises CallFailed, CallTimeout or LinkLost.
    """
    return link.begin(operation, *arguments).result(timeout)
