"""The protocol of connections to NAOqi: their address, calls by name, and their loss."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any, Final, Protocol, Self
from urllib.parse import urlsplit

from naoserver.errors import HardwareFailure

NAME: Final = "naoserver-naoqi"
"""Name of subscriptions of cameras and sonar, by which those of an earlier server are found."""


class CallFailed(HardwareFailure):
    """NAOqi refused a call, or has no such service or method; the message is NAOqi's, behind the call."""


class CallTimeout(HardwareFailure):
    """NAOqi did not answer in time. The call may still be executed."""


class LinkLost(HardwareFailure):
    """There is no connection to the robot, or it broke during the call."""


class Reply(Protocol):
    """The answer to a call that was begun."""

    @property
    def done(self) -> bool:
        """Whether the answer has arrived, or can no longer arrive."""

    def result(self, timeout: float) -> Any:  # noqa: ANN401 - whatever NAOqi answers
        """Return the answer within some seconds. Raises CallFailed, CallTimeout or LinkLost."""


class Link(Protocol):
    """A connection to NAOqi. Any thread may use it."""

    @property
    def lost(self) -> threading.Event:
        """Set as soon as the connection is known to be gone."""

    def begin(self, operation: str, *arguments: object) -> Reply:
        """Begin a call such as `ALMotion.setAngles` without waiting for the answer.

        The reply reports every failure.
        """

    def close(self) -> None:
        """Close the link; running calls end with LinkLost. Does nothing the second time."""


class Failure:
    """The answer to a call that could not be begun. Implements Reply."""

    done: Final = True

    def __init__(self, error: Exception) -> None:
        self._error = error

    def result(self, timeout: float) -> Any:  # noqa: ANN401, ARG002
        """Raise the reason."""
        raise self._error


def call(link: Link, operation: str, *arguments: object, timeout: float = 2.0) -> Any:  # noqa: ANN401
    """Return what NAOqi answers within some seconds. Raises CallFailed, CallTimeout or LinkLost."""
    return link.begin(operation, *arguments).result(timeout)


_PORTS: Final = {"tcp": 9559, "tcps": 9503}


class AddressError(ValueError):
    """A text is no address of a robot."""


@dataclass(frozen=True, slots=True)
class RobotAddress:
    """Scheme, host and port of a NAOqi, and the login."""

    scheme: str
    """`tcp`, or `tcps` for NAOqi 2.9 and later, which requires a login."""
    host: str
    port: int
    user: str = ""
    password: str = field(default="", repr=False)

    @classmethod
    def parse(cls, text: str, user: str = "", password: str = "") -> Self:
        """Return the address given by `tcp://HOST[:PORT]`, `tcps://HOST[:PORT]` or a bare `HOST`.

        Raises AddressError with the reason.
        """
        try:
            parts = urlsplit(text if "://" in text else f"tcp://{text}")
        except ValueError as error:
            raise AddressError(f"{text!r} is not an address: {error}") from None
        if parts.scheme not in _PORTS:
            raise AddressError(f"{text!r} must begin with tcp:// or tcps://")
        if parts.username or parts.password:
            raise AddressError(
                "an address must not contain a login: give --user, and the password by the environment"
            )
        if parts.path.strip("/") or parts.query or parts.fragment:
            raise AddressError(f"{text!r} has text after the port")
        try:
            port = parts.port
        except ValueError:
            raise AddressError(f"{text!r} has no valid port") from None
        if not parts.hostname or port == 0:
            raise AddressError(f"{text!r} names no {'port' if parts.hostname else 'host'}")
        if parts.scheme == "tcps" and not (user and password):
            raise AddressError("a robot at tcps:// requires a login: give --user, and its password")
        return cls(parts.scheme, parts.hostname, port or _PORTS[parts.scheme], user, password)

    @property
    def url(self) -> str:
        """The address in libqi's format, without the login."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"

    def __str__(self) -> str:
        return self.url


def is_nao6(link: Link) -> bool:
    """Return whether the robot is a NAO6, not an earlier model. Raises CallTimeout or LinkLost."""
    try:
        version = str(call(link, "ALMemory.getData", "RobotConfig/Head/BaseVersion"))
    except CallFailed:
        return False
    return version.upper().replace("VERSION_", "V").startswith("V6")
