"""The address of a NAOqi, and its model."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Self
from urllib.parse import urlsplit

from naoserver.hardware.connection import CallFailed
from visualhfsm_naoqi.robot.calls import CallLink, call

NAME: Final = "naoserver-naoqi"
"""Name of subscriptions of cameras and sonar, by which those of an earlier server are found."""


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


def is_nao6(link: CallLink) -> bool:
    """Return whether the robot is a NAO6, not an earlier model. Raises CallTimeout or LinkLost."""
    try:
        version = str(call(link, "ALMemory.getData", "RobotConfig/Head/BaseVersion"))
    except CallFailed:
        return False
    return version.upper().replace("VERSION_", "V").startswith("V6")
