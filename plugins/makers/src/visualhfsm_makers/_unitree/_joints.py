"""The joints of a G1 as its maker's programs know them: states 500 times a second, and commands with gains.

Messages are packed by `struct`: the types of cyclonedds would take ten times the time. The checksum goes over
the layout in C, which has more padding than the wire.
"""

from __future__ import annotations

import cmath
import math
import struct
import zlib
from array import array
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import chain, count
from typing import Final

from interfaces.nao import JointCommand
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import InertialReading
from naoserver.errors import HardwareFailure
from naoserver.protocol.robot import LIMP, JointReading, Robot
from visualhfsm_makers._programs import Programs
from zenoh_ice.data.text import few, sentence

PERIOD: Final = 0.002
"""Wall seconds between two states."""
_TICKS: Final = round(1000.0 * PERIOD)
"""The same in ms; programs wait until the tick is not 0."""
_SLOTS: Final = 35
"""Motors in a message: a G1 has the first 29, in the order of its joints."""
_MODE_MACHINE: Final = 5
"""The maker's number of a G1 with 29 motors."""
_OFF: Final = JointCommand(0.0, 0.0, 0.0, 0.0, 0.0)
_COMMAND: Final = struct.Struct("<2BBx5fI" + "B3x5fI" * (_SLOTS - 1) + "5I")
_COMMAND_IN_C: Final = struct.Struct("<2B2x" + "B3x5fI" * _SLOTS + "4I")
_STATE: Final = struct.Struct("<8x2B2x4x13f2xBx4f2hf7I" + "B3x4f2hf7I" * (_SLOTS - 1) + "60x")
_WORD: Final = struct.Struct("<I")
_TICK, _FIRST_MOTOR, _STATE_CHECKSUM = 12, 70, _STATE.size - 4
"""Where they begin in a state."""
_NO_MOTOR: Final[tuple[float, ...]] = (0,) * 15
_PLACE: Final = struct.Struct("<iI4x13fxB14x8f400x")
"""Time, inertial unit, mode, position, height and velocity, among members that are 0."""
_WINDOW: Final = 0.1
"""Robot seconds over which the velocity is measured."""
_REVERSED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
SOURCE: Final = "Unitree"
"""Of events."""


def fsm_mode(robot: Robot) -> int:
    """Return the maker's number of how it is on its feet: 0 stands, 1 walks, 2 when they do not carry it."""
    if robot.state().fallen:
        return 2
    return int(robot.walker is not None and robot.walker.walking)


def checksum(layout: bytes | bytearray) -> int:
    """Return the maker's checksum of some words, in C's layout.

    It is a cyclic redundancy check over the bits of each word from the highest, with the polynomial
    0x04C11DB7, begun with all bits set, neither reflected nor inverted at the end.
    """
    words = array("I", layout)
    words.byteswap()
    value = zlib.crc32(words.tobytes().translate(_REVERSED)) ^ 0xFFFFFFFF
    return int(f"{value:032b}"[::-1], 2)


def unpack(data: bytes) -> tuple[tuple[float, ...], list[tuple[float, ...]]]:
    """Return the members of a command, and mode, position, velocity, torque, kp and kd of each motor.

    Raises HardwareFailure if it is none.
    """
    if len(data) != _COMMAND.size:
        raise HardwareFailure(f"it has {len(data)} bytes, not {_COMMAND.size}")
    values = _COMMAND.unpack(data)
    return values, [values[at : at + 6] for at in range(2, 2 + 7 * _SLOTS, 7)]


