"""What can be made to go wrong with a robot that is served as NAOqi, and to be felt, to test its clients."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from fnmatch import fnmatchcase

from naoserver.capabilities import Senses, SonarReading
from naoserver.errors import HardwareFailure
from naoserver.fake.robot import FakeSenses
from naoserver_qi.arguments import number, text, texts

__all__ = ["Faults", "FaultsService"]


class Faults:
    """Which calls are late or fail. Nothing goes wrong unless it is asked for."""

    def __init__(self, *, enabled: bool = False) -> None:
        self.enabled = enabled
        """Whether anything may be asked to go wrong."""
        self._lock = threading.Lock()
        self._delays: dict[str, float] = {}  # replaced as a whole
        self._errors: dict[str, str] = {}
        self._forgotten: frozenset[str] = frozenset()
        self.blind = False
        """Whether the cameras give no picture."""

    def delay(self, name: str) -> float:
        """Return by how many wall seconds a call such as `ALMotion::setAngles` is late."""
        delays = self._delays
        return max(
            (seconds for pattern, seconds in delays.items() if fnmatchcase(name, pattern)), default=0.0
        )

    def strike(self, name: str) -> None:
        """Raise HardwareFailure when a call is to fail."""
        for pattern, message in self._errors.items():
            if fnmatchcase(name, pattern):
                raise HardwareFailure(message)

    def slow(self, pattern: str, seconds: float) -> None:
        """Let calls whose names match be late by some wall seconds; 0 ends it."""
        with self._lock:
            self._delays = {**self._delays, pattern: seconds}

    def fail(self, pattern: str, message: str) -> None:
        """Let calls whose names match fail with a message; an empty one ends it."""
        with self._lock:
            errors = {**self._errors, pattern: message}
            self._errors = {key: value for key, value in errors.items() if value}

    def forget(self, pattern: str) -> None:
        """Let ALMemory know nothing under keys that match."""
        with self._lock:
            self._forgotten |= {pattern}

    def knows(self, key: str) -> bool:
        """Return whether ALMemory may know something under a key."""
        return not any(fnmatchcase(key, pattern) for pattern in self._forgotten)

    def clear(self) -> None:
        """Let everything go well again."""
        with self._lock:
            self._delays, self._errors, self.blind = {}, {}, False
            self._forgotten = frozenset()


class FaultsService:
    """The service `Faults`, for tests in another process; the names of calls are patterns as of a shell."""

    def __init__(self, faults: Faults, senses: Senses | None, interrupt: Callable[[float], None]) -> None:
        """Serve `faults`; `interrupt` closes all connections for some wall seconds."""
        self._faults = faults
        self._senses = senses
        self._interrupt = interrupt

    def slow(self, pattern: object, seconds: object) -> None:
        """Let calls such as `ALMotion::*` be late by some wall seconds; 0 ends it."""
        self._faults.slow(text(pattern, "pattern"), number(seconds, "seconds"))

    def fail(self, pattern: object, message: object) -> None:
        """Let calls fail with a message; an empty one ends it."""
        self._faults.fail(text(pattern, "pattern"), text(message, "message"))

    def forget(self, pattern: object) -> None:
        """Let ALMemory know nothing under keys that match, as other robots and versions do not."""
        self._faults.forget(text(pattern, "pattern"))

    def blind(self, yes: object) -> None:
        """Let the cameras give no picture."""
        self._faults.blind = bool(yes)

    def disconnect(self, seconds: object) -> None:
        """Close every connection, and listen again after some wall seconds."""
        self._interrupt(number(seconds, "seconds"))

    def touch(self, names: object) -> None:
        """Let a fake robot be touched at some sensors, such as HeadFront, and at no other."""
        self._fake.feel(touched=frozenset(texts(names, "names")))

    def near(self, left: object, right: object) -> None:
        """Let the sonar of a fake robot feel something at distances in m."""
        self._fake.feel(sonar=SonarReading(number(left, "left"), number(right, "right")))

    def tilt(self, roll: object, pitch: object) -> None:
        """Let a fake robot feel that its torso is tilted, in rad."""
        before = self._fake.read().inertial
        self._fake.feel(inertial=replace(before, roll=number(roll, "roll"), pitch=number(pitch, "pitch")))

    def clear(self) -> None:
        """Let everything go well again."""
        self._faults.clear()

    @property
    def _fake(self) -> FakeSenses:
        if not isinstance(self._senses, FakeSenses):
            raise HardwareFailure("this robot feels by itself")
        return self._senses
