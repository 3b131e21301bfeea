"""Each body moves over the floor in its way; one whose limbs that way cannot move is refused."""

import pytest
from msgspec.structs import replace

from naoserver.bodies import find_body
from naoserver.errors import RobotError
from naoserver_sim.robot import SimulatedRobot
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

H25 = find_body("H25")


def test_a_body_without_a_way_to_move_has_no_walker():
    robot = SimulatedRobot(clock=VirtualClock(), body=replace(find_body("Cart"), walk=None))
    assert robot.walker is None


@pytest.mark.parametrize(
    "parts",
    [{"hinges": {}}, {"groups": replace(H25.groups, left_leg=H25.groups.left_leg[1:])}],
    ids=["no shoulders", "a short leg"],
)
def test_the_walk_of_a_nao_is_refused_to_other_limbs(parts):
    with pytest.raises(RobotError, match="steps are for the legs and arms of a Nao"):
        SimulatedRobot(clock=VirtualClock(), body=replace(H25, **parts))
