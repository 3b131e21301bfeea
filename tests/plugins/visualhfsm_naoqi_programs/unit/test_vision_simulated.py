"""Landmarks and faces in what a simulated camera sees."""

import time

import pytest

pytest.importorskip("qi")
pytest.importorskip("cv2")

from naoserver.errors import HardwareFailure
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import parse_world
from tests.support.limits import EVENT_LIMIT
from visualhfsm_naoqi_programs import _vision as vision

WORLD = """
[[signs]]
position = [1.2, 0.3]
landmark = 68

[[signs]]
position = [1.2, 0.0]
height = 0.6
size = 0.25
"""


@pytest.fixture
def robot():
    robot = SimulatedRobot(world=parse_world(WORLD, "signs"), skin=False)
    robot.start()
    yield robot
    robot.close()


def seen(robot):
    """Return a picture of the top camera; the first one may take longer than a robot waits."""
    limit = time.monotonic() + EVENT_LIMIT
    while True:
        try:
            return robot.capture("Camera", 320, 240).pixels
        except HardwareFailure:
            if time.monotonic() > limit:
                raise


@pytest.mark.gl
@pytest.mark.sim
def test_a_camera_sees_landmark_and_face(robot):
    picture = seen(robot)
    ((number, (x, _, width, _)),) = vision.find_landmarks(picture)
    assert number == 68
    assert x < 110
    assert width == pytest.approx(42, abs=5)
    ((x, y, _, _),) = vision.find_faces(picture)
    assert (x, y) == pytest.approx((160, 55), abs=6)
