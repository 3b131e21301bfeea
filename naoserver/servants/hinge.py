"""Servants of a hinge or of a ball's mechanism: position commands and encoders, axis by axis."""

from __future__ import annotations

import math

import msgspec

from interfaces.jderobot import (
    InvalidValueException,
    Pose3DEncoders,
    Pose3DEncodersData,
    Pose3DMotors,
    Pose3DMotorsData,
    Pose3DMotorsParams,
)
from naoserver.guarded_device import GuardedDevice
from naoserver.hinges import Axis, Hinge
from naoserver.robot import JointReading
from naoserver.servants.conversions import refusals_told, require_finite, to_time
from zenoh_ice import Current


class Pose3DMotorsI(Pose3DMotors):
    """Send the joints of `hinge` to positions. An axis that the hinge does not have is ignored."""

    def __init__(self, device: GuardedDevice, hinge: Hinge) -> None:
        self.device = device
        self._axes = hinge.joints

    def getPose3DMotorsData(self, current: Current) -> Pose3DMotorsData:  # noqa: ARG002
        """Return the newest targets and speeds, as they were limited."""
        goals = {axis: self.device.goal(joint) for axis, joint in self._axes}
        targets = {str(axis): goal.target for axis, goal in goals.items()}
        pan = [goal.speed for axis, goal in goals.items() if axis is Axis.PAN]
        other = [goal.speed for axis, goal in goals.items() if axis is not Axis.PAN]
        speeds = {"panSpeed": max(pan, default=0.0), "tiltSpeed": max(other, default=0.0)}
        return msgspec.structs.replace(_NO_COMMAND, **targets, **speeds)

    def setPose3DMotorsData(self, data: Pose3DMotorsData, current: Current) -> int:
        """Send every axis to its target; returns 1 when a value was limited, else 0.

        Raises InvalidValueException or CommandRefusedException, and then moves nothing.
        """
        require_finite(**msgspec.structs.asdict(data))
        for field, speed in (("panSpeed", data.panSpeed), ("tiltSpeed", data.tiltSpeed)):
            if speed < 0:
                raise InvalidValueException(
                    f"{field} is {speed}: the speed of a position is not negative", field
                )
        targets = {joint: float(getattr(data, axis)) for axis, joint in self._axes}
        speeds = {joint: data.panSpeed if axis is Axis.PAN else data.tiltSpeed for axis, joint in self._axes}
        with refusals_told():
            return 1 if self.device.move(targets, speeds, client=current.client).limitations else 0

    def getPose3DMotorsParams(self, current: Current) -> Pose3DMotorsParams:  # noqa: ARG002
        """Return the limits of the axes."""
        return motor_params(self.device, self._axes)

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """Hold the setpoint of every axis where it is by now."""
        self.device.hold(joint for _, joint in self._axes)


class Pose3DEncodersI(Pose3DEncoders):
    """Tell where the joints of `hinge` are, in calls and as a stream."""

    def __init__(self, device: GuardedDevice, hinge: Hinge) -> None:
        self.device = device
        self._places = tuple((str(axis), device.index(joint)) for axis, joint in hinge.joints)

    def getPose3DEncodersData(self, current: Current) -> Pose3DEncodersData:  # noqa: ARG002
        """Return the newest positions."""
        return self._data(self.device.read())

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getPose3DEncodersDataPublisher.listening

    def publish(self, reading: JointReading) -> None:
        """Send a reading to whoever listens."""
        self.getPose3DEncodersDataPublisher.publish(self._data(reading), time=reading.time)

    def _data(self, reading: JointReading) -> Pose3DEncodersData:
        data = Pose3DEncodersData(
            x=0.0, y=0.0, z=0.0, pan=0.0, tilt=0.0, roll=0.0, timeStamp=to_time(reading.time)
        )
        for axis, index in self._places:
            setattr(data, axis, reading.positions[index])
        return data


def motor_params(device: GuardedDevice, axes: tuple[tuple[Axis, str], ...]) -> Pose3DMotorsParams:
    """Return the limits of some axes, 0 of the others, and the highest speeds that each of them takes."""
    limits = dict.fromkeys(Pose3DMotorsParams.__struct_fields__, 0.0)
    for axis, joint in axes:
        facts = device.facts(joint)
        name = axis.capitalize()
        limits[f"min{name}"], limits[f"max{name}"] = facts.lower, facts.upper
        speed = "maxPanSpeed" if axis is Axis.PAN else "maxTiltSpeed"
        limits[speed] = min(limits[speed] or math.inf, device.speed_cap(joint))
    return Pose3DMotorsParams(**limits)


_NO_COMMAND = Pose3DMotorsData(x=0.0, y=0.0, z=0.0, pan=0.0, tilt=0.0, roll=0.0, panSpeed=0.0, tiltSpeed=0.0)
