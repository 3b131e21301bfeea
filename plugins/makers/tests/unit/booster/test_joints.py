"""States and commands of the T1's joints as bytes, in virtual time and without DDS."""

from __future__ import annotations

import dataclasses
import random
import struct

import pytest

from naoserver.bodies.capabilities import InertialReading
from naoserver.robot import LIMP, BodyState
from plugins.makers.tests.support.maker_rigs import T1Rig
from plugins.makers.tests.unit.booster.test_loco import ELBOW
from tests.support.soak import repeated
from visualhfsm_makers._booster._joints import Joints
from visualhfsm_makers._booster._loco import CUSTOM, WALKING

FORMS = {"motors": struct.Struct("<B3x6f"), "head": struct.Struct("<2I")}


def command(motors: dict[int, float], count: int = 23) -> bytes:
    """Return the bytes of a command of some motors to positions."""
    packed = (FORMS["motors"].pack(1, motors.get(n, 0.0), 0, 0, 50.0, 2.0, n in motors) for n in range(count))
    return FORMS["head"].pack(1, count) + b"".join(packed)


@pytest.fixture
def rig():
    rig = T1Rig()
    rig.mode(CUSTOM)
    yield rig
    rig.robot.close()


@pytest.fixture
def joints(rig):
    return Joints(rig.programs, rig.loco)


def test_motors_with_a_weight_follow(rig, joints):
    for _ in range(5):
        joints.obey(command({ELBOW: 0.5}), "program")
        rig.advance(0.1)
    assert rig.angle("Left_Elbow_Pitch") == pytest.approx(0.5, abs=0.02)
    rig.assembly.body.claims.check(["Right_Elbow_Pitch"])  # nobody has it


def test_a_command_that_is_not_obeyed_is_an_event(rig, joints):
    rig.assembly.gate.stop("a test")
    joints.obey(command({ELBOW: 0.5}), "program")
    newest = rig.assembly.events.snapshot()[0][-1]
    assert (newest.source, newest.message[:38]) == ("Booster", "ignored a program's command of joints:")
    rig.advance(0.1)
    assert rig.angle("Left_Elbow_Pitch") == pytest.approx(0.0)


def test_what_is_limited_is_an_event(rig, joints):
    joints.obey(command({ELBOW: 99.0}), "program")
    assert rig.events[-1] == "limited a program's command of joints to Left_Elbow_Pitch"


@pytest.mark.parametrize(
    "data",
    [b"", bytes(7), command({})[:-1], command({}, count=24), FORMS["head"].pack(1, 2**32 - 1)],
    ids=["nothing", "no length", "cut off", "too many motors", "endless"],
)
def test_what_is_no_command_is_ignored(rig, joints, data):
    joints.obey(data, "program")
    assert "motors, or cut off" in rig.events[-1]


def test_hostile_commands_keep_joints_within_their_limits(rig, joints):
    draw = random.Random(55)
    whole = command(dict.fromkeys(range(23), 0.1))
    for _ in range(repeated(300, soak=10_000)):
        place = draw.randrange(len(whole))
        joints.obey(whole[:place] + draw.randbytes(draw.randrange(40)) + whole[place:], "program")
        rig.advance(0.1)
        reading = rig.robot.read()
        for joint, position in zip(rig.robot.joints, reading.positions, strict=True):
            assert joint.lower - 1e-6 <= position <= joint.upper + 1e-6


@pytest.fixture
def state(joints):
    """Return the state as the maker's types read it."""
    pytest.importorskip("cyclonedds", reason="the extra booster is not installed")
    from visualhfsm_makers._booster._types import LowState

    return lambda: LowState.deserialize(b"\0\1\0\0" + joints.state())


@pytest.fixture
def reading(rig, monkeypatch):
    """What the joints read, in which each value is another one."""
    values = {
        name: tuple(1000.0 * n + joint for joint in range(23))
        for n, name in enumerate(("positions", "velocities", "torques"))
    }
    heat = (-40.0, 300.0, 35.6, *[20.0] * 20)
    stiffnesses = (LIMP, 0.9 * LIMP, *[1.0] * 21)
    read = dataclasses.replace(rig.robot.read(), **values, temperatures=heat, stiffnesses=stiffnesses)
    monkeypatch.setattr(rig.robot, "read", lambda: read)
    return read


def test_a_state_has_what_the_joints_read(reading, state):
    motors = state().motor_state_serial
    assert [motor.q for motor in motors] == [*reading.positions]
    assert [motor.dq for motor in motors] == [*reading.velocities]
    assert [motor.tau_est for motor in motors] == [*reading.torques]
    assert [motor.temperature for motor in motors[:4]] == [0, 255, 36, 20]
    assert [motor.mode for motor in motors] == [1, 0, *[1] * 21]


def test_what_is_not_known_of_a_motor_is_0(state):
    assert {(motor.ddq, motor.lost, *motor.reserve) for motor in state().motor_state_serial} == {(0,) * 4}


def test_the_parallel_motors_are_the_serial_ones(reading, state):
    assert state().motor_state_parallel == state().motor_state_serial


def test_a_state_has_the_inertial_unit_and_the_heading(rig, joints, state):
    unit = InertialReading((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), roll=0.25, pitch=-0.5)
    rig.robot.senses.feel(inertial=unit)
    rig.mode(WALKING)
    rig.walk(0.1, turn=0.5)
    rig.advance(2.0)
    told = state().imu_state
    assert told.rpy == pytest.approx([0.25, -0.5, 1.0])
    assert (told.gyro, told.acc) == ([*unit.angular_velocity], [*unit.acceleration])
    assert struct.unpack("<3f", joints.odometer()) == pytest.approx(rig.loco.place())


def test_a_fallen_robot_says_so(rig, joints, monkeypatch):
    assert joints.fall() == b"\0\0\0\0\0"
    monkeypatch.setattr(
        rig.robot, "state", lambda: BodyState(1.5, fallen=True, real_time_factor=1.0, lag=0.0)
    )
    assert joints.fall() == b"\2\0\0\0\0"
