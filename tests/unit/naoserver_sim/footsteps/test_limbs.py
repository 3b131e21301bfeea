"""The limbs of a body, found in its model."""

import pytest
from msgspec.structs import replace

from naoserver.bodies.parts import Coupling
from naoserver.errors import RobotError
from naoserver_sim._footsteps.limbs import limbs_of
from tests.support.humanoids import BODIES, Humanoid

pytestmark = pytest.mark.sim


@pytest.mark.parametrize("body", sorted(BODIES))
def test_the_joints_of_the_legs_are_found_from_the_hip_down(body):
    names = [name.lower() for name in Humanoid(body).leg_names]
    assert len(names) == 12
    for leg, side in ((names[:6], "left"), (names[6:], "right")):
        assert all(side in name for name in leg)
        for name, part in zip(leg, ("hip", "hip", "hip", "knee", "ankle", "ankle"), strict=True):
            assert part in name


def test_joints_that_share_a_motor_are_refused():
    robot = Humanoid("booster_t1")
    pair = Coupling(leader="Left_Ankle_Roll", follower="Right_Ankle_Roll")
    with pytest.raises(RobotError, match="separate motor for each joint of a leg, not as Right_Ankle_Roll"):
        limbs_of(robot.mj, replace(robot.body, couplings=(pair,)))


def test_a_foot_that_is_no_end_of_a_leg_is_refused():
    robot = Humanoid("booster_t1")
    shanks = tuple(
        replace(sole, link=link)
        for sole, link in zip(robot.body.soles, ("Shank_Left", "Shank_Right"), strict=True)
    )
    with pytest.raises(RobotError, match=r"Shank_Left has 4 joints: it needs 6 hinges"):
        limbs_of(robot.mj, replace(robot.body, soles=shanks))
