"""Servants of the whole body, with all joints in one call and one stream, and of the head."""

from __future__ import annotations

from typing import Final

import msgspec

from interfaces.nao import HeadLimits, HeadPose, JointLimits, Joints, JointState, PoseHead
from naoserver._guarded_device import GuardedDevice
from naoserver._servants.hinge import PITCH, YAW
from naoserver._servants.shared import (
    StateStream,
    refusals_raised,
    require_finite,
    require_positive,
    require_within,
)
from naoserver.robot import JointReading
from zenoh_ice import Current

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
    """Point the head, or turn it at a speed that must be renewed."""

    def __init__(self, device: GuardedDevice) -> None:
        self._device = device
        self._pan, self._tilt = device.index(YAW), device.index(PITCH)
        self.stream: Final = StateStream(device.read, self.getPosePublisher, self._pose)

    def setPose(self, pan: float, tilt: float, fraction: float, current: Current) -> HeadPose:
        require_finite(pan=pan, tilt=tilt)
        require_positive(1.0, fraction=fraction)
        speeds = {joint: fraction * self._device.facts(joint).max_velocity for joint in (YAW, PITCH)}
        with refusals_raised():
            outcome = self._device.move({YAW: pan, PITCH: tilt}, speeds, client=current.client)
        return HeadPose(
            time=self._device.read().time,
            pan=outcome.accepted[YAW],
            tilt=outcome.accepted[PITCH],
            panSpeed=min(speeds[YAW], self._device.speed_cap(YAW)),
            tiltSpeed=min(speeds[PITCH], self._device.speed_cap(PITCH)),
        )

    def setSpeed(self, pan: float, tilt: float, current: Current) -> HeadPose:
        require_finite(pan=pan, tilt=tilt)
        with refusals_raised():
            outcome = self._device.drive({YAW: pan, PITCH: tilt}, current.client)
        pose = self.stream.now()
        pose.panSpeed, pose.tiltSpeed = outcome.accepted[YAW], outcome.accepted[PITCH]
        return pose

    def stop(self, current: Current) -> None:
        self._device.hold((YAW, PITCH))

    def getPose(self, current: Current) -> HeadPose:
        return self.stream.now()

    def getLimits(self, current: Current) -> HeadLimits:
        yaw, pitch = self._device.facts(YAW), self._device.facts(PITCH)
        return HeadLimits(
            minPan=yaw.lower,
            maxPan=yaw.upper,
            minTilt=pitch.lower,
            maxTilt=pitch.upper,
            maxPanSpeed=self._device.speed_cap(YAW),
            maxTiltSpeed=self._device.speed_cap(PITCH),
        )

    def _pose(self, reading: JointReading) -> HeadPose:
        return HeadPose(
            time=reading.time,
            pan=reading.positions[self._pan],
            tilt=reading.positions[self._tilt],
            panSpeed=reading.velocities[self._pan],
            tiltSpeed=reading.velocities[self._tilt],
        )


def _state(reading: JointReading) -> JointState:
    return msgspec.convert(reading, JointState, from_attributes=True)
