"""A ball of the simulated world, through its servants."""

from __future__ import annotations

from typing import Final

from interfaces.jderobot import Pose3DEncodersPrx, Pose3DMotorsData, Pose3DMotorsPrx
from zenoh_ice import Communicator

from ._axes import AxisLimits, AxisPosition
from ._color import Color

__all__ = ["Ball"]

_CALL_LIMIT: Final = 800  # ms; a server that hangs is reported within a second


class Ball:
    """Command the axes of a ball and read their positions.

    Every method calls the server and raises the exceptions of zenoh_ice.
    """

    def __init__(self, color: Color, motors: Pose3DMotorsPrx, encoders: Pose3DEncodersPrx) -> None:
        self.color = color
        self._motors = motors
        self._encoders = encoders
        self.limits = AxisLimits.from_params(motors.getPose3DMotorsParams())

    @classmethod
    def connect(cls, communicator: Communicator, color: Color) -> Ball:
        """Return the ball of a color; for green, the identities are BallGreenMotors and BallGreenEncoders."""
        identity = f"Ball{color.capitalize()}"
        motors = Pose3DMotorsPrx.checkedCast(communicator.stringToProxy(f"{identity}Motors"))
        encoders = Pose3DEncodersPrx.checkedCast(communicator.stringToProxy(f"{identity}Encoders"))
        limit = min(_CALL_LIMIT, round(communicator.settings.timeout * 1000))
        return cls(color, motors.ice_invocationTimeout(limit), encoders.ice_invocationTimeout(limit))

    def command(self, target: AxisPosition) -> None:
        """Send the axes to a position as fast as they can: the steps between setpoints are small."""
        self._motors.setPose3DMotorsData(
            Pose3DMotorsData(
                x=target.distance,
                y=0.0,
                z=target.height,
                pan=target.pan,
                tilt=0.0,
                roll=0.0,
                panSpeed=self.limits.max_pan_speed,
                tiltSpeed=self.limits.max_linear_speed,
            )
        )

    def position(self) -> AxisPosition:
        """Return the present position of the axes."""
        data = self._encoders.getPose3DEncodersData()
        return AxisPosition(pan=data.pan, distance=data.x, height=data.z)
