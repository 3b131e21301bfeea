"""The world around the robot: its shapes, and where things are, as far as a simulation reports them.

Without a simulation, the balls are placed by the encoders of the mechanisms that carry them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import msgspec

from hfsm_runtime.recording_file.messages import Shape, values_of
from interfaces.jderobot import Pose3DEncodersPrx
from interfaces.nao import GroundTruthPrx, ScenePrx, ShapeKind
from visualhfsm._monitor.realm.realm import Newest, PolledValue
from zenoh_ice import Communicator

MOST_SHAPES: Final = 1000
_MOST_OBJECTS: Final = 100
_FARTHEST_OBJECT: Final = 1000.0
"""Metres from the origin within which objects are shown."""
_LONGEST_NAME: Final = 64
_STALE: Final = 2.0
"""Wall seconds after which a place is too old."""
_DIGITS: Final = 4
"""Objects that move by less than 0.1 mm count as resting."""
_BALLS: Final = ("BallGreen", "BallRed")
_BALL_RADIUS: Final = 0.06
_BALL_COLORS: Final = {"BallGreen": (0.02, 0.85, 0.05), "BallRed": (0.95, 0.02, 0.02)}
_KINDS: Final = frozenset(kind.name.lower() for kind in ShapeKind)
_SCENE: Final = "Scene"

Placement = tuple[float, float, float, float, float, float, float]
"""A position in m, and a unit quaternion (x, y, z, w)."""


_DEFAULT: Final = tuple(
    Shape(name, "sphere", [_BALL_RADIUS, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [*color])
    for name, color in _BALL_COLORS.items()
)
"""The world when no simulation reports one: balls, shown if their places are known."""


class WorldMonitor:
    """Listen to the world of a realm; `update` it a few times a second."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator = communicator
        proxy = communicator.stringToProxy
        self._truth = Newest(GroundTruthPrx.uncheckedCast(proxy("GroundTruth")).getGroundTruth.latest, _STALE)
        self._encoders = {
            name: Newest(
                Pose3DEncodersPrx.uncheckedCast(proxy(f"{name}Encoders")).getPose3DEncodersData.latest, _STALE
            )
            for name in _BALLS
        }
        self._reported = PolledValue(ScenePrx.uncheckedCast(proxy(_SCENE)).getShapes.begin)
        self.shapes: Sequence[Shape] = _DEFAULT
        """The shapes of the world; a new object after each change."""

    def update(self) -> None:
        """Request the shapes of a simulation that has appeared; forget those of one that has left."""
        known = self._reported.value
        if _SCENE in self._communicator.identities():
            reported = self._reported.poll()
            if known is None and reported is not None:
                self.shapes = sound_shapes(map(Shape.of, reported))
        elif known is not None:
            self._reported.forget()
            self.shapes = _DEFAULT

    def torso(self) -> Placement | None:
        """Return the place of the torso in a simulation; None while it is unknown."""
        truth = self._truth()
        return None if truth is None else sound_placement(values_of(truth.value.torso))

    def objects(self) -> dict[str, Placement]:
        """Return the places of all movable objects, as far as they are known."""
        truth = self._truth()
        if truth is None:
            carried = {name: self._carried(name) for name in self._encoders}
            return {name: at for name, at in carried.items() if at is not None}
        return sound_objects({name: values_of(pose) for name, pose in truth.value.objects.items()})

    def others(self) -> list[str]:
        """Return what has a place and no shape: the other robots of the world, by their realms."""
        shaped = {shape.object for shape in self.shapes}
        known = self._reported.value is not None and self._truth() is not None
        return [name for name in self.objects() if name not in shaped] if known else []

    def _carried(self, name: str) -> Placement | None:
        """Return where a ball is: its mechanism turns by `pan`, reaches out by `x` and lifts by `z`."""
        sample = self._encoders[name]()
        if sample is None or not math.isfinite(sample.value.pan):
            return None
        arm = sample.value
        return sound_placement(
            (arm.x * math.cos(arm.pan), arm.x * math.sin(arm.pan), arm.z, 0.0, 0.0, 0.0, 1.0)
        )


def sound_shapes(reported: Iterable[Shape]) -> tuple[Shape, ...]:
    """Return the shapes that can be drawn, the first `MOST_SHAPES` of them: any process may report any."""
    found = map(_sound_shape, reported)
    return tuple(itertools.islice((shape for shape in found if shape is not None), MOST_SHAPES))


def _sound_shape(shape: Shape) -> Shape | None:
    """Return a shape as the page draws it; None when it cannot be drawn."""
    place = sound_placement(shape.at)
    size = shape.size
    color = shape.color
    if place is None or len(size) != 3 or len(color) != 3 or len(shape.object) > _LONGEST_NAME:
        return None
    sizes = all(0.0 <= value <= _FARTHEST_OBJECT for value in size) and size[0] > 0.0
    shares = all(0.0 <= value <= 1.0 for value in (*color, shape.opacity))
    if not sizes or not shares or shape.kind not in _KINDS:
        return None
    return msgspec.structs.replace(shape, at=[*place])


def sound_objects(reported: Mapping[str, Sequence[float]]) -> dict[str, Placement]:
    """Return the valid places of objects, of at most as many objects as are shown."""
    found: dict[str, Placement] = {}
    for name, values in reported.items():
        at = sound_placement(values)
        if at is not None and len(name) <= _LONGEST_NAME and len(found) < _MOST_OBJECTS:
            found[name] = at
    return found


def sound_placement(values: Sequence[float]) -> Placement | None:
    """Return a place, rounded; None when it is not finite, too far, or its quaternion not of length 1."""
    if len(values) != 7 or not all(abs(value) <= _FARTHEST_OBJECT for value in values):
        return None
    if abs(math.hypot(*values[3:]) - 1.0) > 0.01:
        return None
    x, y, z, i, j, k, w = (round(value, _DIGITS) + 0.0 for value in values)
    return x, y, z, i, j, k, w