class Joints:
    """Pack the states of a robot in one thread, and pass commands on to the guard of gains in another one.

    While the walk `has_joints`, motors whose mode is 0 are left to it; else they are off.
    """

    def __init__(self, programs: Programs, has_joints: Callable[[], bool] = lambda: True) -> None:
        robot = programs.robot
        assert robot.walker is not None  # a G1
        self._walker = robot.walker
        self._unit = InertialReading if robot.senses is None else robot.senses.inertial
        self._programs = programs
        self._robot = robot
        self.obey: Final = partial(programs.obey, sentence("a low command"), self._command)
        self._has_joints = has_joints
        self._names = [joint.name for joint in find_body("G1").joints]
        places = {joint.name: place for place, joint in enumerate(robot.joints)}
        self._places = [(slot, places[name]) for slot, name in enumerate(self._names) if name in places]
        self._volts = robot.body.battery.voltage if robot.body.battery else 0.0
        self._ticks = count(_TICKS, _TICKS)
        self._reading: JointReading | None = None
        self._packed = bytearray()
        self._past = self._walker.odometry()
        self._velocity = 0j
        self._height = programs.height()

    def _command(self, data: bytes, client: str) -> Mapping[str, JointCommand]:
        """Let the motors whose mode is not 0 follow a command; return what was limited."""
        values, every_motor = unpack(data)
        if checksum(_COMMAND_IN_C.pack(*values[:-1])) != values[-1]:
            raise HardwareFailure("its checksum is wrong")
        if (machine := values[1]) != _MODE_MACHINE:
            what = f"its mode_machine is {machine}, and that of this robot {_MODE_MACHINE}"
            raise HardwareFailure(f"{what}: take it from rt/lowstate")
        motors = dict(zip(self._names, every_motor, strict=False))
        off = [name for name, (mode, *_) in motors.items() if not mode]
        left = self._has_joints()
        if gains := [name for name in off if any(motors[name][3:])]:
            what = "left to the walk" if left else "off"
            text = f"motors with gains are {what}, as their mode is 0, not 1: {few(gains)}"
            self._programs.warn("mode", text)
        commands = {name: JointCommand(*motor[1:]) for name, motor in motors.items() if motor[0]}
        if not left:
            commands |= dict.fromkeys(off, _OFF)
        limited = self._programs.gains.command(commands, client)
        return {name: limited[name] for name in limited.keys() - set(off)}

    def state(self, ticks: Iterator[int] | None = None) -> bytes:
        """Return the newest state with its number, by default the next one each PERIOD, and its checksum."""
        reading = self._robot.read()
        if reading is not self._reading:
            self._reading, self._packed = reading, bytearray(self._pack(reading))
        packed, first = self._packed, _FIRST_MOTOR
        _WORD.pack_into(packed, _TICK, next(ticks or self._ticks) % 2**32)
        # C pads the end of the inertial unit, and the mode of the first motor by two bytes more.
        layout = packed[:first] + b"\0\0" + packed[first : first + 2] + b"\0\0" + packed[first + 2 : -4]
        _WORD.pack_into(packed, _STATE_CHECKSUM, checksum(layout))
        return bytes(packed)

    def _pack(self, reading: JointReading) -> bytes:
        motors = [_NO_MOTOR] * _SLOTS
        for slot, at in self._places:
            follows, warmth = reading.stiffnesses[at] >= LIMP, round(reading.temperatures[at])
            moves = reading.positions[at], reading.velocities[at], 0.0, reading.torques[at]
            motors[slot] = (follows, *moves, warmth, warmth, self._volts, *[0] * 7)
        return _STATE.pack(0, _MODE_MACHINE, *self._inertial(), *chain.from_iterable(motors))

    def place(self) -> bytes:
        """Return where the robot believes it is, and how fast, in its own frame."""
        now, past = self._walker.odometry(), self._past
        since = now.time - past.time
        if since < 0.0:  # a simulation began again
            self._past, self._velocity = now, 0j
        elif since >= _WINDOW:
            way = complex(now.x - past.x, now.y - past.y) * cmath.rect(1.0, -now.heading)
            self._past, self._velocity = now, way / since
            self._height = self._programs.height()
        seconds, part = divmod(round(1e9 * now.time), 10**9)
        x, y, turn = self._velocity.real, self._velocity.imag, self._unit().angular_velocity[2]
        height = self._height
        mode, where = fsm_mode(self._robot), (now.x, now.y, height)
        return _PLACE.pack(seconds, part, *self._inertial(), mode, *where, height, x, y, 0.0, turn)

    def _inertial(self) -> tuple[float, ...]:
        """Return orientation w, x, y, z, rate, acceleration, and roll, pitch and yaw."""
        unit = self._unit()
        angles = unit.roll, unit.pitch, self._walker.odometry().heading
        (cr, sr), (cp, sp), (cy, sy) = ((math.cos(each / 2), math.sin(each / 2)) for each in angles)
        w, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
        y, z = cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy
        return (w, x, y, z, *unit.angular_velocity, *unit.acceleration, *angles)
