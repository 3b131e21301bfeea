"""Servants of the sensors except joints and cameras: each reports a part of the readings of the senses."""

from __future__ import annotations

from dataclasses import asdict
from typing import Final

from interfaces import nao
from naoserver._servants.shared import StateStream
from naoserver.body import Body
from naoserver.capabilities import FootReading, SenseReading, Senses
from naoserver.parts import CORNERS, NOWHERE, Sole
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
    total = foot.total
    pressures = (foot.front_left, foot.front_right, foot.rear_left, foot.rear_right)
    places = [sole.pressure.get(sensor, NOWHERE) for sensor in CORNERS]
    x, y = (
        sum(pressure * place[axis] for pressure, place in zip(pressures, places, strict=True)) / total
        if total > 0.0
        else 0.0
        for axis in (0, 1)
    )
    return nao.FootReading(*pressures, total=total, centerX=x, centerY=y)


def _sonar(reading: SenseReading) -> nao.SonarReading:
    return nao.SonarReading(time=reading.time, left=reading.sonar.left, right=reading.sonar.right)


def _battery(reading: SenseReading) -> nao.BatteryReading:
    return nao.BatteryReading(time=reading.time, **asdict(reading.battery))
