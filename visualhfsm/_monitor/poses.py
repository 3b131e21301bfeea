"""Data with which the page draws the robot and its world in 3D: which robot, the world, then each moment.

The angles come from the encoders, the torso's tilt from the robot's health; where a simulation publishes the
ground truth, it determines all places. All frames are JSON: those with a field `body` name the robot by the
hash of its description, which the page asks for once, those with a field `world` contain the shapes of the
world, those with a field `heard` what the robot says and plays, those with a field `failing` what of it can
fail and what does, and the others are a `BodyState`. The page computes the places of the links
(`static/robot3d/body.js`).
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncGenerator, Mapping, Sequence
from typing import Final

import msgspec

from hfsm_runtime.recording_file.messages import Shape
from visualhfsm._base.languages import ENGLISH, encoder
from visualhfsm._monitor.realm.faults import NOTHING
from visualhfsm._monitor.realm.robot import RobotMonitor
from visualhfsm._monitor.realm.world import Placement

PERIOD: Final = 1 / 30
_REPEAT: Final = 1.0
"""Seconds after which a state that has not changed is sent again."""


class OtherState(msgspec.Struct, frozen=True):
    """Another robot of the world, whose place is that of the object of its name."""

    body: str
    """The hash of its description."""
    joints: dict[str, float]


class BodyState(msgspec.Struct, frozen=True):
    """The robot and the movable objects around it at one moment, as far as they are known."""

    joints: dict[str, float]
    """Angles in rad; none while they are unknown."""
    tilt: float | None
    """The angle in rad between the torso's z axis and the vertical."""
    torso: Placement | None
    """The place of the torso, known only in a simulation."""
    objects: dict[str, Placement]
    """The balls and other movable objects by name, as far as they are known, and other robots."""
    others: dict[str, OtherState]
    """The other robots of the world by their realms, as far as they can be drawn."""


class PoseStream:
    """The robot and the world of one realm, as they are drawn."""

    def __init__(self, robot: RobotMonitor) -> None:
        self._robot = robot

    async def frames(self, language: str = ENGLISH) -> AsyncGenerator[bytes, None]:
        """Yield the robot, the world, then states at most 30 times a second whenever they have changed.

        Another robot, a new world, what is heard and what fails are sent before the next state; why a robot
        cannot be drawn, and how it can fail, is said in a language, one of LANGUAGES.
        """
        encode = encoder(language).encode
        body = b""
        world: Sequence[Shape] | None = None
        heard = ("", "")
        failing = NOTHING
        before, sent = b"", -math.inf
        while True:
            began = time.monotonic()
            drawn = encode(self._body())
            if drawn != body:
                body = drawn
                yield drawn
            if self._robot.world.shapes is not world:
                world = self._robot.world.shapes
                yield encode({"world": world})
            if (now := self._robot.heard()) != heard:
                heard = now
                yield encode({"heard": dict(zip(("says", "sound"), heard, strict=True))})
            if (fails := self._robot.faults.failing()) != failing:
                failing = fails
                yield encode({"failing": failing})
            state = encode(self.state())
            if state != before or began - sent > _REPEAT:
                before, sent = state, began
                yield state
            await asyncio.sleep(max(0.0, began + PERIOD - time.monotonic()))

    def _body(self) -> Mapping[str, str]:
        """Return the hash of the robot's description, or why it cannot be drawn."""
        described = self._robot.described
        return {"body": described.hash if described else "", "why": self._robot.undescribed}

    def state(self) -> BodyState:
        """Return the present state, as far as it is known."""
        robot, world = self._robot, self._robot.world
        others = {
            name: OtherState(described.hash, body.joints())
            for name, (body, described) in robot.others.bodies().items()
        }
        return BodyState(robot.joints(), robot.tilt(), world.torso(), world.objects(), others)
