"""How the servers of a team hear each other: a medium carries the messages of all, and may lose them."""

from __future__ import annotations

import itertools
import logging
import math
import secrets
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Final, Protocol

from interfaces.nao import TeamPrx
from zenoh_ice import SystemException
from zenoh_ice.data.keys import Target, check_name
from zenoh_ice.data.wire import encode_sample_attachment
from zenoh_ice.transport import Outlet, Registration, Transport

REPORT: Final = TeamPrx.ice_interface.all_operations["getReport"]
"""The operation whose result a message is."""
_MOST_WAITING: Final = 64
"""Messages that wait to be read; later ones push the oldest out."""
_MOST_A_SECOND: Final = 400.0
"""Messages that are read: those of 16 robots in haste. Of a flood the newest are."""

_logger = logging.getLogger(__name__)


class Medium(Protocol):
    """Carry messages to all robots of a team, as the air does; thread-safe."""

    def send(self, team: str, message: bytes) -> None:
        """Send a message to everybody of a team; it waits for nobody, and may be lost."""

    def subscribe(self, team: str, callback: Callable[[bytes], object]) -> Registration:
        """Call a function with each message of a team, perhaps also those sent from here, until closed."""


@dataclass(frozen=True)
class Membership:
    """Which robot of which team a server is; without a medium it is a team of one."""

    name: str
    """The realm of its server."""
    team: str = ""
    medium: Medium | None = None
    session: int = field(default_factory=lambda: secrets.randbits(53))
    """Another number for each start of the server."""


class StreamMedium:
    """Carry messages over a transport: the stream `Team.getReport` of the team's realm.

    No servant is there: each robot publishes to it and listens to it, and anybody else may listen, too.
    """

    def __init__(self, transport: Transport) -> None:
        self._transport: Final = transport
        self._outlets: Final[dict[str, Outlet]] = {}
        self._end: Final = ExitStack()
        self._numbers: Final = itertools.count(1)
        self._stream: Final = f"{secrets.randbits(64):016x}"

    def send(self, team: str, message: bytes) -> None:
        if (outlet := self._outlets.get(team)) is None:
            outlet = self._outlets[team] = self._transport.publish(_target(team), REPORT)
            self._end.callback(outlet.close)
        interface = TeamPrx.ice_interface
        about = encode_sample_attachment(interface.fingerprint, next(self._numbers), math.nan, self._stream)
        outlet.put(message, about)

    def subscribe(self, team: str, callback: Callable[[bytes], object]) -> Registration:
        inlet = self._transport.subscribe(_target(team), REPORT, _MOST_WAITING)

        def read(raw: object) -> None:
            try:
                callback(bytes(inlet.open(raw).payload))  # type: ignore[arg-type]
            except SystemException as error:
                _logger.warning("team %s: %s", team, error)

        heard = Registration(inlet.close)
        self._end.callback(heard.close)
        inlet.deliver(read, _MOST_A_SECOND)
        return heard

    def close(self) -> None:
        """Send and hear nothing any more."""
        self._end.close()


def _target(team: str) -> Target:
    return Target(check_name(f"team.{team}", "team"), "Team")
