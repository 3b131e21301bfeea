"""States and commands of the T1's joints as bytes, in virtual time and without DDS."""

from __future__ import annotations

import random
import struct

import pytest

from naoserver.booster._joints import Joints
from naoserver.booster._loco import CUSTOM
from naoserver.robot import BodyState
from tests.support.soak import repeated
from tests.unit.naoserver.booster.test_loco import ELBOW, Rig

FORMS = {"motors": struct.Struct("<B3x6f"), "head": struct.Struct("<2I")}


def command(motors: dict[int, float], count: int = 23) -> bytes:
    """Return the bytes of a command of some motors to positions."""
    packed = (FORMS["motors"].pack(0, motors.get(n, 0.0), 0, 0, 50.0, 2.0, n in motors) for n in range(count))
    return FORMS["head"].pack(1, count) + b"".join(packed)


@pytest.fixture
def rig():
    rig = Rig()
    rig.mode(CUSTOM)
    yield rig
    rig.robot.close()


@pytest.fixture
def joints(rig):
    return Joints(rig.robot, rig.assembly.events, rig.loco)


def test_motors_with_a_weight_follow(rig, joints):
    for _ in range(5):
        joints.obey(command({ELBOW: 0.5}), "program")
        rig.advance(0.1)
    assert rig.angle("Left_Elbow_Pitch") == pytest.approx(0.5, abs=0.02)
    rig.assembly.body.claims.check(["Right_Elbow_Pitch"])  # nobody has it


def test_a_command_that_is_not_obeyed_is_an_event(rig, joints):
    rig.assembly.gate.stop("a test")
    joints.obey(command({ELBOW: 0.5}), "program")
    assert "ignored a program's command of joints" in rig.assembly.events.snapshot()[0][-1].message
    rig.advance(0.1)
    assert rig.angle("Left_Elbow_Pitch") == pytest.approx(0.0)


@pytest.mark.parametrize(
    "data",
    [b"", bytes(7), command({})[:-1], command({}, count=24), FORMS["head"].pack(1, 2**32 - 1)],
    ids=["nothing", "no length", "cut off", "too many motors", "endless"],
)
def test_what_is_no_command_is_ignored(rig, joints, data):
    joints.obey(data, "program")
    assert "motors, or cut off" in rig.assembly.events.snapshot()[0][-1].message


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


def test_a_fallen_robot_says_so(rig, joints, monkeypatch):
    assert joints.fall() == b"\0\0\0\0\0"
    monkeypatch.setattr(
        rig.robot, "state", lambda: BodyState(1.5, fallen=True, real_time_factor=1.0, lag=0.0)
    )
    assert joints.fall() == b"\2\0\0\0\0"
