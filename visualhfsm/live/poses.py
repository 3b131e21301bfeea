"""The robot's pose in 3D: where the links of its body are, and the stream of poses that the page draws.

The angles come from the encoders, the torso's tilt from the robot's health; where a simulation knows the
ground truth, the robot and the balls are where that says. The first frame of the stream is JSON:
`nao_h25.json` with the `order` of the poses. Every other frame is float32, little-endian, 7 numbers for each
name of the order: position in m, and a quaternion (x, y, z, w). What is not known is NaN, and should not be
drawn.

Rotations are unit quaternions (x, y, z, w). Every link's frame sits at its parent joint and is parallel to
the torso's when all joints are 0.
"""

from __future__ import annotations

import array
import asyncio
import json
import math
import sys
import time
from collections.abc import AsyncGenerator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import resources
from typing import Any, Final, NamedTuple

from interfaces import nao
from interfaces.jderobot import Pose3DEncodersPrx
from interfaces.nao import GroundTruthPrx, GroundTruthReading
from visualhfsm.monitoring.realm import Newest
from visualhfsm.monitoring.robot import RobotMonitor
from zenoh_ice import Communicator

__all__ = ["BodyGeometry", "Pose", "PoseStream", "load_body"]

PERIOD: Final = 1 / 30
_REPEAT: Final = 1.0
"""Seconds after which poses that have not changed are sent again."""
_STALE: Final = 2.0
_FILE: Final = "nao_h25.json"
"""Made by naoserver_sim.geometry of the facts that robot servers have, of which this package imports none."""
_LEVEL: Final = 0.005
"""Metres by which the other sole must fit better for the body to stand on that one."""

_UNSTEADY: Final = 0.35
"""Radians that a body may be off the pose in which its soles stand level; beyond that it has fallen."""
_LEANING: Final = 0.1
"""Sine of the angle from which on it is known where to a torso leans."""
_THICKNESS: Final = 0.05
"""Metres from the origins of the links of a body that lies to the floor, about."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Pose(NamedTuple):
    """A position in m and a rotation."""

    position: Vector
    rotation: Quaternion


_IDENTITY: Final = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
_UNKNOWN: Final = Pose((math.nan,) * 3, (math.nan,) * 4)


class PoseStream:
    """Poses of the robot and the balls of one realm."""

    def __init__(self, communicator: Communicator, robot: RobotMonitor) -> None:
        self._robot = robot
        self._body: BodyGeometry = load_body()
        described: dict[str, Any] = json.loads(self._body.text)
        self._balls = {
            name: Newest(
                Pose3DEncodersPrx.uncheckedCast(
                    communicator.stringToProxy(f"{name}Encoders")
                ).getPose3DEncodersData.latest,
                _STALE,
            )
            for name in described["balls"]
        }
        self._truth = Newest(
            GroundTruthPrx.uncheckedCast(communicator.stringToProxy("GroundTruth")).getGroundTruth.latest,
            _STALE,
        )
        described["order"] = [*(link.name for link in self._body.links), *self._balls]
        self._geometry = json.dumps(described, separators=(",", ":")).encode()

    async def frames(self) -> AsyncGenerator[bytes, None]:
        """Yield the geometry, then poses at most 30 times a second whenever they have changed."""
        yield self._geometry
        before, sent = b"", -math.inf
        while True:
            began = time.monotonic()
            poses = self.poses()
            if poses != before or began - sent > _REPEAT:
                before, sent = poses, began
                yield poses
            await asyncio.sleep(max(0.0, began + PERIOD - time.monotonic()))

    def poses(self) -> bytes:
        """Return the poses as they are known now."""
        angles = self._robot.joints()
        sample = self._truth()
        truth = None if sample is None else sample.value
        known: dict[str, Pose] = {}
        if angles and truth is not None:
            known = self._body.poses_about(_pose(truth.torso), angles)
        elif angles:
            known = self._body.poses(angles, self._robot.tilt())
        numbers = array.array("f")
        for link in self._body.links:
            _append(numbers, known.get(link.name, _UNKNOWN))
        for name in self._balls:
            _append(numbers, self._ball(name, truth))
        if sys.byteorder == "big":
            numbers.byteswap()
        return numbers.tobytes()

    def _ball(self, name: str, truth: GroundTruthReading | None) -> Pose:
        """Return where a ball is: its mechanism turns by `pan`, reaches out by `x` and lifts by `z`."""
        if truth is not None and name in truth.objects:
            return _pose(truth.objects[name])
        sample = self._balls[name]()
        if sample is None:
            return _UNKNOWN
        at = sample.value
        return Pose((at.x * math.cos(at.pan), at.x * math.sin(at.pan), at.z), (0.0, 0.0, 0.0, 1.0))


def _pose(pose: nao.Pose) -> Pose:
    at, turn = pose.position, pose.orientation
    return Pose((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))


def _append(numbers: array.array[float], pose: Pose) -> None:
    numbers.extend(pose.position)
    numbers.extend(pose.rotation)


@dataclass(frozen=True, slots=True)
class Link:
    """A link, the joint that moves it and the link that carries that; the torso has neither."""

    name: str
    parent: str = ""
    joint: str = ""
    axis: Vector = (0.0, 0.0, 1.0)
    origin: Vector = (0.0, 0.0, 0.0)


class BodyGeometry:
    """A body as `nao_h25.json` beside this module describes it."""

    def __init__(self, text: str) -> None:
        self.text: Final = text
        """The description as JSON, for who draws it."""
        self._described: Mapping[str, Any] = json.loads(text)

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """The links, each after the one that carries it."""
        return tuple(
            Link(
                name=link["name"],
                parent=link.get("parent", ""),
                joint=link.get("joint", ""),
                axis=_vector(link.get("axis", (0, 0, 1))),
                origin=_vector(link.get("origin", (0, 0, 0))),
            )
            for link in self._described["links"]
        )

    @cached_property
    def _soles(self) -> dict[str, tuple[Vector, ...]]:
        return {
            foot: tuple(_vector(point) for point in outline)
            for foot, outline in self._described["soles"].items()
        }

    def poses_in_torso(self, angles: Mapping[str, float]) -> dict[str, Pose]:
        """Return the pose of each link in the torso's frame; `angles` in rad by joint, else 0."""
        found: dict[str, Pose] = {}
        for link in self.links:
            parent = found.get(link.parent)
            if parent is None:
                found[link.name] = _IDENTITY
                continue
            angle = angles.get(link.joint, 0.0)
            found[link.name] = Pose(
                _moved(parent, link.origin), _product(parent.rotation, _about(link.axis, angle))
            )
        return found

    def poses_about(self, torso: Pose, angles: Mapping[str, float]) -> dict[str, Pose]:
        """Return the pose of each link in the world, in which the torso is known to be so."""
        return _about_torso(torso, self.poses_in_torso(angles))

    def poses(self, angles: Mapping[str, float], tilt: float | None = None) -> dict[str, Pose]:
        """Return the pose of each link in the world, in which the body stands level on one of its soles.

        No encoder tells where the torso is: the floor is taken to be below that sole, x to be where the torso
        looks, and the origin to lie between the feet, as when the robot was put there. When `tilt`, the angle
        in rad between the torso's z axis and the vertical, says that it cannot stand so, it has fallen over:
        further the way that it leans, or else forward.
        """
        in_torso = self.poses_in_torso(angles)
        torso = self._standing(in_torso)
        if tilt is not None:
            torso = _fallen(torso, in_torso.values(), tilt)
        return _about_torso(torso, in_torso)

    def _standing(self, in_torso: Mapping[str, Pose]) -> Pose:
        """Return the pose of the torso: that sole is on the floor below which the other one reaches least."""
        feet = {name: in_torso[name] for name in self._soles if name in in_torso}
        if not feet:
            return _IDENTITY
        best: Pose | None = None
        least = math.inf
        for name, foot in feet.items():
            level = Pose((0.0, 0.0, 0.0), _without_yaw(_conjugate(foot.rotation)))
            floor = self._lowest(level, name, foot)
            below = floor - min(self._lowest(level, other, pose) for other, pose in feet.items())
            if best is None or below < least - _LEVEL:
                x, y, _ = _moved(level, _middle([pose.position for pose in feet.values()]))
                best, least = Pose((-x, -y, -floor), level.rotation), below
        assert best is not None, "there are feet"
        return best

    def _lowest(self, frame: Pose, name: str, foot: Pose) -> float:
        return min(_moved(frame, _moved(foot, point))[2] for point in self._soles[name])


