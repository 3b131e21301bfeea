"""Servant of the head: point it, turn it, read it."""

from __future__ import annotations

from interfaces.nao import HeadLimits, HeadPose, PoseHead
from naoserver.guarded_device import GuardedDevice
from naoserver.hinges import NECK
from naoserver.robot import JointReading
from naoserver.servants.conversions import refusals_told, require_finite, require_fraction
from zenoh_ice import Current

_YAW, _PITCH = (joint for _, joint in NECK.joints)


class PoseHeadI(PoseHead):
    """Point the head, or turn it at a speed that must be renewed."""

    def __init__(self, device: GuardedDevice) -> None:
        self.device = device
        self._pan, self._tilt = device.index(_YAW), device.index(_PITCH)

    def setPose(self, pan: float, tilt: float, fraction: float, current: Current) -> HeadPose:
        """Turn the head to a pose; returns the pose and the highest speeds as they were limited.

        Raises InvalidValueException or CommandRefusedException, and then moves nothing.
        """
        require_finite(pan=pan, tilt=tilt, fraction=fraction)
        require_fraction(fraction)
        speeds = {joint: fraction * self.device.facts(joint).max_velocity for joint in (_YAW, _PITCH)}
        with refusals_told():
            outcome = self.device.move({_YAW: pan, _PITCH: tilt}, speeds, client=current.client)
        return HeadPose(
            time=self.device.read().time,
            pan=outcome.accepted[_YAW],
            tilt=outcome.accepted[_PITCH],
            panSpeed=min(speeds[_YAW], self.device.speed_cap(_YAW)),
            tiltSpeed=min(speeds[_PITCH], self.device.speed_cap(_PITCH)),
        )

    def setSpeed(self, pan: float, tilt: float, current: Current) -> HeadPose:
        """Turn the head at speeds until the timeout; returns where it is and the speeds as they were limited.

        Raises InvalidValueException or CommandRefusedException, and then moves nothing.
        """
        require_finite(pan=pan, tilt=tilt)
        with refusals_told():
            outcome = self.device.drive({_YAW: pan, _PITCH: tilt}, current.client)
        pose = self._pose(self.device.read())
        pose.panSpeed, pose.tiltSpeed = outcome.accepted[_YAW], outcome.accepted[_PITCH]
        return pose

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """Hold the head where it is."""
        self.device.hold((_YAW, _PITCH))

    def getPose(self, current: Current) -> HeadPose:  # noqa: ARG002
        """Return where the head points."""
        return self._pose(self.device.read())

    def getLimits(self, current: Current) -> HeadLimits:  # noqa: ARG002
        """Return how far and how fast the head turns."""
        yaw, pitch = self.device.facts(_YAW), self.device.facts(_PITCH)
        return HeadLimits(
            minPan=yaw.lower,
            maxPan=yaw.upper,
            minTilt=pitch.lower,
            maxTilt=pitch.upper,
            maxPanSpeed=self.device.speed_cap(_YAW),
            maxTiltSpeed=self.device.speed_cap(_PITCH),
        )

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getPosePublisher.listening

    def publish(self, reading: JointReading) -> None:
        """Send a reading to whoever listens."""
        self.getPosePublisher.publish(self._pose(reading), time=reading.time)

    def _pose(self, reading: JointReading) -> HeadPose:
        return HeadPose(
            time=reading.time,
            pan=reading.positions[self._pan],
            tilt=reading.positions[self._tilt],
            panSpeed=reading.velocities[self._pan],
            tiltSpeed=reading.velocities[self._tilt],
        )
