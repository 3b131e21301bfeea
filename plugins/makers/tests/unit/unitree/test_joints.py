"""States and commands of the G1's joints as bytes, in virtual time and without DDS."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Sequence

import numpy as np
import pytest

from naoserver.bodies.capabilities import InertialReading, Odometry, WalkVelocity
from naoserver.bodies.kinematics import matrix_of
from naoserver.errors import JointTaken
from naoserver.options import SafetyOptions
from naoserver.robot import LIMP
from plugins.makers.tests.support.maker_rigs import MakerRig
from visualhfsm_makers._unitree import _joints
from visualhfsm_makers._unitree._joints import Joints, checksum
from visualhfsm_makers._unitree._loco import CODES

OPTIONS = SafetyOptions()
ELBOW = 18
"""The maker's number of the left elbow."""
WIRE = struct.Struct("<2BBx5fI" + "B3x5fI" * 34 + "5I")
IN_C = struct.Struct("<2B2x" + "B3x5fI" * 35 + "4I")


def slow_checksum(layout: bytes) -> int:
    """Compute the maker's checksum bit by bit."""
    value = 0xFFFFFFFF
    for (word,) in struct.iter_unpack("<I", layout):
        for place in range(31, -1, -1):
            carry = (value >> 31) ^ (word >> place & 1)
            value = (value << 1 & 0xFFFFFFFF) ^ (0x04C11DB7 if carry else 0)
    return value


def command(
    motors: dict[int, Sequence[float]], *, change: int = 0, machine: int = 5, off: Sequence[int] = ()
) -> bytes:
    """Return a command: for each motor position, velocity, torque, kp and kd. The others, and `off`, are off."""
    values: list[float] = [0, machine]
    for motor in range(35):
        values += [motor in motors and motor not in off, *motors.get(motor, (0.0,) * 5), 0]
    values += [0] * 4
    return WIRE.pack(*values, slow_checksum(IN_C.pack(*values)) ^ change)


class Rig(MakerRig):
    def __init__(self) -> None:
        super().__init__("G1", "Unitree", CODES)
        self.walks = True
        self.joints = Joints(self.programs, lambda: self.walks)

    def live(self, seconds: float, data: bytes = b"") -> None:
        for _ in range(round(seconds / OPTIONS.period)):
            if data:
                self.joints.obey(data, "program")
            self.clock.advance(OPTIONS.period)
            self.assembly.jobs[0].run()

    def position(self, motor: int) -> float:
        return self.robot.read().positions[motor]


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.robot.close()


def test_the_checksum_is_that_of_the_maker():
    data = random.Random(1).randbytes(4 * 50)
    assert checksum(data) == slow_checksum(data)


def test_a_command_moves_its_joints_alone(rig):
    before = rig.robot.read().positions
    rig.live(1.0, command({ELBOW: (before[ELBOW] + 0.2, 0, 0, 60, 2)}))
    assert rig.position(ELBOW) == pytest.approx(before[ELBOW] + 0.2, abs=0.02)
    moved = [one != two for one, two in zip(before, rig.robot.read().positions, strict=True)]
    assert moved == [motor == ELBOW for motor in range(29)]


def test_while_the_walk_has_the_joints_a_motor_that_is_off_is_left_to_it(rig):
    before = rig.position(ELBOW)
    rig.live(0.5, command({ELBOW: (before + 0.2, 0, 0, 60, 2)}, off=[ELBOW]))
    assert rig.position(ELBOW) == before
    text = "motors with gains are left to the walk, as their mode is 0, not 1: left_elbow_joint"
    assert text in "\n".join(rig.events)


def test_motors_that_are_left_to_the_walk_are_not_taken_from_it(rig):
    rig.joints.obey(command({ELBOW: (0.2, 0, 0, 60, 2)}), "program")
    names = [joint.name for joint in rig.robot.joints]
    with pytest.raises(JointTaken):
        rig.assembly.body.claims.check([names.pop(ELBOW)])
    rig.assembly.body.claims.check(names)


