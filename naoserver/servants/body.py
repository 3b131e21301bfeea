"""Servant of the whole body: all joints in one call and in one stream."""

from __future__ import annotations

from typing import Final

from interfaces.jderobot import InvalidValueException
from interfaces.nao import JointLimits, Joints, JointState
from naoserver.guarded_device import GuardedDevice
from naoserver.robot import JointReading
from naoserver.servants.conversions import refusals_told, require_finite, require_fraction
from zenoh_ice import Current

_LONGEST_CHANGE: Final = 60.0
"""Seconds that a change of stiffness may take."""


class JointsI(Joints):
    """Read and command all joints of a device."""

    def __init__(self, device: GuardedDevice) -> None:
        self.device = device

    def getJointNames(self, current: Current) -> list[str]:  # noqa: ARG002
        """Return the names of the joints in the order of every reading."""
        return [joint.name for joint in self.device.joints]

    def getJointLimits(self, current: Current) -> list[JointLimits]:  # noqa: ARG002
        """Return the limits of the joints in the order of getJointNames."""
        return [
            JointLimits(
                name=joint.name,
                lower=joint.lower,
                upper=joint.upper,
                maxVelocity=joint.max_velocity,
                maxTorque=joint.max_torque,
            )
            for joint in self.device.joints
        ]

    def getJointState(self, current: Current) -> JointState:  # noqa: ARG002
        """Return the state of all joints."""
        return _state(self.device.read())

    def setJointPositions(
        self,
        targets: dict[str, float],
        fraction: float,
        current: Current,
    ) -> dict[str, float]:
        """Send some joints to targets at a fraction of their full speed; returns the targets as limited.

        Raises InvalidValueException or CommandRefusedException, and then moves nothing.
        """
        require_finite(fraction=fraction)
        require_fraction(fraction)
        speeds = {
            joint.name: fraction * joint.max_velocity for joint in self.device.joints if joint.name in targets
        }
        with refusals_told():
            return self.device.move(targets, speeds, client=current.client).accepted

    def setStiffnesses(
        self,
        stiffnesses: dict[str, float],
        seconds: float,
        current: Current,
    ) -> dict[str, float]:
        """Change how strongly some joints hold; returns what was set, the same for joints of one motor.

        Raises InvalidValueException or CommandRefusedException, and then changes nothing.
        """
        require_finite(seconds=seconds)
        if not 0.0 <= seconds <= _LONGEST_CHANGE:
            message = f"seconds is {seconds:g}: it must be from 0 to {_LONGEST_CHANGE:g}"
            raise InvalidValueException(message, "seconds")
        with refusals_told():
            return self.device.stiffen(stiffnesses, seconds, client=current.client)

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """Hold every joint where it is."""
        self.device.hold()

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getJointStatePublisher.listening

    def publish(self, reading: JointReading) -> None:
        """Send a reading to whoever listens."""
        self.getJointStatePublisher.publish(_state(reading), time=reading.time)


def _state(reading: JointReading) -> JointState:
    return JointState(
        time=reading.time,
        positions=list(reading.positions),
        velocities=list(reading.velocities),
        commands=list(reading.commands),
        torques=list(reading.torques),
        stiffnesses=list(reading.stiffnesses),
        temperatures=list(reading.temperatures),
    )
