"""Servants that only a simulation has: the scene around the robot, and the ground truth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from interfaces import nao
from naoserver._gate import Gate
from naoserver._servants.shared import StateStream, refusals_raised, require_finite
from naoserver.capabilities import Pose, Stage, Truth, Vector
from zenoh_ice import Current


class SceneI(nao.Scene):
    """Set the scene of a simulation: this is no command of the robot, so no lease and no stop prevents it.

    Only a push counts as a command, and passes the gate. `end_motion` ends all motion of the robot, so that
    it does not continue after being placed; `hear` returns what was recognized in a sentence.
    """

    def __init__(
        self, stage: Stage, gate: Gate, end_motion: Callable[[], None], hear: Callable[[str], str]
    ) -> None:
        self._stage: Final = stage
        self._gate: Final = gate
        self._end_motion: Final = end_motion
        self._hear: Final = hear

    def reset(self, current: Current) -> None:
        self._end_motion()
        self._stage.reset()

    def getObjects(self, current: Current) -> list[str]:
        return list(self._stage.objects)

    def getShapes(self, current: Current) -> list[nao.WorldShape]:
        return [
            nao.WorldShape(
                object=shape.object,
                kind=nao.ShapeKind[shape.kind],
                size=nao.Vector3(*shape.size),
                pose=_pose(shape.pose),
                color=nao.Vector3(*shape.color),
                opacity=shape.opacity,
            )
            for shape in self._stage.shapes
        ]

    def placeObject(self, name: str, position: nao.Vector3, current: Current) -> None:
        with refusals_raised():
            self._stage.place_object(name, _finite(position))

    def placeRobot(self, x: float, y: float, heading: float, current: Current) -> None:
        require_finite(x=x, y=y, heading=heading)
        with refusals_raised():
            self._stage.place_robot(x, y, heading)
        self._end_motion()

    def pushRobot(self, force: nao.Vector3, seconds: float, current: Current) -> None:
        require_finite(seconds=seconds)
        with refusals_raised():
            self._gate.require(current.client)
            self._stage.push(_finite(force), seconds)

    def pressSensor(self, name: str, seconds: float, current: Current) -> None:
        require_finite(seconds=seconds)
        with refusals_raised():
            self._stage.press(name, seconds)

    def sayToRobot(self, text: str, current: Current) -> str:
        with refusals_raised():
            return self._hear(text)


class GroundTruthI(nao.GroundTruth):
    """Report where the robot and everything else is, in calls and as a stream."""

    def __init__(self, stage: Stage) -> None:
        self.stream: Final = StateStream(stage.truth, self.getGroundTruthPublisher, _truth)

    def getGroundTruth(self, current: Current) -> nao.GroundTruthReading:
        return self.stream.now()


def _finite(vector: nao.Vector3) -> Vector:
    require_finite(x=vector.x, y=vector.y, z=vector.z)
    return vector.x, vector.y, vector.z


def _truth(truth: Truth) -> nao.GroundTruthReading:
    return nao.GroundTruthReading(
        time=truth.time,
        torso=_pose(truth.torso),
        velocity=nao.Vector3(*truth.velocity),
        angularVelocity=nao.Vector3(*truth.angular_velocity),
        objects={name: _pose(pose) for name, pose in truth.objects.items()},
    )


def _pose(pose: Pose) -> nao.Pose:
    return nao.Pose(position=nao.Vector3(*pose.position), orientation=nao.Quaternion(*pose.orientation))
