"""The view in 3D: the robot's geometry once, then poses from its encoders, its tilt, and those of the balls.

Where a simulation tells the ground truth, the robot and the balls are where that says.

The first frame is JSON: `nao_h25.json` with the `order` of the poses. Every other frame is float32, little-
endian, 7 numbers for each name of the order: position in m, and a quaternion (x, y, z, w). What is not known
is NaN, and should not be drawn.
"""

from __future__ import annotations

import array
import asyncio
import json
import math
import sys
import time
from collections.abc import AsyncGenerator
from typing import Any, Final

from interfaces import nao
from interfaces.jderobot import Pose3DEncodersPrx
from interfaces.nao import GroundTruthPrx, GroundTruthReading
from visualhfsm.watch.streams import Newest
from zenoh_ice import Communicator

from .kinematics import BodyGeometry, Pose, load_body
from .robot import RobotWatch

__all__ = ["Scene"]

PERIOD: Final = 1 / 30
_REPEAT: Final = 1.0
"""Seconds after which poses that have not changed are sent again."""
_STALE: Final = 2.0
_UNKNOWN: Final = Pose((math.nan,) * 3, (math.nan,) * 4)


class Scene:
    """What there is to see of one realm."""

    def __init__(self, communicator: Communicator, robot: RobotWatch) -> None:
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
