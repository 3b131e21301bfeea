"""Hinges, groups of joints or a ball's mechanism, and their servants: motors, encoders, speed of the neck."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import msgspec

from interfaces.jderobot import (
    InvalidValueException,
    Pose3DEncoders,
    Pose3DEncodersData,
    Pose3DMotors,
    Pose3DMotorsData,
    Pose3DMotorsParams,
)
from naoserver._guarded_device import GuardedDevice
from naoserver._servants.shared import StateStream, refusals_raised, require_finite, to_time
from naoserver.robot import JointReading
from zenoh_ice import Current


class Axis(StrEnum):
    """An axis of a Pose3D device, named as the member of the interface that holds it."""

    X = "x"
    Y = "y"
    Z = "z"
    PAN = "pan"
    TILT = "tilt"
    ROLL = "roll"


@dataclass(frozen=True, slots=True)
class Hinge:
    """Joints that JdeRobot serves as one Pose3D device, as `{name}Motors` and `{name}Encoders`."""

    name: str
    joints: tuple[tuple[Axis, str], ...]
    """The axes that the hinge has, each with its joint."""


def _arm_and_leg(side: str) -> tuple[Hinge, ...]:
    s = side[0]
    return (
        Hinge(f"{side}Shoulder", ((Axis.TILT, f"{s}ShoulderPitch"), (Axis.ROLL, f"{s}ShoulderRoll"))),
        Hinge(f"{side}Elbow", ((Axis.PAN, f"{s}ElbowYaw"), (Axis.ROLL, f"{s}ElbowRoll"))),
        Hinge(f"{side}Wrist", ((Axis.PAN, f"{s}WristYaw"),)),
        Hinge(f"{side}Hand", ((Axis.PAN, f"{s}Hand"),)),
        Hinge(
            f"{side}Hip",
            ((Axis.PAN, f"{s}HipYawPitch"), (Axis.TILT, f"{s}HipPitch"), (Axis.ROLL, f"{s}HipRoll")),
        ),
        Hinge(f"{side}Knee", ((Axis.TILT, f"{s}KneePitch"),)),
        Hinge(f"{side}Ankle", ((Axis.TILT, f"{s}AnklePitch"), (Axis.ROLL, f"{s}AnkleRoll"))),
    )


NECK: Final = Hinge("Neck", ((Axis.PAN, "HeadYaw"), (Axis.TILT, "HeadPitch")))
HINGES: Final = (NECK, *_arm_and_leg("Left"), *_arm_and_leg("Right"))
"""Every hinge that a body may have. A hand has one axis, its opening from 0 to 1, served as pan."""

BALL_AXES: Final = (Axis.PAN, Axis.X, Axis.Z)
"""The axes of a ball's three joints in their order: round the robot in rad, distance in m, height in m."""
YAW, PITCH = (joint for _, joint in NECK.joints)


class Pose3DMotorsI(Pose3DMotors):
    """Send the joints of `hinge` to positions. An axis that the hinge does not have is ignored."""

    def __init__(self, device: GuardedDevice, hinge: Hinge) -> None:
        self._device = device
        self._axes = hinge.joints

    def getPose3DMotorsData(self, current: Current) -> Pose3DMotorsData:
        goals = {axis: self._device.goal(joint) for axis, joint in self._axes}
        targets = {str(axis): goal.target for axis, goal in goals.items()}
        pan = [goal.speed for axis, goal in goals.items() if axis is Axis.PAN]
        other = [goal.speed for axis, goal in goals.items() if axis is not Axis.PAN]
        speeds = {"panSpeed": max(pan, default=0.0), "tiltSpeed": max(other, default=0.0)}
        return msgspec.structs.replace(_NO_COMMAND, **targets, **speeds)

    def setPose3DMotorsData(self, data: Pose3DMotorsData, current: Current) -> int:
        require_finite(**msgspec.structs.asdict(data))
        for field, speed in (("panSpeed", data.panSpeed), ("tiltSpeed", data.tiltSpeed)):
            if speed < 0:
                raise InvalidValueException(
                    f"{field} is {speed}: the speed of a position is not negative", field
                )
        targets = {joint: float(getattr(data, axis)) for axis, joint in self._axes}
        speeds = {joint: data.panSpeed if axis is Axis.PAN else data.tiltSpeed for axis, joint in self._axes}
        with refusals_raised():
            return 1 if self._device.move(targets, speeds, client=current.client).limitations else 0

    def getPose3DMotorsParams(self, current: Current) -> Pose3DMotorsParams:
        return _motor_params(self._device, self._axes)

    def stop(self, current: Current) -> None:
        self._device.hold(joint for _, joint in self._axes)


class Pose3DEncodersI(Pose3DEncoders):
    """Report where the joints of `hinge` are, in calls and as a stream."""

    def __init__(self, device: GuardedDevice, hinge: Hinge) -> None:
        self._places = tuple((str(axis), device.index(joint)) for axis, joint in hinge.joints)
        self.stream: Final = StateStream(device.read, self.getPose3DEncodersDataPublisher, self._data)

    def getPose3DEncodersData(self, current: Current) -> Pose3DEncodersData:
        return self.stream.now()

    def _data(self, reading: JointReading) -> Pose3DEncodersData:
        data = Pose3DEncodersData(
            x=0.0, y=0.0, z=0.0, pan=0.0, tilt=0.0, roll=0.0, timeStamp=to_time(reading.time)
        )
        for axis, index in self._places:
            setattr(data, axis, reading.positions[index])
        return data


class NeckSpeedI(Pose3DMotors):
    """Turn the head at `panSpeed` and `tiltSpeed`, which must be renewed; positions are ignored."""

    def __init__(self, device: GuardedDevice) -> None:
        self._device = device

    def getPose3DMotorsData(self, current: Current) -> Pose3DMotorsData:
        pan, tilt = self._device.velocity(YAW), self._device.velocity(PITCH)
        return msgspec.structs.replace(_NO_COMMAND, panSpeed=pan, tiltSpeed=tilt)

    def setPose3DMotorsData(self, data: Pose3DMotorsData, current: Current) -> int:
        require_finite(**msgspec.structs.asdict(data))
        with refusals_raised():
            outcome = self._device.drive({YAW: data.panSpeed, PITCH: data.tiltSpeed}, current.client)
        return 1 if outcome.limitations else 0

    def getPose3DMotorsParams(self, current: Current) -> Pose3DMotorsParams:
        return _motor_params(self._device, NECK.joints)

    def stop(self, current: Current) -> None:
        self._device.hold((YAW, PITCH))


def _motor_params(device: GuardedDevice, axes: tuple[tuple[Axis, str], ...]) -> Pose3DMotorsParams:
    """Return the limits and highest speeds of some axes; 0 for the others."""
    limits = dict.fromkeys(Pose3DMotorsParams.__struct_fields__, 0.0)
    for axis, joint in axes:
        facts = device.facts(joint)
        name = axis.capitalize()
        limits[f"min{name}"], limits[f"max{name}"] = facts.lower, facts.upper
        speed = "maxPanSpeed" if axis is Axis.PAN else "maxTiltSpeed"
        limits[speed] = min(limits[speed] or math.inf, device.speed_cap(joint))
    return Pose3DMotorsParams(**limits)


_NO_COMMAND = Pose3DMotorsData(x=0.0, y=0.0, z=0.0, pan=0.0, tilt=0.0, roll=0.0, panSpeed=0.0, tiltSpeed=0.0)
