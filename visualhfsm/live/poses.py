"""What the page needs to draw the robot and its world in 3D: geometry, the world, then each moment.

The angles come from the encoders, the torso's tilt from the robot's health; where a simulation publishes the
ground truth, everything is placed by it. The first frame is `nao_h25.json`; of the others those with `world`
have the shapes of the world, and every other one is a `BodyState`, all JSON. The page computes the places of
the links (`static/monitor/body.js`).
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncGenerator, Sequence
from importlib import resources
from typing import Final

import msgspec

from hfsm_recording.messages import Shape
from visualhfsm.monitoring.robot import RobotMonitor
from visualhfsm.monitoring.world import Placement

PERIOD: Final = 1 / 30
_REPEAT: Final = 1.0
"""Seconds after which a state that has not changed is sent again."""
_FILE: Final = "nao_h25.json"
"""Written by naoserver_sim.geometry; this package imports no robot server."""


class BodyState(msgspec.Struct, frozen=True):
    """What is known of the robot and of what moves around it at one moment."""

    joints: dict[str, float]
    """Angles in rad; none while they are unknown."""
    tilt: float | None
    """The angle in rad between the torso's z axis and the vertical."""
    torso: Placement | None
    """Where a simulation has the torso."""
    objects: dict[str, Placement]
    """The balls and what else can move, by name, as far as they are known."""


class PoseStream:
    """The robot and the world of one realm, as they are drawn."""

    def __init__(self, robot: RobotMonitor) -> None:
        self._robot = robot
        self._geometry = (resources.files(__package__) / _FILE).read_bytes()

    async def frames(self) -> AsyncGenerator[bytes, None]:
        """Yield the geometry, the world, then states at most 30 times a second whenever they have changed.

        When another world is there, it comes before the next state.
        """
        yield self._geometry
        world: Sequence[Shape] | None = None
        before, sent = b"", -math.inf
        while True:
            began = time.monotonic()
            if self._robot.world.shapes is not world:
                world = self._robot.world.shapes
                yield msgspec.json.encode({"world": world})
            state = msgspec.json.encode(self.state())
            if state != before or began - sent > _REPEAT:
                before, sent = state, began
                yield state
            await asyncio.sleep(max(0.0, began + PERIOD - time.monotonic()))

    def state(self) -> BodyState:
        """Return what is known now."""
        robot, world = self._robot, self._robot.world
        return BodyState(robot.joints(), robot.tilt(), world.torso(), world.objects())
