"""Servants of what is sensed, and of what only a simulation knows and has: ground truth and scene.

Each of a sensor reports a part of the readings of the senses; joints and cameras have other servants.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Final

from interfaces import nao
from naoserver.bodies.body import Body
from naoserver.bodies.capabilities import FootReading, Pose, SenseReading, Senses, Stage, Truth, Vector
from naoserver.bodies.parts import Sole
from naoserver.safety._gate import Gate
from naoserver.serving._shared import StateStream, refusals_raised, require_finite
from zenoh_ice import Current


class InertialUnitI(nao.InertialUnit):
    """Report acceleration, rotation and tilt of the torso, in calls and as a stream."""

    def __init__(self, senses: Senses) -> None:
        self.stream: Final = StateStream(senses.read, self.getInertialReadingPublisher, _inertial)

    def getInertialReading(self, current: Current) -> nao.InertialReading:
        return self.stream.now()


class FootPressureI(nao.FootPressure):
    """Report the forces on the soles, in calls and as a stream."""

    def __init__(self, senses: Senses, body: Body) -> None:
        self._left, self._right = body.soles
        self.stream: Final = StateStream(senses.read, self.getFeetReadingPublisher, self._feet)

    def getFeetReading(self, current: Current) -> nao.FeetReading:
        return self.stream.now()

    def _feet(self, reading: SenseReading) -> nao.FeetReading:
        return nao.FeetReading(
            time=reading.time,
            left=_foot(reading.left_foot, self._left),
            right=_foot(reading.right_foot, self._right),
        )


class SonarI(nao.Sonar):
    """Report obstacles in front of the chest, in calls and as a stream: the sonar measures rarely."""

    def __init__(self, senses: Senses) -> None:
        self._senses = senses
        self.stream: Final = StateStream(
            senses.read, self.getSonarReadingPublisher, _sonar, news=lambda reading: reading.sonar
        )

    def getSonarReading(self, current: Current) -> nao.SonarReading:
        return self.stream.now()

    def getSonarLimits(self, current: Current) -> nao.SonarLimits:
        nearest, farthest = self._senses.sonar_range or (0.0, 0.0)
        return nao.SonarLimits(nearest=nearest, farthest=farthest, cone=self._senses.sonar_cone)


class TouchI(nao.Touch):
    """Report touches, in calls and as a stream."""

    def __init__(self, senses: Senses) -> None:
        self._senses = senses
        self.stream: Final = StateStream(
            senses.read, self.getTouchReadingPublisher, self._touch, news=lambda reading: reading.touched
        )

    def getTouchNames(self, current: Current) -> list[str]:
        return list(self._senses.touch_names)

    def getTouchReading(self, current: Current) -> nao.TouchReading:
        return self.stream.now()

    def _touch(self, reading: SenseReading) -> nao.TouchReading:
        touched = [name for name in self._senses.touch_names if name in reading.touched]
        return nao.TouchReading(time=reading.time, touched=touched)


class BatteryI(nao.Battery):
    """Report the state of the battery, in calls and as a stream, which is slow: a battery changes slowly."""

    def __init__(self, senses: Senses) -> None:
        self.stream: Final = StateStream(
            senses.read, self.getBatteryReadingPublisher, _battery, news=lambda _: None
        )

    def getBatteryReading(self, current: Current) -> nao.BatteryReading:
        return self.stream.now()


def _inertial(reading: SenseReading) -> nao.InertialReading:
    inertial = reading.inertial
    return nao.InertialReading(
        time=reading.time,
        acceleration=nao.Vector3(*inertial.acceleration),
        angularVelocity=nao.Vector3(*inertial.angular_velocity),
        roll=inertial.roll,
        pitch=inertial.pitch,
    )


def _foot(foot: FootReading, sole: Sole) -> nao.FootReading:
    """Return the forces on a sole and their center in the foot's frame in m."""
    x, y = sole.center(foot)
    pressures = foot.front_left, foot.front_right, foot.rear_left, foot.rear_right
    return nao.FootReading(*pressures, total=foot.total, centerX=x, centerY=y)


def _sonar(reading: SenseReading) -> nao.SonarReading:
    return nao.SonarReading(time=reading.time, left=reading.sonar.left, right=reading.sonar.right)


def _battery(reading: SenseReading) -> nao.BatteryReading:
    return nao.BatteryReading(time=reading.time, **asdict(reading.battery))


class SceneI(nao.Scene):
    """Set the scene of a simulation: this is no command of the robot, so no lease and no stop prevents it.

    Only a push counts as a command, and passes the gate. `end_motion` ends all motion of the robot, so that
    it does not continue after being placed; `hear` returns what was recognized in a sentence; `heal` ends
    what fails.
    """

    def __init__(
        self,
        stage: Stage,
        gate: Gate,
        end_motion: Callable[[], None],
        hear: Callable[[str], str],
        heal: Callable[[], None],
    ) -> None:
        self._stage: Final = stage
        self._gate: Final = gate
        self._end_motion: Final = end_motion
        self._hear: Final = hear
        self._heal: Final = heal

    def reset(self, current: Current) -> None:
        self._end_motion()
        self._heal()
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
            self._stage.place_robot(x, y, heading, self._end_motion)

    def pushRobot(self, force: nao.Vector3, seconds: float, current: Current) -> None:
        require_finite(seconds=seconds)
        with refusals_raised():
            self._gate.require(current.client, begun=True)  # no motor turns by it, and no program repeats it
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
