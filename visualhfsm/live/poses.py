"""What the page needs to draw the robot in 3D: its geometry, then its state at each moment.

The angles come from the encoders, the torso's tilt from the robot's health; where a simulation publishes the
ground truth, the robot and the balls are placed by it. The first frame is `nao_h25.json`, every other one a
`BodyState`, all JSON. The page computes the places of the links (`static/monitor/body.js`).
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import AsyncGenerator
from importlib import resources
from typing import Final

import msgspec

from interfaces.jderobot import Pose3DEncodersPrx
from interfaces.nao import GroundTruthPrx, GroundTruthReading
from visualhfsm.monitoring.realm import Newest
from visualhfsm.monitoring.robot import RobotMonitor
from zenoh_ice import Communicator

__all__ = ["BodyState", "PoseStream"]

PERIOD: Final = 1 / 30
_REPEAT: Final = 1.0
"""Seconds after which a state that has not changed is sent again."""
_STALE: Final = 2.0
_FILE: Final = "nao_h25.json"
"""Written by naoserver_sim.geometry; this package imports no robot server."""


class BodyState(msgspec.Struct, frozen=True):
    """What is known of the robot and the balls at one moment."""

    joints: dict[str, float]
    """Angles in rad; none while they are unknown."""
    tilt: float | None
    """The angle in rad between the torso's z axis and the vertical."""
    torso: tuple[float, ...] | None
    """Where a simulation has the torso: position in m, and a quaternion (x, y, z, w)."""
    balls: dict[str, tuple[float, float, float]]
    """Positions in m of those that are known."""


class PoseStream:
    """The robot and the balls of one realm, as they are drawn."""

    def __init__(self, communicator: Communicator, robot: RobotMonitor) -> None:
        self._robot = robot
        self._geometry = (resources.files(__package__) / _FILE).read_bytes()
        self._balls = {
            name: Newest(
                Pose3DEncodersPrx.uncheckedCast(
                    communicator.stringToProxy(f"{name}Encoders")
                ).getPose3DEncodersData.latest,
                _STALE,
            )
            for name in json.loads(self._geometry)["balls"]
        }
        self._truth = Newest(
            GroundTruthPrx.uncheckedCast(communicator.stringToProxy("GroundTruth")).getGroundTruth.latest,
            _STALE,
        )

    async def frames(self) -> AsyncGenerator[bytes, None]:
        """Yield the geometry, then states at most 30 times a second whenever they have changed."""
        yield self._geometry
        before, sent = b"", -math.inf
        while True:
            began = time.monotonic()
            state = msgspec.json.encode(self.state())
            if state != before or began - sent > _REPEAT:
                before, sent = state, began
                yield state
            await asyncio.sleep(max(0.0, began + PERIOD - time.monotonic()))

    def state(self) -> BodyState:
        """Return what is known now."""
        sample = self._truth()
        truth = None if sample is None else sample.value
        balls = {name: self._ball(name, truth) for name in self._balls}
        return BodyState(
            joints=self._robot.joints(),
            tilt=self._robot.tilt(),
            torso=None if truth is None else _torso(truth),
            balls={name: at for name, at in balls.items() if all(map(math.isfinite, at))},
        )

    def _ball(self, name: str, truth: GroundTruthReading | None) -> tuple[float, float, float]:
        """Return where a ball is: its mechanism turns by `pan`, reaches out by `x` and lifts by `z`.

        NaN is what is not known.
        """
        if truth is not None and name in truth.objects:
            at = truth.objects[name].position
            return at.x, at.y, at.z
        sample = self._balls[name]()
        if sample is None or not math.isfinite(sample.value.pan):
            return math.nan, math.nan, math.nan
        arm = sample.value
        return arm.x * math.cos(arm.pan), arm.x * math.sin(arm.pan), arm.z


def _torso(truth: GroundTruthReading) -> tuple[float, ...] | None:
    at, turn = truth.torso.position, truth.torso.orientation
    pose = at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w
    return pose if all(map(math.isfinite, pose)) else None
