"""Servant of the scene: put things somewhere, push the robot, press its sensors. Of a simulation only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from interfaces.nao import Scene, Vector3
from naoserver.capabilities import Stage, Vector
from naoserver.servants.conversions import refusals_told, require_finite
from zenoh_ice import Current


class SceneI(Scene):
    """Set the scene of a simulation: no command of the robot, so that no lease and no stop holds it.

    `end_motion` ends what the robot does: a robot that is put elsewhere does not go on with it there.
    """

    def __init__(self, stage: Stage, end_motion: Callable[[], None]) -> None:
        self._stage: Final = stage
        self._end_motion: Final = end_motion

    def reset(self, current: Current) -> None:  # noqa: ARG002
        """Put the robot and everything else back to where they began; what the robot does ends."""
        self._end_motion()
        self._stage.reset()

    def getObjects(self, current: Current) -> list[str]:  # noqa: ARG002
        """Return the names of what can be placed."""
        return list(self._stage.objects)

    def placeObject(self, name: str, position: Vector3, current: Current) -> None:  # noqa: ARG002
        """Put something somewhere, at rest. Raises InvalidValueException."""
        with refusals_told():
            self._stage.place_object(name, _finite(position))

    def placeRobot(self, x: float, y: float, heading: float, current: Current) -> None:  # noqa: ARG002
        """Put the robot on its feet somewhere; what it does ends. Raises InvalidValueException."""
        require_finite(x=x, y=y, heading=heading)
        with refusals_told():
            self._stage.place_robot(x, y, heading)
        self._end_motion()

    def pushRobot(self, force: Vector3, seconds: float, current: Current) -> None:  # noqa: ARG002
        """Push the torso for some seconds. Raises InvalidValueException."""
        require_finite(seconds=seconds)
        with refusals_told():
            self._stage.push(_finite(force), seconds)

    def pressSensor(self, name: str, seconds: float, current: Current) -> None:  # noqa: ARG002
        """Press a touch sensor for some seconds. Raises InvalidValueException."""
        require_finite(seconds=seconds)
        with refusals_told():
            self._stage.press(name, seconds)


def _finite(vector: Vector3) -> Vector:
    require_finite(x=vector.x, y=vector.y, z=vector.z)
    return vector.x, vector.y, vector.z
