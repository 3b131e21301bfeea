"""Servants of the whole body, with all joints in one call and one stream, and of the head."""

from __future__ import annotations

from typing import Final

from interfaces.nao import HeadLimits, HeadPose, JointLimits, Joints, JointState, PoseHead
from naoserver._guarded_device import GuardedDevice
from naoserver._servants.hinge import limits_of
from naoserver._servants.shared import (
    StateStream,
    refusals_raised,
    require_finite,
    require_positive,
    require_within,
)
from naoserver.parts import Axis, Hinge
from naoserver.robot import JointReading
from zenoh_ice import Current, typed

_LONGEST_CHANGE: Final = 60.0
"""Longest duration of a change of stiffness in s."""


class JointsI(Joints):
    """Read and command all joints of a device."""

    def __init__(self, device: GuardedDevice) -> None:
        self._device = device
        self.stream: Final = StateStream(device.read, self.getJointStatePublisher, _state)

    def getJointNames(self, current: Current) -> list[str]:
        return [joint.name for joint in self._device.joints]

    def getJointLimits(self, current: Current) -> list[JointLimits]:
        return [
            JointLimits(joint.name, joint.lower, joint.upper, joint.max_velocity, joint.max_torque)
            for joint in self._device.joints
        ]

    def getJointState(self, current: Current) -> JointState:
        return self.stream.now()

    def setJointPositions(
        self, targets: dict[str, float], fraction: float, current: Current
    ) -> dict[str, float]:
        require_positive(1.0, fraction=fraction)
        speeds = {joint.name: fraction * joint.max_velocity for joint in self._device.joints}
        with refusals_raised():
            return self._device.move(targets, speeds, client=current.client).accepted

    def setStiffnesses(
        self, stiffnesses: dict[str, float], seconds: float, current: Current
    ) -> dict[str, float]:
        require_within(0.0, _LONGEST_CHANGE, seconds=seconds)
        with refusals_raised():
            return self._device.stiffen(stiffnesses, seconds, client=current.client)

    def stop(self, current: Current) -> None:
        self._device.hold()


class PoseHeadI(PoseHead):
    """Point the head by the joints of `neck`, or turn it at a speed that must be renewed."""

    def __init__(self, device: GuardedDevice, neck: Hinge) -> None:
        self._device = device
        self._neck = neck
        self._pan, self._tilt = neck.axes[Axis.PAN], neck.axes[Axis.TILT]
        self._places = device.index(self._pan.joint), device.index(self._tilt.joint)
        self.stream: Final = StateStream(device.read, self.getPosePublisher, self._pose)

    def setPose(self, pan: float, tilt: float, fraction: float, current: Current) -> HeadPose:
        require_finite(pan=pan, tilt=tilt)
        require_positive(1.0, fraction=fraction)
        yaw, pitch, device = self._pan.joint, self._tilt.joint, self._device
        targets = {yaw: self._pan.joint_angle(pan), pitch: self._tilt.joint_angle(tilt)}
        speeds = {joint: fraction * device.facts(joint).max_velocity for joint in (yaw, pitch)}
        with refusals_raised():
            accepted = device.move(targets, speeds, client=current.client).accepted
        return HeadPose(
            time=device.read().time,
            pan=self._pan.of(accepted[yaw]),
            tilt=self._tilt.of(accepted[pitch]),
            panSpeed=min(speeds[yaw], device.speed_cap(yaw)),
            tiltSpeed=min(speeds[pitch], device.speed_cap(pitch)),
        )

    def setSpeed(self, pan: float, tilt: float, current: Current) -> HeadPose:
        require_finite(pan=pan, tilt=tilt)
        yaw, pitch = self._pan, self._tilt
        velocities = {yaw.joint: yaw.sign * pan, pitch.joint: pitch.sign * tilt}
        with refusals_raised():
            accepted = self._device.drive(velocities, current.client).accepted
        pose = self.stream.now()
        pose.panSpeed, pose.tiltSpeed = (of.sign * accepted[of.joint] for of in (yaw, pitch))
        return pose

    def stop(self, current: Current) -> None:
        self._device.hold(self._neck.joints)

    def getPose(self, current: Current) -> HeadPose:
        return self.stream.now()

    def getLimits(self, current: Current) -> HeadLimits:
        pan, tilt = limits_of(self._device, self._pan), limits_of(self._device, self._tilt)
        return HeadLimits(
            minPan=pan[0],
            maxPan=pan[1],
            minTilt=tilt[0],
            maxTilt=tilt[1],
            maxPanSpeed=self._device.speed_cap(self._pan.joint),
            maxTiltSpeed=self._device.speed_cap(self._tilt.joint),
        )

    def _pose(self, reading: JointReading) -> HeadPose:
        pan, tilt = self._places
        return HeadPose(
            time=reading.time,
            pan=self._pan.of(reading.positions[pan]),
            tilt=self._tilt.of(reading.positions[tilt]),
            panSpeed=self._pan.sign * reading.velocities[pan],
            tiltSpeed=self._tilt.sign * reading.velocities[tilt],
        )


def _state(reading: JointReading) -> JointState:
    return typed.convert(reading, JointState, from_attributes=True)
