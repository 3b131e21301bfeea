"""The sonar, compared with geometric distances."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from naoserver_sim._senses.record import SenseNoise
from naoserver_sim._senses.simulated import SonarModel
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import BALL_RADIUS
from tests.support.examples import examples
from tests.support.physics import rotation
from tests.support.present import present
from zenoh_ice.threads.clock import VirtualClock

pytestmark = pytest.mark.sim

FACTS = present(H25.sonar)
HALF_CONE = FACTS.cone / 2
RADIUS = 0.06
HEIGHT = 0.33
"""Of the torso above the floor in m."""

SCENE = f"""
<mujoco>
  <worldbody>
    <geom type="plane" size="9 9 0.1"/>
    <body name="torso"><freejoint/><geom size="0.05"/><geom name="shell" type="box" size="0.2 0.2 0.3" group="1"/></body>
    <body name="ball"><freejoint/><geom size="{RADIUS}"/></body>
    <body name="wall"><freejoint/><geom type="box" size="0.01 4 4"/></body>
  </worldbody>
</mujoco>
"""
AWAY = [0.0, 0.0, 50.0, 1.0, 0.0, 0.0, 0.0]


@pytest.fixture(scope="module")
def sonar():
    return SonarModel(mujoco.MjModel.from_xml_string(SCENE), H25.root.name, FACTS)


def state(*, ball=None, wall=None, pitch=0.0):
    """Return positions with a ball at a place, and a wall whose face crosses x at a distance, turned by yaw."""
    qpos = np.array([0.0, 0.0, HEIGHT, math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0, *AWAY, *AWAY])
    if ball is not None:
        qpos[7:10] = ball
    if wall is not None:
        distance, yaw = wall
        along = distance + 0.01 / math.cos(yaw)
        qpos[14:21] = [along, 0.0, 0.0, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]
    return qpos


def transducer(side):
    """Return where a transducer is, and the direction of its axis, with the torso upright."""
    _, pitch, yaw = getattr(FACTS, side).angles
    axis = np.array([math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), -math.sin(pitch)])
    return np.array([0.0, 0.0, HEIGHT]) + getattr(FACTS, side).position, axis


@settings(max_examples=examples(40))
@given(
    distance=st.floats(0.4, 2.4),
    bearing=st.floats(-1.2, 1.2),
    height=st.floats(0.1, 0.8),
)
def test_a_ball_is_as_far_as_its_nearest_point_within_the_cone(sonar, distance, bearing, height):
    ball = np.array([distance * math.cos(bearing), distance * math.sin(bearing), height])
    heard = sonar.measure(state(ball=ball))
    for side in ("left", "right"):
        place, axis = transducer(side)
        away = np.linalg.norm(ball - place)
        off_axis = math.acos(float((ball - place) @ axis) / away)
        half_ball = math.asin(RADIUS / away)
        reported = getattr(heard, side)
        if off_axis < HALF_CONE and away - RADIUS < FACTS.farthest - 0.01:
            assert reported == pytest.approx(away - RADIUS, abs=0.01)
        elif off_axis > HALF_CONE + half_ball or away - RADIUS > FACTS.farthest:
            assert reported == math.inf
        else:  # the edge of the cone cuts through the ball
            assert reported == math.inf or away - RADIUS <= reported + 0.01 <= away + 0.01


@pytest.mark.parametrize("yaw", [-0.5, 0.0, 0.3, 1.2])
@pytest.mark.parametrize("distance", [0.5, 1.0, 1.7])
def test_a_wall_is_as_far_as_its_nearest_point_within_the_cone(sonar, distance, yaw):
    heard = sonar.measure(state(wall=(distance, yaw)))
    normal = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    for side in ("left", "right"):
        place, axis = transducer(side)
        straight = distance * math.cos(yaw) - float(place @ normal)
        # Straight ahead of the wall if that is within the cone, else along the cone's edge nearest to it.
        off_axis = max(0.0, math.acos(float(axis @ normal)) - HALF_CONE)
        expected = max(straight / math.cos(off_axis), FACTS.nearest)
        assert getattr(heard, side) == pytest.approx(expected, abs=0.015)


def test_what_is_too_near_is_reported_as_the_nearest(sonar):
    place, axis = transducer("left")
    assert sonar.measure(state(ball=place + (RADIUS + 0.1) * axis)).left == FACTS.nearest


def test_neither_the_floor_nor_the_own_shell_give_an_echo(sonar):
    assert sonar.measure(state()) == sonar.measure(state(pitch=0.1))
    assert sonar.measure(state()).left == math.inf


def test_lying_on_its_belly_it_hears_the_floor(sonar):
    heard = sonar.measure(state(pitch=math.pi / 2))
    place, _ = transducer("left")
    assert heard.left == pytest.approx(HEIGHT - place[0], abs=0.01)


def test_the_robot_hears_a_ball_where_it_is():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False)
    robot.stage.place_object("BallGreen", (1.0, -1.0, 0.5))
    for x, y in ((0.8, 0.3), (1.2, -0.1), (1.6, 0.6)):
        robot.stage.place_object("BallRed", (x, y, 0.4))
        clock.advance(0.5)
        reported = robot.senses.read().sonar.left
        truth = robot.stage.truth()
        place = truth.torso.position + rotation(np.array(truth.torso.orientation)) @ FACTS.left.position
        ball = np.array(truth.objects["BallRed"].position)
        assert reported == pytest.approx(np.linalg.norm(ball - place) - BALL_RADIUS, abs=0.01)


def test_with_noise_each_echo_differs_by_what_the_noise_says():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, noise=True, seed=1)
    robot.stage.place_object("BallRed", (0.6, 0.2, 0.4))
    clock.advance(0.5)
    reported = []
    for _ in range(100):
        clock.advance(0.1)
        reported.append(robot.senses.read().sonar.left)
    assert np.std(reported) == pytest.approx(SenseNoise().sonar_near, rel=0.3)
