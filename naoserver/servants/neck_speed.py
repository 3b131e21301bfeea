"""Servant of the neck in speed: JdeRobot's `NeckSpeed`, in rad/s."""

from __future__ import annotations

import msgspec

from interfaces.jderobot import Pose3DMotors, Pose3DMotorsData, Pose3DMotorsParams
from naoserver.guarded_device import GuardedDevice
from naoserver.hinges import NECK
from naoserver.servants.conversions import refusals_told, require_finite
from naoserver.servants.hinge import motor_params
from zenoh_ice import Current

_YAW, _PITCH = (joint for _, joint in NECK.joints)


class NeckSpeedI(Pose3DMotors):
    """Turn the head at `panSpeed` and `tiltSpeed`; the positions of a command are ignored.

    A command that is not renewed stops.
    """

    def __init__(self, device: GuardedDevice) -> None:
        self._device = device

    def getPose3DMotorsData(self, current: Current) -> Pose3DMotorsData:  # noqa: ARG002
        """Return the speeds that the head is commanded to keep, as they were limited."""
        return Pose3DMotorsData(
            x=0.0,
            y=0.0,
            z=0.0,
            pan=0.0,
            tilt=0.0,
            roll=0.0,
            panSpeed=self._device.velocity(_YAW),
            tiltSpeed=self._device.velocity(_PITCH),
        )

    def setPose3DMotorsData(self, data: Pose3DMotorsData, current: Current) -> int:
        """Turn the head; returns 1 when a speed was limited, else 0.

        Raises InvalidValueException or CommandRefusedException, and then moves nothing.
        """
        require_finite(**msgspec.structs.asdict(data))
        with refusals_told():
            outcome = self._device.drive({_YAW: data.panSpeed, _PITCH: data.tiltSpeed}, current.client)
        return 1 if outcome.limitations else 0

    def getPose3DMotorsParams(self, current: Current) -> Pose3DMotorsParams:  # noqa: ARG002
        """Return the limits of pan and tilt and of their speeds."""
        return motor_params(self._device, NECK.joints)

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """Hold the head where it is."""
        self._device.hold((_YAW, _PITCH))
