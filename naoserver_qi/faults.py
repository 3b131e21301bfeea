"""What can be made to go wrong with a robot that is served as NAOqi, and to be felt, to test its clients."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Final

from naoserver.capabilities import Senses, SonarReading
from naoserver.errors import HardwareFailure
from naoserver.fake.robot import FakeSenses
from naoserver_qi.arguments import number, text, texts


class Faults:
    """The service `Faults`: make calls late or fail, and a fake robot feel something.

    Patterns of the names of calls, such as `ALMotion::setAngles`, and of keys are those of a shell. Nothing
    goes wrong unless it is asked for.
    """

    def __init__(
        self,
        senses: Senses | None = None,
        interrupt: Callable[[float], None] = lambda _seconds: None,
        *,
        enabled: bool = False,
    ) -> None:
        """Serve a robot with some senses; `interrupt` closes all connections for some wall seconds."""
        self.enabled: Final = enabled
        """Whether clients can reach this service."""
        self._senses = senses
        self._interrupt = interrupt
        self.clear()

    def clear(self) -> None:
        """Make everything go well again."""
        self._delays: dict[str, float] = {}  # wall seconds, by pattern
        self._errors: dict[str, str] = {}  # messages, by pattern; empty for none
        self._forgotten: set[str] = set()
        self._blind = False

    def slow(self, pattern: object, seconds: object) -> None:
        """Make calls such as `ALMotion::*` late by some wall seconds; 0 ends it."""
        self._delays[text(pattern, "pattern")] = number(seconds, "seconds")

    def fail(self, pattern: object, message: object) -> None:
        """Make calls fail with a message; an empty one ends it."""
        self._errors[text(pattern, "pattern")] = text(message, "message")

    def forget(self, pattern: object) -> None:
        """Make ALMemory know nothing under keys that match, as other robots and versions do not."""
        self._forgotten.add(text(pattern, "pattern"))

    def blind(self, yes: object) -> None:
        """Make the cameras give no picture."""
        self._blind = bool(yes)

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

    @property
    def _fake(self) -> FakeSenses:
        if not isinstance(self._senses, FakeSenses):
            raise HardwareFailure("this robot feels by itself")
        return self._senses

    # Calls read copies, since a client may change what is to go wrong meanwhile.

    def _delay(self, name: str) -> float:
        """Return by how many wall seconds a call is late."""
        delays = self._delays.copy()
        return max((delays[pattern] for pattern in delays if fnmatchcase(name, pattern)), default=0.0)

    def _strike(self, name: str) -> None:
        """Raise HardwareFailure when a call is to fail."""
        for pattern, message in self._errors.copy().items():
            if message and fnmatchcase(name, pattern):
                raise HardwareFailure(message)

    def _knows(self, key: str) -> bool:
        """Return whether ALMemory may know something under a key."""
        return not any(fnmatchcase(key, pattern) for pattern in self._forgotten.copy())
