"""Servants of joints: all of them in one call and one stream, hinges, and the head.

A hinge is a group of joints, or the mechanism of a ball. Each of its axes stands for a joint, whose zero and
direction may differ from its own (`HingeAxis`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import msgspec

from interfaces import jderobot, nao
from naoserver.bodies.parts import Axis, Hinge, HingeAxis
from naoserver.protocol.robot import JointReading
from naoserver.safety._guarded_device import GuardedDevice
from naoserver.safety.gain_guard import GainGuard
from naoserver.serving import _shared as shared
from zenoh_ice import Current
from zenoh_ice.data import typed


class Pose3DMotorsI(jderobot.Pose3DMotors):
    """Send the joints of `hinge` to positions. An axis that the hinge does not have is ignored."""

    def __init__(self, device: GuardedDevice, hinge: Hinge) -> None:
        self._device = device
        self._hinge = hinge

    def getPose3DMotorsData(self, current: Current) -> jderobot.Pose3DMotorsData:
        axes = self._hinge.axes
        goals = {axis: self._device.goal(of.joint) for axis, of in axes.items()}
        targets = {str(axis): of.of(goals[axis].target) for axis, of in axes.items()}
        pan = [goal.speed for axis, goal in goals.items() if axis is Axis.PAN]
        other = [goal.speed for axis, goal in goals.items() if axis is not Axis.PAN]
        speeds = {"panSpeed": max(pan, default=0.0), "tiltSpeed": max(other, default=0.0)}
        return msgspec.structs.replace(_NO_COMMAND, **targets, **speeds)

    def setPose3DMotorsData(self, data: jderobot.Pose3DMotorsData, current: Current) -> int:
        shared.require_finite(**msgspec.structs.asdict(data))
        for field, speed in (("panSpeed", data.panSpeed), ("tiltSpeed", data.tiltSpeed)):
            if speed < 0:
                raise jderobot.InvalidValueException(
                    f"{field} is {speed}: the speed of a position is not negative", field
                )
        axes = self._hinge.axes
        targets = {of.joint: of.joint_angle(getattr(data, axis)) for axis, of in axes.items()}
        speeds = {
            of.joint: data.panSpeed if axis is Axis.PAN else data.tiltSpeed for axis, of in axes.items()
        }
        with shared.refusals_raised():
            return 1 if self._device.move(targets, speeds, client=current.client).limitations else 0

    def getPose3DMotorsParams(self, current: Current) -> jderobot.Pose3DMotorsParams:
        return _motor_params(self._device, self._hinge.axes)

    def stop(self, current: Current) -> None:
        self._device.hold(self._hinge.joints)


class Pose3DEncodersI(jderobot.Pose3DEncoders):
    """Report where the joints of `hinge` are, in calls and as a stream."""

    def __init__(self, device: GuardedDevice, hinge: Hinge) -> None:
        self._places = [(str(axis), of, device.index(of.joint)) for axis, of in hinge.axes.items()]
        self.stream: Final = shared.StateStream(device.read, self.getPose3DEncodersDataPublisher, self._data)

    def getPose3DEncodersData(self, current: Current) -> jderobot.Pose3DEncodersData:
        return self.stream.now()

    def _data(self, reading: JointReading) -> jderobot.Pose3DEncodersData:
        data = jderobot.Pose3DEncodersData(
            x=0.0, y=0.0, z=0.0, pan=0.0, tilt=0.0, roll=0.0, timeStamp=shared.to_time(reading.time)
        )
        for axis, of, index in self._places:
            setattr(data, axis, of.of(reading.positions[index]))
        return data


class NeckSpeedI(Pose3DMotorsI):
    """Turn the head at `panSpeed` and `tiltSpeed`, which must be renewed; positions are ignored."""

    def __init__(self, device: GuardedDevice, neck: Hinge) -> None:
        super().__init__(device, neck)
        self._pan, self._tilt = neck.axes[Axis.PAN], neck.axes[Axis.TILT]

    def getPose3DMotorsData(self, current: Current) -> jderobot.Pose3DMotorsData:
        pan, tilt = (of.sign * self._device.velocity(of.joint) for of in (self._pan, self._tilt))
        return msgspec.structs.replace(_NO_COMMAND, panSpeed=pan, tiltSpeed=tilt)

    def setPose3DMotorsData(self, data: jderobot.Pose3DMotorsData, current: Current) -> int:
        shared.require_finite(**msgspec.structs.asdict(data))
        pan, tilt = self._pan, self._tilt
        velocities = {pan.joint: pan.sign * data.panSpeed, tilt.joint: tilt.sign * data.tiltSpeed}
        with shared.refusals_raised():
            return 1 if self._device.drive(velocities, current.client).limitations else 0


def limits_of(device: GuardedDevice, axis: HingeAxis) -> tuple[float, float]:
    """Return the range of an axis."""
    facts = device.facts(axis.joint)
    ends = axis.of(facts.lower), axis.of(facts.upper)
    return min(ends), max(ends)


def _motor_params(device: GuardedDevice, axes: Mapping[Axis, HingeAxis]) -> jderobot.Pose3DMotorsParams:
    """Return the limits and highest speeds of some axes; 0 for the others."""
    limits = dict.fromkeys(jderobot.Pose3DMotorsParams.__struct_fields__, 0.0)
    for axis, of in axes.items():
        name = axis.capitalize()
        limits[f"min{name}"], limits[f"max{name}"] = limits_of(device, of)
        speed = "maxPanSpeed" if axis is Axis.PAN else "maxTiltSpeed"
        limits[speed] = min(limits[speed] or math.inf, device.speed_cap(of.joint))
    return jderobot.Pose3DMotorsParams(**limits)


_NO_COMMAND = jderobot.Pose3DMotorsData(
    x=0.0, y=0.0, z=0.0, pan=0.0, tilt=0.0, roll=0.0, panSpeed=0.0, tiltSpeed=0.0
)


_LONGEST_CHANGE: Final = 60.0
"""Longest duration of a change of stiffness in s."""


class JointsI(nao.Joints):
    """Read and command all joints of a device; `gains` are None if its motors take none by command."""

    def __init__(self, device: GuardedDevice, gains: GainGuard | None) -> None:
        self._device = device
        self._gains = gains
        self.stream: Final = shared.StateStream(device.read, self.getJointStatePublisher, _state)

    def getJointNames(self, current: Current) -> list[str]:
        return [joint.name for joint in self._device.joints]

    def getJointLimits(self, current: Current) -> list[nao.JointLimits]:
        return [
            nao.JointLimits(joint.name, joint.lower, joint.upper, joint.max_velocity, joint.max_torque)
            for joint in self._device.joints
        ]

    def getJointState(self, current: Current) -> nao.JointState:
        return self.stream.now()

    def setJointPositions(
        self, targets: dict[str, float], fraction: float, current: Current
    ) -> dict[str, float]:
        shared.require_positive(1.0, fraction=fraction)
        speeds = {joint.name: fraction * joint.max_velocity for joint in self._device.joints}
        with shared.refusals_raised():
            return self._device.move(targets, speeds, client=current.client).accepted

    def setStiffnesses(
        self, stiffnesses: dict[str, float], seconds: float, current: Current
    ) -> dict[str, float]:
        shared.require_within(0.0, _LONGEST_CHANGE, seconds=seconds)
        with shared.refusals_raised():
            return self._device.stiffen(stiffnesses, seconds, client=current.client)

    def setJointCommands(
        self, commands: dict[str, nao.JointCommand], current: Current
    ) -> dict[str, nao.JointCommand]:
        if self._gains is None:
            raise jderobot.InvalidValueException(
                f"the motors of {self._device.name} take no gains by command: they go to positions; "
                "stiffnesses say how strongly they hold",
                "commands",
            )
        with shared.refusals_raised():
            return self._gains.command(commands, current.client)

    def stop(self, current: Current) -> None:
        self._device.hold()


class PoseHeadI(nao.PoseHead):
    """Point the head by the joints of `neck`, or turn it at a speed that must be renewed."""

    def __init__(self, device: GuardedDevice, neck: Hinge) -> None:
        self._device = device
        self._neck = neck
        self._pan, self._tilt = neck.axes[Axis.PAN], neck.axes[Axis.TILT]
        self._places = device.index(self._pan.joint), device.index(self._tilt.joint)
        self.stream: Final = shared.StateStream(device.read, self.getPosePublisher, self._pose)

    def setPose(self, pan: float, tilt: float, fraction: float, current: Current) -> nao.HeadPose:
        shared.require_finite(pan=pan, tilt=tilt)
        shared.require_positive(1.0, fraction=fraction)
        yaw, pitch, device = self._pan.joint, self._tilt.joint, self._device
        targets = {yaw: self._pan.joint_angle(pan), pitch: self._tilt.joint_angle(tilt)}
        speeds = {joint: fraction * device.facts(joint).max_velocity for joint in (yaw, pitch)}
        with shared.refusals_raised():
            accepted = device.move(targets, speeds, client=current.client).accepted
        return nao.HeadPose(
            time=device.read().time,
            pan=self._pan.of(accepted[yaw]),
            tilt=self._tilt.of(accepted[pitch]),
            panSpeed=min(speeds[yaw], device.speed_cap(yaw)),
            tiltSpeed=min(speeds[pitch], device.speed_cap(pitch)),
        )

    def setSpeed(self, pan: float, tilt: float, current: Current) -> nao.HeadPose:
        shared.require_finite(pan=pan, tilt=tilt)
        yaw, pitch = self._pan, self._tilt
        velocities = {yaw.joint: yaw.sign * pan, pitch.joint: pitch.sign * tilt}
        with shared.refusals_raised():
            accepted = self._device.drive(velocities, current.client).accepted
        pose = self.stream.now()
        pose.panSpeed, pose.tiltSpeed = (of.sign * accepted[of.joint] for of in (yaw, pitch))
        return pose

    def stop(self, current: Current) -> None:
        self._device.hold(self._neck.joints)

    def getPose(self, current: Current) -> nao.HeadPose:
        return self.stream.now()

    def getLimits(self, current: Current) -> nao.HeadLimits:
        pan, tilt = limits_of(self._device, self._pan), limits_of(self._device, self._tilt)
        return nao.HeadLimits(
            minPan=pan[0],
            maxPan=pan[1],
            minTilt=tilt[0],
            maxTilt=tilt[1],
            maxPanSpeed=self._device.speed_cap(self._pan.joint),
            maxTiltSpeed=self._device.speed_cap(self._tilt.joint),
        )

    def _pose(self, reading: JointReading) -> nao.HeadPose:
        pan, tilt = self._places
        return nao.HeadPose(
            time=reading.time,
            pan=self._pan.of(reading.positions[pan]),
            tilt=self._tilt.of(reading.positions[tilt]),
            panSpeed=self._pan.sign * reading.velocities[pan],
            tiltSpeed=self._tilt.sign * reading.velocities[tilt],
        )


def _state(reading: JointReading) -> nao.JointState:
    return typed.convert(reading, nao.JointState, from_attributes=True)
