"""Where a neck points so that the cameras of a body see a place, by the same kinematics as `getFloorPoint`."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from naoserver.bodies import find_body
from naoserver.bodies.kinematics import kinematics_of
from naoserver.bodies.parts import Axis
from naoserver.errors import RobotError
from visualhfsm_match.gaze import Gaze

BODIES = ("H25", "T1", "G1", "Cart")
PLACES = [(1.0, 0.0), (1.2, 0.8), (1.5, -1.0), (3.0, 0.6)]


def axis_of(body, pan, tilt):
    """Return place and direction of the middle of what a body's cameras see, in the robot's frame."""
    neck = body.hinges["Neck"]
    angles = dict(body.resting_angles)
    for axis, angle in ((Axis.PAN, pan), (Axis.TILT, tilt)):
        angles[neck[axis].joint] = neck[axis].joint_angle(angle)
    of = kinematics_of(body)
    link = of.torso_place(angles) @ of.link_place(body.cameras[0].link, angles)
    down = sum(camera.tilt for camera in body.cameras) / len(body.cameras)
    lowest = max(body.cameras, key=lambda camera: camera.tilt)
    return (link @ [*lowest.position, 1.0])[:3], link[:3, :3] @ [math.cos(down), 0.0, -math.sin(down)]


@pytest.mark.parametrize(("x", "y"), PLACES)
@pytest.mark.parametrize("name", BODIES)
def test_a_place_is_at_the_height_of_the_middle_of_the_picture(name, x, y):
    body = find_body(name)
    pan, tilt = Gaze(body).at(x, y, 0.05)
    assert pan == pytest.approx(math.atan2(y, x), abs=1e-6)
    camera, axis = axis_of(body, pan, tilt)
    way = np.array([x, y, 0.05]) - camera
    below = math.asin(-way[2] / np.linalg.norm(way)) - math.asin(-axis[2])
    assert abs(below) < 0.02
    assert Gaze(body).sees(x, y, 0.05)


def test_the_neck_is_asked_for_what_its_tables_leave():
    body = find_body("H25")
    tilting = body.joint[body.hinges["Neck"][Axis.TILT].joint]
    table = next(table for table in body.tables if table.dependent == tilting.name)
    for bearing in (0.0, 0.5, -1.1, 1.9):
        pan, tilt = Gaze(body).at(0.1 * math.cos(bearing), 0.1 * math.sin(bearing))
        assert pan == pytest.approx(bearing)
        assert tilt == min(table.at(bearing)[1], tilting.upper)


@pytest.mark.parametrize(("name", "seen"), [("H25", True), ("T1", False), ("G1", False)])
def test_a_ball_that_can_be_kicked_is_in_sight_or_not(name, seen):
    body = find_body(name)
    assert {Gaze(body).sees(*kick.place, 0.05) for kick in body.kicks.values()} == {seen}


@pytest.mark.parametrize("name", ["H25", "T1"])
def test_what_lies_behind_is_out_of_sight(name):
    assert not Gaze(find_body(name)).sees(-2.0, 0.1)


def test_a_waist_that_serves_as_a_neck_turns_slowly_and_hardly_bows():
    head, waist = Gaze(find_body("T1")), Gaze(find_body("G1"))
    assert waist.pace < head.pace < 1.0
    assert waist.at(0.3, 0.0)[1] < 0.25 < head.at(0.3, 0.0)[1]


def test_a_body_that_cannot_look_says_so():
    body = find_body("T1")
    for lacking in (replace(body, cameras=()), replace(body, hinges={})):
        with pytest.raises(RobotError, match="Booster T1 cannot look anywhere"):
            Gaze(lacking)
