"""The walk behind its safety layer: the one way by which servants command it."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Final

from interfaces.nao import Severity
from naoserver.capabilities import Walker, WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver.guarded_device import GuardedDevice
from naoserver.options import SafetyOptions

WALK: Final = "the walk"
"""Owner of the legs while it walks."""
_SOURCE: Final = "Walk"
_STILL: Final = WalkVelocity()
_LEG: Final = ("HipYawPitch", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
_LEGS: Final = [side + joint for side in "LR" for joint in _LEG]


@dataclass(frozen=True, slots=True)
class _Drive:
    """A velocity of one kind, its client, and its end in steady wall time."""

    value: float
    client: str
    deadline: float


class WalkGuard:
    """Pass velocities to `walker`, limited, and each for as long as its client renews it.

    The velocities forwards, to the left and of the turn are commanded one by one; each stops by itself. While
    it walks the legs of `body` belong to the walk. The gate of `body` lets each command through or refuses
    it, but nobody is refused to stop.
    """

    def __init__(self, walker: Walker, body: GuardedDevice, options: SafetyOptions) -> None:
        self.name: Final = WALK
        self.limits: Final = walker.limits
        """The highest velocity of each kind."""
        self.read: Final = walker.odometry
        """Return where the robot believes to be."""
        self.commanded: Final = walker.commanded
        """Return the velocity that is commanded, as it was limited."""
        self._walker = walker
        self._body = body
        self._events = body.events
        self._options = options
        self._highest: dict[str, float] = asdict(walker.limits)
        self._lock = threading.Lock()
        self._drives: dict[str, _Drive] = {}
        self._closed = False

    def drive(
        self,
        velocities: Mapping[str, float],
        client: str,
        limits: WalkVelocity | None = None,
        after: WalkVelocity | None = None,
    ) -> bool:
        """Walk at velocities, by fields of `WalkVelocity`, until the timeout; returns whether one was cut.

        `limits` are closer ones than those of the robot. With `after` it is refused unless that velocity is
        still commanded. Raises InvalidCommand or CommandRefused, and then commands nothing.
        """
        limitations = []
        with self._lock:
            if after is not None and self._walker.commanded() != after:
                raise InvalidCommand("walk", "the walk was stopped, or walks by another command now")
            if any(velocities.values()):  # everybody may stop it
                self._body.gate.require(client)
            drives = dict(self._drives)
            deadline = self._events.wall_time() + self._options.velocity_timeout
            for kind, velocity in velocities.items():
                if not math.isfinite(velocity):
                    raise InvalidCommand(kind, f"{kind} is {velocity}: it must be a finite number")
                highest = min(self._highest[kind], getattr(limits or self.limits, kind))
                safe = max(-highest, min(highest, velocity))
                if safe != velocity:
                    reason = f"{kind} velocity {velocity:.4g} is too high, limited to {safe:.4g}"
                    limitations.append((_SOURCE, reason))
                drives.pop(kind, None)
                if safe:
                    drives[kind] = _Drive(safe, client, deadline)
            if not self._closed:
                self._command(drives)
        self._events.add_limited(limitations)
        self._body.look_within(self._options.period)
        return bool(limitations)

    def stop(self) -> None:
        """End the walk, on both feet."""
        with self._lock:
            self._command({})

    def drop_client(self, client: str) -> None:
        """Stop what a lost client drives."""
        stopped = self._stop_where(lambda drive: drive.client == client)
        if stopped:
            kinds = " and ".join(stopped)
            message = f"stopped ({kinds}): the client that drove it is gone"
            self._events.add(Severity.Warning, _SOURCE, message, "lost")

    def watch(self) -> float | None:
        """Stop what was not renewed; return in how many wall seconds to look again, None while it rests."""
        now = self._events.wall_time()
        stopped = self._stop_where(lambda drive: now >= drive.deadline)
        if stopped:
            self._events.count_timeout()
            kinds, timeout = " and ".join(stopped), self._options.velocity_timeout
            message = f"stopped ({kinds}): its velocity was not renewed within {timeout:g} s"
            self._events.add(Severity.Warning, _SOURCE, message, "timeout")
        with self._lock:
            walking = self._walker.walking
            given_up = bool(self._drives) and not walking
            if given_up:
                self._drives = {}
            if not walking:
                self._body.free(WALK)  # where the legs stand now is where they are to be
        if given_up:
            message = "the robot ended the walk: it fell, its legs became limp, or it was moved"
            self._events.add(Severity.Error, _SOURCE, message, "ended")
        return self._options.period if walking else None

    def close(self) -> None:
        """End the walk and refuse further commands."""
        with self._lock:
            if not self._closed:
                self._command({})
                self._closed = True

    def _stop_where(self, condition: Callable[[_Drive], bool]) -> list[str]:
        """Stop the velocities that meet a condition; returns their kinds."""
        with self._lock:
            if not self._walker.walking:
                return []  # the robot has ended the walk, as `watch` reports
            stopped = [kind for kind, drive in self._drives.items() if condition(drive)]
            if stopped:
                self._command({kind: drive for kind, drive in self._drives.items() if kind not in stopped})
        return stopped

    def _command(self, drives: dict[str, _Drive]) -> None:
        """Command the walker. Raises InvalidCommand, and then commands nothing."""
        if not drives:
            self._drives = {}
            self._walker.command(_STILL)
            return
        self._body.claims.claim(WALK, _LEGS, self.stop)
        try:
            self._walker.command(WalkVelocity(**{kind: drive.value for kind, drive in drives.items()}))
        except InvalidCommand:
            if not self._walker.walking:
                self._drives = {}
                self._body.claims.release(WALK)
            raise
        self._drives = drives
