"""States and commands of joints as the maker's programs know them: plain CDR, little endian, by `struct`.

The types of cyclonedds would take ten times the time.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import chain
from typing import Final

from interfaces.nao import JointCommand
from naoserver.bodies.capabilities import InertialReading
from naoserver.errors import HardwareFailure
from naoserver.protocol.robot import LIMP
from visualhfsm_makers._booster._loco import Loco
from visualhfsm_makers._programs import Programs
from zenoh_ice.data.text import sentence

_COMMAND: Final = struct.Struct("<B3x6f")
_MOTOR: Final = "B3x4fB3x3I"
_ODOMETER: Final = struct.Struct("<3f")
_FALL: Final = struct.Struct("<Ix")
"""The state of a fall, and that it does not get up, which is 0."""
_HAS_FALLEN: Final = 2


class Joints:
    """Pack what programs read of a robot, and pass their commands of joints on."""

    def __init__(self, programs: Programs, loco: Loco) -> None:
        self._robot = robot = programs.robot
        self._loco = loco
        self.obey: Final = partial(programs.obey, sentence("a program's command of joints"), self._command)
        motors = f"I{_MOTOR * len(robot.joints)}"
        self._state = struct.Struct(f"<9f{motors}{motors}")

    def _command(self, data: bytes, client: str) -> Mapping[str, JointCommand]:
        return self._loco.follow(self._motors(data), client)

    def state(self) -> bytes:
        """Return the inertial unit and the joints, which are both the parallel and the serial motors."""
        robot, heading = self._robot, self._loco.place()[2]
        reading, inertial = robot.read(), robot.senses.inertial() if robot.senses else InertialReading()
        joints = zip(
            reading.stiffnesses,
            reading.positions,
            reading.velocities,
            reading.torques,
            reading.temperatures,
            strict=True,
        )
        motors = (
            len(reading.positions),
            *chain.from_iterable(
                (stiffness >= LIMP, position, velocity, 0.0, torque, min(255, max(0, round(heat))), 0, 0, 0)
                for stiffness, position, velocity, torque, heat in joints
            ),
        )
        unit = inertial.roll, inertial.pitch, heading, *inertial.angular_velocity, *inertial.acceleration
        return self._state.pack(*unit, *motors, *motors)

    def odometer(self) -> bytes:
        """Return where the robot believes it is."""
        return _ODOMETER.pack(*self._loco.place())

    def fall(self) -> bytes:
        """Return whether the robot has fallen; it does not get up."""
        return _FALL.pack(_HAS_FALLEN if self._robot.state().fallen else 0)

    def _motors(self, data: bytes) -> Iterator[tuple[float, ...]]:
        """Return q, dq, tau, kp, kd and the weight of each motor in a command. Raises HardwareFailure."""
        count = int.from_bytes(data[4:8], "little")
        end = 8 + _COMMAND.size * count
        if count > len(self._robot.joints) or end > len(data):
            raise HardwareFailure(f"it is for {count} motors, or cut off")
        return (tuple(values) for _mode, *values in _COMMAND.iter_unpack(data[8:end]))