def _about_torso(torso: Pose, in_torso: Mapping[str, Pose]) -> dict[str, Pose]:
    return {
        name: Pose(_moved(torso, pose.position), _product(torso.rotation, pose.rotation))
        for name, pose in in_torso.items()
    }


def _fallen(torso: Pose, in_torso: Iterable[Pose], tilt: float) -> Pose:
    """Return the pose of a torso that is tilted so, unless it is that about; all links are on the floor."""
    x, y, z = _moved(Pose((0.0, 0.0, 0.0), torso.rotation), (0.0, 0.0, 1.0))
    further = tilt - math.acos(min(1.0, max(-1.0, z)))
    if abs(further) < _UNSTEADY:
        return torso
    lean = math.hypot(x, y)
    axis = (-y / lean, x / lean, 0.0) if lean > _LEANING else (0.0, 1.0, 0.0)
    over = Pose((0.0, 0.0, 0.0), _about(axis, further))
    turned = Pose(_moved(over, torso.position), _product(over.rotation, torso.rotation))
    lowest = min(_moved(turned, pose.position)[2] for pose in in_torso)
    x, y, z = turned.position
    return Pose((x, y, z - lowest + _THICKNESS), turned.rotation)


@lru_cache(maxsize=1)
def load_body() -> BodyGeometry:
    """Return the body of the H25."""
    return BodyGeometry((resources.files(__package__) / _FILE).read_text(encoding="utf-8"))


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _middle(points: Sequence[Vector]) -> Vector:
    x, y, z = (sum(values) / len(points) for values in zip(*points, strict=True))
    return x, y, z


def _about(axis: Vector, angle: float) -> Quaternion:
    sine = math.sin(angle / 2)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(angle / 2)


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    return (
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    )


def _conjugate(a: Quaternion) -> Quaternion:
    return -a[0], -a[1], -a[2], a[3]


def _moved(pose: Pose, point: Vector) -> Vector:
    """Return a point of a frame in the frame that the pose is given in."""
    (qx, qy, qz, qw), (x, y, z) = pose.rotation, point
    # Twice the cross product of the quaternion's vector with the point.
    tx, ty, tz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        pose.position[0] + x + qw * tx + qy * tz - qz * ty,
        pose.position[1] + y + qw * ty + qz * tx - qx * tz,
        pose.position[2] + z + qw * tz + qx * ty - qy * tx,
    )


def _without_yaw(rotation: Quaternion) -> Quaternion:
    """Return a rotation turned about the vertical so that its x axis looks along the world's."""
    x, y, _ = _moved(Pose((0.0, 0.0, 0.0), rotation), (1.0, 0.0, 0.0))
    return _product(_about((0.0, 0.0, 1.0), -math.atan2(y, x)), rotation)
