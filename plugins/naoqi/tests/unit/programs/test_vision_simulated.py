"""Landmarks, faces and red balls before a simulated camera."""

import math
import time

import numpy as np
import pytest

pytest.importorskip("qi")
pytest.importorskip("cv2")

from naoserver.bodies.nao import H25
from naoserver.errors import HardwareFailure
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import parse_world
from plugins.naoqi.tests.support.rig import Rig
from tests.support.limits import EVENT_LIMIT
from tests.support.soak import cases
from visualhfsm_naoqi.programs import _vision as vision
from visualhfsm_naoqi.programs._memory import ALMemory
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
BALLS = "".join(
    f'[[balls]]\nname = "{name}"\nposition = {place}\nradius = 0.06\ncolor = {color}\n'
    for name, place, color in (
        ("Far", [2.0, -0.5], [0.8, 0.05, 0.05]),
        ("Near", [1.5, 0.2], [0.8, 0.05, 0.05]),
        ("Orange", [1.2, 0.0], [0.95, 0.4, 0.0]),
    )
)


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


@pytest.fixture
def among_balls():
    """A simulated robot in virtual time, as NAOqi, with balls before it."""
    world = parse_world(BALLS, "balls")
    rig = Rig(lambda clock: SimulatedRobot(world=world, skin=False, clock=clock))
    yield rig
    rig.close()


@pytest.mark.sim
def test_of_red_balls_that_a_simulation_knows_the_nearest_is_reported_without_a_picture(
    among_balls, monkeypatch
):
    rig, robot = among_balls, among_balls.robot
    monkeypatch.setattr(robot, "capture", lambda *_: pytest.fail("a picture was taken"))
    detector = rig.access.service(vision.ALRedBallDetection)
    detector.subscribe("test")
    rig.advance(0.1)
    detector._look()
    place, axes = robot.camera_pose("Camera")
    right, up, back = axes.T @ (np.array([1.5, 0.2, 0.06]) - place)
    _, (left, down, width, _), *_ = rig.access.service(ALMemory).getData("redBallDetected")
    assert (left, down) == pytest.approx((math.atan2(-right, -back), math.atan2(-up, -back)), abs=0.01)
    assert width == pytest.approx(2 * math.atan(0.06 / math.hypot(right, up, back)), rel=0.02)
