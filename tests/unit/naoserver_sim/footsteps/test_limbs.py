"""The limbs of a body, found in its model."""

import pytest

from naoserver.errors import RobotError
from naoserver_sim._footsteps.limbs import find_limbs
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


def test_a_foot_that_is_no_end_of_a_leg_is_refused():
    robot = Humanoid("booster_t1")
    names = [robot.mj.joint(index).name for index in range(1, robot.mj.njnt)]
    with pytest.raises(RobotError, match=r"Shank_Left has 4 hinges.*needs 6"):
        find_limbs(robot.mj, "Trunk", ("Shank_Left", "Shank_Right"), names)


def test_a_base_without_a_free_joint_is_refused():
    robot = Humanoid("booster_t1")
    names = [robot.mj.joint(index).name for index in range(1, robot.mj.njnt)]
    with pytest.raises(RobotError, match="Waist has no free joint"):
        find_limbs(robot.mj, "Waist", ("left_foot_link", "right_foot_link"), names)
