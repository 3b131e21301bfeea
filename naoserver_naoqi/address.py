"""Where a robot's NAOqi listens."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Self
from urllib.parse import urlsplit

__all__ = ["AddressError", "RobotAddress"]

_PORTS: Final = {"tcp": 9559, "tcps": 9503}


class AddressError(ValueError):
    """A text is no address of a robot."""


@dataclass(frozen=True, slots=True)
class RobotAddress:
    """Scheme, host and port of a NAOqi, and who logs in there."""

    scheme: str
    """`tcp`, or `tcps` of NAOqi 2.9 and later, which wants a login."""
    host: str
    port: int
    user: str = ""
    password: str = ""

    @classmethod
    def parse(cls, text: str, user: str = "", password: str = "") -> Self:
        """Return the address that `tcp://HOST[:PORT]`, `tcps://HOST[:PORT]` or a bare `HOST` stands for.

        Raises AddressError, which says what is wrong.
        """
        try:
            parts = urlsplit(text if "://" in text else f"tcp://{text}")
        except ValueError as error:
            raise AddressError(f"{text!r} is no address: {error}") from None
        if parts.scheme not in _PORTS:
            raise AddressError(f"{text!r} begins neither with tcp:// nor with tcps://")
        if parts.username or parts.password:
            raise AddressError("an address holds no login: give --user, and the password by the environment")
        if parts.path.strip("/") or parts.query or parts.fragment:
            raise AddressError(f"{text!r} has something behind the port")
        try:
            port = parts.port
        except ValueError:
            raise AddressError(f"{text!r} has no valid port") from None
        if not parts.hostname or port == 0:
            raise AddressError(f"{text!r} names no {'port' if parts.hostname else 'host'}")
        if parts.scheme == "tcps" and not (user and password):
            raise AddressError("a robot at tcps:// wants a login: give --user, and its password")
        return cls(parts.scheme, parts.hostname, port or _PORTS[parts.scheme], user, password)

    @property
    def url(self) -> str:
        """The address as libqi wants it, without the login."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"

    def __str__(self) -> str:
        return self.url

    def __repr__(self) -> str:
        return f"RobotAddress({self.url!r})"  # never the password
