"""What can be made to go wrong with a robot that is served as NAOqi, and to be felt, to test its clients."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Final

from naoserver.capabilities import Senses, SonarReading
from naoserver.errors import HardwareFailure
from naoserver.fake.robot import FakeSenses
from naoserver_qi.arguments import number, text, texts

__all__ = ["Faults", "FaultsService"]


class Faults:
    """Which calls are late or fail. Nothing goes wrong unless it is asked for."""

    def __init__(self, *, enabled: bool = False) -> None:
        self.enabled: Final = enabled
        """Whether anything may be asked to go wrong."""
        self.clear()

    def clear(self) -> None:
        """Make everything go well again."""
        # Each of these is replaced as a whole.
        self.delays: Mapping[str, float] = {}
        """Wall seconds by which calls are late, by a pattern of their names."""
        self.errors: Mapping[str, str] = {}
        """The messages with which calls fail, by a pattern of their names; empty for none."""
        self.forgotten: frozenset[str] = frozenset()
        """Patterns of the keys that ALMemory does not know."""
        self.blind = False
        """Whether the cameras give no picture."""

    def delay(self, name: str) -> float:
        """Return by how many wall seconds a call such as `ALMotion::setAngles` is late."""
        matching = (seconds for pattern, seconds in self.delays.items() if fnmatchcase(name, pattern))
        return max(matching, default=0.0)

    def strike(self, name: str) -> None:
        """Raise HardwareFailure when a call is to fail."""
        for pattern, message in self.errors.items():
            if message and fnmatchcase(name, pattern):
                raise HardwareFailure(message)

    def knows(self, key: str) -> bool:
        """Return whether ALMemory may know something under a key."""
        return not any(fnmatchcase(key, pattern) for pattern in self.forgotten)


class FaultsService:
    """The service `Faults`, for tests in another process; the names of calls are patterns as of a shell."""

    def __init__(self, faults: Faults, senses: Senses | None, interrupt: Callable[[float], None]) -> None:
        """Serve `faults`; `interrupt` closes all connections for some wall seconds."""
        self._faults = faults
        self._senses = senses
        self._interrupt = interrupt
        self._lock = threading.Lock()

    def slow(self, pattern: object, seconds: object) -> None:
        """Make calls such as `ALMotion::*` late by some wall seconds; 0 ends it."""
        with self._lock:
            delay = {text(pattern, "pattern"): number(seconds, "seconds")}
            self._faults.delays = {**self._faults.delays, **delay}

    def fail(self, pattern: object, message: object) -> None:
        """Make calls fail with a message; an empty one ends it."""
        with self._lock:
            error = {text(pattern, "pattern"): text(message, "message")}
            self._faults.errors = {**self._faults.errors, **error}

    def forget(self, pattern: object) -> None:
        """Make ALMemory know nothing under keys that match, as other robots and versions do not."""
        with self._lock:
            self._faults.forgotten |= {text(pattern, "pattern")}

    def blind(self, yes: object) -> None:
        """Make the cameras give no picture."""
        self._faults.blind = bool(yes)

    def disconnect(self, seconds: object) -> None:
        """Close every connection, and listen again after some wall seconds."""
        self._interrupt(number(seconds, "seconds"))

    def touch(self, names: object) -> None:
        """Touch a fake robot at some sensors, such as HeadFront, and at no other."""
        self._fake.feel(touched=frozenset(texts(names, "names")))

    def near(self, left: object, right: object) -> None:
        """Put something before the sonar of a fake robot, at distances in m."""
        self._fake.feel(sonar=SonarReading(number(left, "left"), number(right, "right")))

    def tilt(self, roll: object, pitch: object) -> None:
        """Tilt the torso of a fake robot, in rad, as its inertial unit feels it."""
        before = self._fake.read().inertial
        self._fake.feel(inertial=replace(before, roll=number(roll, "roll"), pitch=number(pitch, "pitch")))

    def clear(self) -> None:
        """Make everything go well again."""
        with self._lock:
            self._faults.clear()

    @property
    def _fake(self) -> FakeSenses:
        if not isinstance(self._senses, FakeSenses):
            raise HardwareFailure("this robot feels by itself")
        return self._senses
