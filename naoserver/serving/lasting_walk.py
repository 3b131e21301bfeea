"""A walk that lasts as long as a program says, which does not renew it: entrances for makers' programs do."""

from __future__ import annotations

import logging
import threading
from dataclasses import asdict, dataclass
from math import inf
from typing import Final

from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.errors import HardwareFailure, RobotError
from naoserver.moves.walk import WalkGuard
from naoserver.serving.assembly import Assembly

_logger = logging.getLogger(__name__)

RENEWAL: Final = 0.15
"""Wall seconds after which a velocity is renewed: well within the guard's timeout."""


@dataclass(frozen=True, slots=True)
class _Velocity:
    """A velocity as the guard has limited it, its client, and its end in robot time."""

    value: WalkVelocity
    client: str
    end: float


class LastingWalk:
    """Walk through the guard, which stops what is not renewed; `renew` is due every RENEWAL.

    A velocity lasts for its time, or until a stop, another command, a fall, the emergency stop, or the loss
    of its client ends it. Thread-safe.
    """

    def __init__(self, assembly: Assembly) -> None:
        self._walk = assembly.walk
        self._robot_time = assembly.events.robot_time
        self._lock = threading.Lock()
        self._wanted: _Velocity | None = None
        self._newest = ""

    @property
    def guard(self) -> WalkGuard:
        """The walk behind its safety layer. Raises HardwareFailure when there is none."""
        if self._walk is None:
            raise HardwareFailure("this robot does not walk")
        return self._walk

    @property
    def active(self) -> bool:
        """Whether a velocity is commanded, of whomever."""
        return self._walk is not None and self._walk.commanded() != STILL

    @property
    def moving(self) -> bool:
        """Whether the walk has the legs: from a command until the robot stands again."""
        return self.active or (self._walk is not None and self._walk.watch() is not None)

    def moves_for(self, client: str) -> bool:
        """Return whether it moves by the command of a client, which was the last one here."""
        return self.guard.moves_for(client) if self.active else self._newest == client and self.moving

    def go(
        self, velocity: WalkVelocity, client: str, limits: WalkVelocity | None = None, seconds: float = inf
    ) -> None:
        """Walk at a velocity within limits for some robot seconds. Raises as `WalkGuard.drive` does."""
        with self._lock:
            self.guard.drive(asdict(velocity), client, limits)
            self._wanted = _Velocity(self.guard.commanded(), client, self._robot_time() + seconds)
            self._newest = client

    def stop(self) -> None:
        """End the walk of any client, on both feet if it has feet; never refused."""
        with self._lock:
            self._wanted = None
            if self._walk is not None:
                self._walk.stop()

    def drop(self, client: str = "") -> None:
        """Renew the velocity of a client no more, or that of any client."""
        with self._lock:
            if self._wanted is not None and client in ("", self._wanted.client):
                self._wanted = None

    def renew(self) -> None:
        """Renew the velocity, unless something has ended it; end it when its time is over."""
        with self._lock:
            wanted = self._wanted
            if wanted is None or wanted.value == STILL:
                return
            over = self._robot_time() >= wanted.end
            velocity = STILL if over else wanted.value
            try:
                self.guard.drive(asdict(velocity), wanted.client, after=wanted.value)
            except RobotError as error:
                if not over:
                    _logger.warning("the walk ends: %s", error)
                over = True
            if over:
                self._wanted = None