def test_a_motor_that_is_off_after_a_release_has_no_torque(rig, monkeypatch):
    sent: dict[str, Sequence[float]] = {}
    monkeypatch.setattr(rig.robot, "command_gains", sent.update)
    rig.walks = False
    rig.joints.obey(command(dict.fromkeys(range(29), (0, 0, 0, 60, 2)), off=[ELBOW]), "program")
    names = [joint.name for joint in rig.robot.joints]
    assert sent.keys() == set(names)
    assert sent[names[ELBOW]][1:5] == (0.0, 0.0, 0.0, 0.0)
    assert sent[names[ELBOW + 1]][3:5] == (60.0, 2.0)
    assert "motors with gains are off, as their mode is 0, not 1: left_elbow_joint" in "\n".join(rig.events)


def test_a_motor_that_is_off_and_has_nothing_to_do_is_no_event(rig):
    rig.walks = False
    rig.joints.obey(command({}), "program")
    assert rig.events == []


def test_the_death_of_its_program_holds_what_it_moved(rig):
    rig.live(0.2, command({ELBOW: (0, 1.0, 0, 0, 5)}))
    rig.programs.drop("program")
    there = rig.position(ELBOW)
    rig.live(OPTIONS.damping_time + 0.2)
    assert rig.position(ELBOW) == pytest.approx(there, abs=0.05)
    assert not rig.assembly.moves_for("program")


def test_a_silent_program_moves_nothing_on(rig):
    rig.live(0.2, command({ELBOW: (0, 1.0, 0, 0, 5)}))
    rig.live(OPTIONS.gains_timeout + OPTIONS.damping_time + 0.2)
    there = rig.position(ELBOW)
    rig.live(0.5)
    assert rig.position(ELBOW) == there
    assert not rig.assembly.moves_for("program")


@pytest.mark.parametrize(
    ("data", "event"),
    [
        (command({})[:-4], "it has 996 bytes, not 1000"),
        (command({ELBOW: (0, 0, 0, 60, 2)}, change=1), "ignored a low command: its checksum is wrong"),
        (
            command({ELBOW: (0, 0, 0, 60, 2)}, machine=0),
            "ignored a low command: its mode_machine is 0, and that of this robot 5: take it from rt/lowstate",
        ),
        (command({ELBOW: (math.nan, 0, 0, 60, 2)}), "left_elbow_joint"),
        (command({ELBOW: (99.0, 0, 0, 60, 2)}), "limited a low command to left_elbow_joint"),
    ],
    ids=["size", "checksum", "machine", "not a number", "beyond its range"],
)
def test_the_events_say_what_a_command_is_not(rig, data, event):
    rig.joints.obey(data, "program")
    assert event in "\n".join(rig.events)


def test_a_stopped_robot_ignores_commands(rig):
    rig.assembly.gate.stop("a test")
    before = rig.position(ELBOW)
    rig.live(0.3, command({ELBOW: (before + 0.2, 0, 0, 60, 2)}))
    assert rig.position(ELBOW) == before
    assert "ignored a low command" in "\n".join(rig.events)


@pytest.mark.slow
def test_random_commands_keep_every_joint_within_its_range(rig):
    draw = random.Random(55)
    for _ in range(300):
        values = [[draw.uniform(-1, 1) * 10 ** draw.randint(0, 38) for _ in range(5)] for _ in range(35)]
        rig.live(OPTIONS.period, command(dict(enumerate(values))))
        for facts, at in zip(rig.robot.joints, rig.robot.read().positions, strict=True):
            assert facts.lower - 1e-6 <= at <= facts.upper + 1e-6


@pytest.fixture
def types():
    """The maker's types, which read what was packed."""
    pytest.importorskip("cyclonedds", reason="the extra unitree is not installed")
    from visualhfsm_makers._unitree import _types

    return _types


def state_of(rig, types):
    return types.LowState.deserialize(b"\0\1\0\0" + rig.joints.state())


def place_of(rig, types):
    return types.SportModeState.deserialize(b"\0\1\0\0" + rig.joints.place())


