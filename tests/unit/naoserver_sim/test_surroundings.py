"""Signs of a world: what is on them, and how a camera sees them."""

import pytest

from naoserver.errors import RobotError
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import parse_world

pytest.importorskip("cv2")

WORLD = """
[[signs]]
position = [1.2, 0.3]
landmark = 68

[[signs]]
position = [1.2, 0.0]
height = 0.6
size = 0.25
"""


@pytest.fixture(scope="module")
def robot():
    robot = SimulatedRobot(world=parse_world(WORLD, "signs"), skin=False)
    robot.start()
    yield robot
    robot.close()


@pytest.mark.sim
def test_what_describes_the_world_shows_their_boards(robot):
    kinds = [shape.kind for shape in robot.stage.shapes]
    assert sorted(kinds) == ["Box", "Box", "Plane"]


@pytest.mark.parametrize("line", ["landmark = 250", "size = 0.0", "height = -1.0", "number = 3"])
def test_signs_that_are_wrong(line):
    with pytest.raises(RobotError, match="signs"):
        parse_world(f"[[signs]]\nposition = [1.0, 0.0]\n{line}\n", "signs")
