"""What senses, cameras and eyes report while parts of a robot fail."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies import faults as parts
from naoserver.bodies.capabilities import (
    Eyes,
    InertialReading,
    SeenThing,
    SenseReading,
    SightReading,
    SonarReading,
)
from naoserver.bodies.faults import Fault
from naoserver.body import Body
from naoserver.protocol.faults import Faults
from naoserver.protocol.robot import Frame
from naoserver.soccer_field import Field

_HALF_AS_FAR: Final = 4.0
"""Blur in pixels with which eyes see things half as far; assumed."""
_MOST_LATE: Final = 200
"""Pictures that wait while they are late."""

T = TypeVar("T")


class FailingSenses:
    """Report what senses report while parts fail, in place of what they would. Thread-safe.

    What is asked while nothing fails passes unchanged.
    """

    def __init__(self, faults: Faults, body: Body) -> None:
        self._faults: Final = faults
        self._touch: Final = frozenset(body.touch_sensors)
        self._farthest: Final = {kind: facts.farthest for kind, facts in body.sight.kinds.items()}
        self._rates: Final = {camera.name: max(camera.rates, default=1.0) for camera in body.cameras}
        self._lock: Final = threading.Lock()
        self._kept: dict[tuple[Fault, object], Any] = {}

    @property
    def active(self) -> bool:
        """Whether anything fails."""
        return bool(self._faults.current())

    def inertial(self, reading: InertialReading, time: float) -> InertialReading:
        """Return a reading of the inertial unit at a time in s."""
        if not (present := self._faults.current()):
            return reading
        if (parts.INERTIAL, "dead") in present:
            return InertialReading((0.0, 0.0, 0.0))
        if fault := present.get((parts.INERTIAL, "drifting")):
            about_x, about_y, about_z = reading.angular_velocity
            return replace(
                reading,
                angular_velocity=(about_x, about_y + fault.amount, about_z),
                pitch=reading.pitch + fault.amount * max(0.0, time - fault.begin),
            )
        return reading

    def feet(self, reading: tuple[T, T], nothing: T) -> tuple[T, T]:
        """Return readings of the left and the right sole; `nothing` is that of a sole without load."""
        if not (present := self._faults.current()):
            return reading
        if (parts.FEET, "dead") in present:
            return nothing, nothing
        if fault := present.get((parts.FEET, "stuck")):
            return self._keep(fault, type(nothing), lambda: reading)
        return reading

    def others(self, reading: SenseReading) -> SenseReading:
        """Return a reading of all senses with that of sonar, touch and battery changed."""
        if not (present := self._faults.current()):
            return reading
        if (parts.SONAR, "dead") in present:
            reading = replace(reading, sonar=SonarReading())
        elif fault := present.get((parts.SONAR, "stuck")):
            heard = reading.sonar
            reading = replace(reading, sonar=self._keep(fault, None, lambda: heard))
        if fault := present.get((parts.BATTERY, "low")):
            charge = min(reading.battery.charge, fault.amount)
            reading = replace(reading, battery=replace(reading.battery, charge=charge))
        touched = reading.touched | {part for part, kind in present if kind == "stuck"} & self._touch
        touched -= {part for part, kind in present if kind == "dead"}
        return reading if touched == reading.touched else replace(reading, touched=touched)

    def frame(self, camera: str, size: tuple[int, int], capture: Callable[[], Frame]) -> Frame:
        """Return a picture of a camera; `capture` takes one."""
        if not (present := self._faults.current()):
            return capture()
        failing = {kind: fault for (part, kind), fault in present.items() if part == camera}
        if not failing:
            return capture()
        if fault := failing.get("frozen"):
            frame = self._keep(fault, size, capture)
        elif fault := failing.get("halved"):
            frame = self._sometimes(fault, size, capture)
        else:
            frame = capture()
        if fault := failing.get("late"):
            frame = self._late(fault, size, frame)
        if "black" in failing:
            return replace(frame, pixels=np.zeros_like(frame.pixels))
        if fault := failing.get("blurred"):
            return replace(frame, pixels=_blurred(frame.pixels, fault.amount))
        return frame

    def sight(self, reading: SightReading) -> SightReading:
        """Return what eyes see that look through the cameras."""
        if not (present := self._faults.current()):
            return reading
        time, things = -math.inf, list[SeenThing]()
        for camera in self._rates:
            own = SightReading(
                reading.time, tuple(thing for thing in reading.things if thing.camera == camera)
            )
            failing = {kind: fault for (part, kind), fault in present.items() if part == camera}
            shown = self._seen(own, failing) if failing else own
            time = max(time, shown.time)  # that of the newest picture, if some are frozen or late
            things += shown.things
        things.sort(key=lambda thing: (thing.kind, -thing.certainty))
        return SightReading(time, tuple(things))

    def _seen(self, reading: SightReading, failing: Mapping[str, Fault]) -> SightReading:
        """Return what one camera shows while it fails."""
        if "black" in failing:
            return replace(reading, things=())
        if fault := failing.get("frozen"):
            now = reading
            reading = self._keep(fault, SightReading, lambda: now)
        elif fault := failing.get("halved"):
            now = reading
            reading = self._sometimes(fault, SightReading, lambda: now)
        if fault := failing.get("late"):
            reading = self._late(fault, SightReading, reading)
        if fault := failing.get("blurred"):
            share = 1.0 / (1.0 + fault.amount / _HALF_AS_FAR)
            near = tuple(
                thing
                for thing in reading.things
                if thing.distance < share * self._farthest.get(thing.kind, math.inf)
            )
            return replace(reading, things=near)
        return reading

    def _keep(self, fault: Fault, what: object, take: Callable[[], T]) -> T:
        """Return what was there when something began to fail, or was asked for the first time since."""
        kept: T
        if (fault, what) in (known := self._kept):
            kept = known[fault, what]
            return kept
        taken = take()  # a picture may take a second: others do not wait for it
        with self._lock:
            present = set(self._faults.current().values())
            known = {of: value for of, value in self._kept.items() if of[0] in present}
            kept = known.setdefault((fault, what), taken)
            self._kept = known
            return kept

    def _sometimes(self, fault: Fault, what: object, take: Callable[[], Any]) -> Any:  # noqa: ANN401
        """Return something that is taken at a share of a camera's rate."""
        newest: list[Any] = self._keep(fault, what, list)
        period = 1.0 / (fault.amount * self._rates[fault.part])
        if not newest or not 0.0 <= self._faults.now() - newest[0] < period - 1e-6:
            newest[:] = self._faults.now(), take()
        return newest[1]

    def _late(self, fault: Fault, what: object, newest: Any) -> Any:  # noqa: ANN401 - anything with a time
        """Return what was there some time ago, or the oldest since it began to be late."""
        waiting: deque[Any] = self._keep(fault, ("late", what), lambda: deque(maxlen=_MOST_LATE))
        with self._lock:
            if not waiting or waiting[-1].time != newest.time:
                waiting.append(newest)
            while len(waiting) > 1 and waiting[1].time <= self._faults.now() - fault.amount:
                waiting.popleft()
            return waiting[0]


class FailingEyes:
    """Eyes that look through cameras which may fail. Implements Eyes."""

    def __init__(self, eyes: Eyes, senses: FailingSenses) -> None:
        self._eyes: Final = eyes
        self._senses: Final = senses

    @property
    def field(self) -> Field:
        """The field that they look for."""
        return self._eyes.field

    def look(self) -> SightReading:
        """Return what is seen now, through cameras that may fail."""
        return self._senses.sight(self._eyes.look())


def _blurred(pixels: NDArray[np.uint8], width: float) -> NDArray[np.uint8]:
    """Return a picture of shape (height, width, 3), smeared twice over a square: about a Gaussian."""
    half = max(1, round(width))
    found: NDArray[np.floating] = pixels.astype(np.float32)
    for axis in (0, 1, 0, 1):
        padding = [(half + 1, half) if each == axis else (0, 0) for each in range(3)]
        sums = np.cumsum(np.pad(found, padding, mode="edge"), axis=axis)
        size, count = 2 * half + 1, found.shape[axis]
        found = (np.take(sums, range(size, size + count), axis) - np.take(sums, range(count), axis)) / size
    return np.asarray(np.rint(found).clip(0, 255), np.uint8)
