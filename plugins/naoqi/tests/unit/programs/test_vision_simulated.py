"""Landmarks and faces in what a simulated camera sees."""

import math
import time

import pytest

pytest.importorskip("qi")
pytest.importorskip("cv2")

from naoserver.bodies.nao import H25
from naoserver.errors import HardwareFailure
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import parse_world
from tests.support.limits import EVENT_LIMIT
from tests.support.soak import cases
from visualhfsm_naoqi.programs import _vision as vision
from zenoh_ice import VirtualClock

BLACK = 0.09
"""Width in m of the black square of a landmark of 12 cm."""
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


@pytest.mark.gl
@pytest.mark.sim
@pytest.mark.parametrize("distance", cases([1.5], [0.5, 1.0, 2.0]))
def test_a_landmark_is_as_wide_as_at_its_distance(distance):
    widths = []
    for shift in (-0.05, -0.02, 0.01, 0.03, 0.05):
        sign = f"[[signs]]\nposition = [{distance}, {shift}]\nheight = {0.45 + shift}\nsize = 0.12\nlandmark = 68\n"
        robot = SimulatedRobot(world=parse_world(sign, "sign"), skin=False, clock=VirtualClock())
        place, axes = robot.camera_pose("Camera")
        depth = axes[:, 2] @ (place - [distance, shift, 0.45 + shift])
        ((_, (_, _, width, _)),) = vision.find_landmarks(robot.capture("Camera", 320, 240).pixels)
        widths.append(width / 160 * math.tan(H25.cameras[0].horizontal_fov / 2) * depth)
        robot.close()
    assert sum(widths) / len(widths) == pytest.approx(BLACK, rel=0.02)
