"""The senses of the fake robot: they tell what a test lets them feel."""

from __future__ import annotations

import math
import threading
from dataclasses import replace
from typing import Final, TypedDict, Unpack

from naoserver.body import H25
from naoserver.capabilities import BatteryReading, FootReading, InertialReading, SenseReading, SonarReading
from zenoh_ice import Clock

_GRAVITY: Final = 9.81  # m/s2
_WEIGHT: Final = _GRAVITY * sum(link.mass for link in H25.links)  # N
_HALF: Final = FootReading(*[_WEIGHT / 8] * 4)


class Feelings(TypedDict, total=False):
    """What can be felt: fields of `SenseReading`."""

    inertial: InertialReading
    left_foot: FootReading
    right_foot: FootReading
    sonar: SonarReading
    touched: frozenset[str]
    battery: BatteryReading


class FakeSenses:
    """Feel what it is to stand still, with nothing near, until told otherwise. Implements Senses."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._reading = SenseReading(
            time=clock.now(),
            inertial=InertialReading((0.0, 0.0, _GRAVITY), (0.0, 0.0, 0.0), roll=0.0, pitch=0.0),
            left_foot=_HALF,
            right_foot=_HALF,
            sonar=SonarReading(),
            touched=frozenset(),
            battery=BatteryReading(charge=0.8, current=-1.9, temperature=30.0, plugged=False),
        )

    @property
    def touch_names(self) -> tuple[str, ...]:
        """The touch sensors of an H25."""
        return H25.touch_sensors

    @property
    def sonar_range(self) -> tuple[float, float]:
        """Nearest and farthest distance that the sonar tells in m."""
        return 0.25, 2.55

    @property
    def sonar_cone(self) -> float:
        """Full angle of the sonar's cone in rad."""
        return math.radians(60.0)

    def read(self) -> SenseReading:
        """Return what is felt now."""
        with self._lock:
            return replace(self._reading, time=self._clock.now())

    def feel(self, **feelings: Unpack[Feelings]) -> None:
        """Let some senses tell something from now on: a test's way to set a scene."""
        with self._lock:
            self._reading = replace(self._reading, **feelings)
