"""Robots that break the contract of `naoserver.robot`, each in one way."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from naoserver.fake import FakeRobot
from naoserver.robot import BodyState, JointReading
from tests.support.robot_server import clock_at
from tests.support.small_robots import ARM

__all__ = ["Blocks", "CountsOn", "Forgets", "HurriesOn", "IgnoresSpeeds", "Jumps", "RunsOn", "Swaps"]

FAST: Final = 100.0


class _Arm(FakeRobot):
    def __init__(self) -> None:
        super().__init__(clock_at(1.0), body=ARM)


class Swaps(_Arm):
    """Its readings are in another order than its joints."""

    def read(self) -> JointReading:
        reading = super().read()
        return replace(reading, positions=reading.positions[::-1], commands=reading.commands[::-1])


class IgnoresSpeeds(_Arm):
    """It moves as fast as it can."""

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        super().command_positions(targets, dict.fromkeys(max_speeds, FAST))


class Blocks(_Arm):
    """It asks its servos whenever it is read."""

    def read(self) -> JointReading:
        time.sleep(0.01)
        return super().read()


class RunsOn(_Arm):
    """It takes a velocity of 0 for none."""

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        super().command_velocities({name: velocity for name, velocity in velocities.items() if velocity})


class Forgets(_Arm):
    """It takes velocities for 0."""

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        super().command_velocities(dict.fromkeys(velocities, 0.0))


class Jumps(_Arm):
    """What was commanded while a joint was limp is done when it becomes stiff again."""

    _kept: Mapping[str, float] = {}

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        self._kept = targets
        super().command_positions(targets, max_speeds)

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:
        super().command_stiffnesses(stiffnesses, seconds)
        kept = {name: target for name, target in self._kept.items() if stiffnesses.get(name)}
        super().command_positions(kept, dict.fromkeys(kept, FAST))


class CountsOn(_Arm):
    """Its time goes on when it is closed."""

    def read(self) -> JointReading:
        return replace(super().read(), time=self.clock.now())


class HurriesOn(_Arm):
    """It is told to be upright, and says that it has fallen."""

    def state(self) -> BodyState:
        return replace(super().state(), fallen=True)


def half_a_robot() -> Any:
    """Make what has joints, and is no robot."""
    return _Arm().read()