def test_a_state_is_what_the_types_say(rig, types):
    rig.joints.state()
    state = state_of(rig, types)
    reading = rig.robot.read()
    assert [motor.q for motor in state.motor_state[:29]] == pytest.approx(reading.positions)
    assert [motor.mode for motor in state.motor_state] == [1] * 29 + [0] * 6
    assert (state.mode_pr, state.mode_machine, state.tick) == (0, 5, 4)
    assert state.imu_state.quaternion == [1.0, 0.0, 0.0, 0.0]
    assert state.imu_state.accelerometer[2] == pytest.approx(9.81)
    flat = state.serialize(use_version_2=False)[4:]
    layout = flat[:70] + b"\0\0" + flat[70:72] + b"\0\0" + flat[72:-4]
    assert state.crc == slow_checksum(layout)


def test_what_is_not_known_of_a_motor_is_0(rig, types):
    motor = state_of(rig, types).motor_state[ELBOW]
    assert [motor.ddq, *motor.sensor, motor.motorstate, *motor.reserve] == [0] * 8


@pytest.mark.parametrize(("stiffness", "mode"), [(LIMP, 1), (0.9 * LIMP, 0)])
def test_a_limp_motor_is_off(rig, types, stiffness, mode):
    rig.assembly.body.stiffen({rig.robot.joints[ELBOW].name: stiffness}, 0.0)
    assert state_of(rig, types).motor_state[ELBOW].mode == mode


def test_after_weeks_its_number_begins_again(rig, types, monkeypatch):
    monkeypatch.setattr(_joints, "_TICKS", 2**31)
    rig.joints = Joints(rig.programs)
    assert [state_of(rig, types).tick for _ in range(3)] == [2**31, 0, 2**31]


def test_a_state_has_the_inertial_unit_and_the_orientation(rig, types):
    roll, pitch, heading = 0.3, -0.5, 1.2
    unit = InertialReading((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), roll, pitch)
    rig.robot.senses.feel(inertial=unit)
    rig.programs.drive(WalkVelocity(turn=0.4), 9.0, "program")
    rig.clock.advance(heading / 0.4)
    state = state_of(rig, types).imu_state
    assert state.rpy == pytest.approx([roll, pitch, heading])
    assert state.accelerometer == pytest.approx(unit.acceleration)
    assert state.gyroscope == pytest.approx(unit.angular_velocity)
    w, *axis = state.quaternion
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    assert turned == pytest.approx(matrix_of((0, 0, 0, roll, pitch, heading))[:3, :3], abs=1e-6)


def test_where_it_is_and_how_fast_is_in_its_odometry(rig, types):
    rig.programs.drive(WalkVelocity(turn=0.5), 2.0, "program")
    rig.clock.advance(2.0)
    rig.programs.drive(WalkVelocity(forward=0.2, left=0.1), 9.0, "program")
    for _ in range(5):
        rig.clock.advance(0.1)
        place = place_of(rig, types)
    where = rig.robot.walker.odometry()
    assert where.heading == pytest.approx(1.0)
    assert place.position[:2] == pytest.approx([where.x, where.y])
    assert place.velocity == pytest.approx([0.2, 0.1, 0.0], abs=1e-6)
    assert place_of(rig, types).velocity == place.velocity  # at the same moment
    assert (place.stamp.sec, place.stamp.nanosec) == (2, 500_000_000)


def test_its_mode_is_in_its_odometry(rig, types):
    assert place_of(rig, types).mode == 0
    rig.programs.drive(WalkVelocity(turn=0.5), 2.0, "program")
    assert place_of(rig, types).mode == 1


def test_a_simulation_that_began_again_stands(rig, types, monkeypatch):
    rig.programs.drive(WalkVelocity(forward=0.2), 9.0, "program")
    rig.clock.advance(0.1)
    assert place_of(rig, types).velocity[0] == pytest.approx(0.2)
    monkeypatch.setattr(rig.robot.walker, "odometry", lambda: Odometry(0.05, 0.0, 0.0, 0.0))
    assert place_of(rig, types).velocity == [0.0, 0.0, 0.0]
    monkeypatch.setattr(rig.robot.walker, "odometry", lambda: Odometry(0.25, 0.01, 0.0, 0.0))
    assert place_of(rig, types).velocity[0] == pytest.approx(0.05)
