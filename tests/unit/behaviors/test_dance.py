"""The paper's second experiment, `dance`, in virtual time: both arms go through four positions repeatedly."""

from __future__ import annotations

import pytest

from tests.support.soak import repeated
from visualhfsm.testing import Behavior, MakeBehavior, check_properties

DOCUMENT = "behaviors/dance.xml"
# Shoulder pitch and roll, elbow yaw and roll of the right arm, in rad, as the document has them.
POSITIONS = {
    "up": (-1.2, -0.2, 0.8, 0.5),
    "out": (0.2, -1.1, 0.8, 0.3),
    "front": (0.1, -0.2, 0.8, 0.8),
    "low": (1.3, -0.3, 1.2, 0.6),
}
ORDER = list(POSITIONS)
JOINTS = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
MIRRORED = (1, -1, -1, -1)


@pytest.fixture
def b(behavior: MakeBehavior) -> Behavior:
    return behavior(DOCUMENT, robot="fake")


def arm(b: Behavior, side: str) -> tuple[float, ...]:
    """Return where an arm is, the left one mirrored to the right."""
    signs = (1, 1, 1, 1) if side == "R" else MIRRORED
    return tuple(sign * b.robot.joint(side + name) for sign, name in zip(signs, JOINTS, strict=True))


def test_the_positions_come_in_their_order_again_and_again(b: Behavior) -> None:
    b.run_until(lambda: len(b.changes("dance")) == 10)
    assert [state for _, state in b.changes("dance")] == (ORDER * 3)[:10]


def test_a_position_is_left_when_both_arms_have_reached_it(b: Behavior) -> None:
    for position in ORDER * 2:
        assert b.active == position
        b.run_until(lambda: b.active != position, limit=5.0)  # noqa: B023
        for side in "RL":
            assert arm(b, side) == pytest.approx(POSITIONS[position], abs=0.1)


def test_it_waits_for_the_slower_arm(b: Behavior) -> None:
    b.stub("LeftShoulderMotors", setPose3DMotorsData=0)  # it says yes and does not move
    b.advance(10.0)
    assert b.active == "up"
    assert arm(b, "R") == pytest.approx(POSITIONS["up"], abs=0.01)


def test_one_round_takes_as_long_as_the_arms_need_at_their_speed(b: Behavior) -> None:
    b.run_until(lambda: len(b.changes("dance")) == 9)
    first, second = (b.changes("dance")[index + 4][0] - b.changes("dance")[index][0] for index in (0, 4))
    # The shoulder's 1.4 + 0.9 + 1.2 + 2.5 rad at 1.4 rad/s, and the lag of four positions.
    assert second == pytest.approx(4.2, abs=0.6)
    assert first == pytest.approx(second, abs=1.0)


def test_every_command_moves_both_arms_alike(b: Behavior) -> None:
    b.advance(6.0)
    left, right = (b.calls(f"{side}ShoulderMotors.setPose3DMotorsData") for side in ("Left", "Right"))
    assert len(left) == len(right) == 61
    for mine, other in zip(left, right, strict=True):
        assert (mine.time, mine.state) == (other.time, other.state)
        assert (mine.data.tilt, mine.data.roll) == (other.data.tilt, -other.data.roll)


def test_an_arm_that_cannot_be_read_stops_the_dance(behavior: MakeBehavior) -> None:
    b = behavior(DOCUMENT, robot="fake", on_error="stop")
    b.advance(1.0)
    b.stub("RightElbowEncoders", getPose3DEncodersData=ValueError("no encoder"))
    b.advance(1.0)
    assert b.halted
    assert "no encoder" in b.errors[-1].message
    assert b.errors[-1].time == pytest.approx(1.1)
    assert arm(b, "R")[0] > POSITIONS["up"][0] + 0.5, "the arm is held on its way"
    still = b.robot.joints
    b.advance(1.0)
    assert b.robot.joints == pytest.approx(still, abs=1e-3)


def test_whatever_the_arms_do_one_position_follows_the_other() -> None:
    def in_order(b: Behavior) -> bool:
        states = [state for _, state in b.changes("dance")]
        return states == (ORDER * len(states))[: len(states)]

    check_properties(DOCUMENT, in_order, examples=repeated(10, 30))


@pytest.mark.sim
def test_an_error_in_the_dance_stops_the_arms_of_the_simulated_robot_on_their_way(
    behavior: MakeBehavior,
) -> None:
    b = behavior(DOCUMENT, robot="sim", world="empty", camera="drawn", on_error="stop")
    joints = [side + name for side in "LR" for name in JOINTS]

    def fastest() -> float:
        reading = b.robot.device.read()
        speeds = dict(zip((each.name for each in b.robot.device.joints), reading.velocities, strict=True))
        return max(abs(speeds[joint]) for joint in joints)

    b.run_until("low")
    b.advance(0.5)
    assert fastest() > 1.0, "the arms are in full swing"
    b.stub("RightElbowEncoders", getPose3DEncodersData=ValueError("no encoder"))
    b.advance(0.1)
    assert b.halted
    b.advance(0.3)
    assert fastest() < 0.05
    assert arm(b, "R")[0] < POSITIONS["low"][0] - 0.3, "they are held before their goal"
    still = b.robot.joints
    b.advance(2.0)
    assert b.robot.joints == pytest.approx(still, abs=0.02)
    assert b.robot.state.torso_tilt < 0.3
