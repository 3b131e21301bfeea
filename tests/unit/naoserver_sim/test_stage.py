"""The scene of the simulation: reported, set, pushed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from naoserver.bodies.capabilities import STILL, Stage, WalkVelocity
from naoserver.bodies.nao import H25
from naoserver.errors import InvalidCommand
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world, parse_world
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

WORLD = """
[robot]
position = [1.0, -0.5]
heading = 1.2

[[carried_balls]]
name = "BallRed"
color = [1.0, 0.0, 0.0]
start = [0.5, 1.0, 0.4]

[[balls]]
name = "Ball"
position = [1.0, 1.0]

[[boxes]]
name = "Cube"
position = [-1.0, 0.0]
size = [0.2, 0.2, 0.2]
mass = 0.2

[[boxes]]
name = "Table"
position = [-1.0, 1.0]
size = [0.5, 0.5, 0.3]

[[walls]]
begin = [3.0, -1.0]
end = [3.0, 1.0]
"""


class Scene:
    """A robot in the world above, in virtual time."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(clock=self.clock, skin=False, world=parse_world(WORLD, "test"))
        self.stage = self.robot.stage

    def after(self, seconds):
        self.clock.advance(seconds)
        return self.stage.truth()

    def place_of(self, name):
        return self.stage.truth().objects[name].position


@pytest.fixture
def scene():
    scene = Scene()
    yield scene
    scene.robot.close()


def test_a_simulated_robot_has_a_stage(scene):
    assert isinstance(scene.stage, Stage)
    assert scene.stage.objects == ("BallRed", "Ball", "Cube")


def test_robot_and_objects_begin_where_their_world_says(scene):
    truth = scene.stage.truth()
    assert truth.torso.position[:2] == pytest.approx((1.0, -0.5), abs=0.02)
    assert truth.torso.heading == pytest.approx(1.2, abs=0.02)
    assert truth.objects["Ball"].position == pytest.approx((1.0, 1.0, 0.05), abs=0.002)
    assert truth.objects["Cube"].position == pytest.approx((-1.0, 0.0, 0.1), abs=0.002)
    angle = 1.2 + 0.5
    ball = (1.0 + math.cos(angle), -0.5 + math.sin(angle), 0.4)
    assert truth.objects["BallRed"].position == pytest.approx(ball, abs=1e-3)


def test_a_reset_ends_what_was_commanded_before_it(scene):
    yaw = [joint.name for joint in scene.robot.joints].index("HeadYaw")
    begun = scene.robot.read().commands[yaw]
    scene.robot.command_positions({"HeadYaw": 0.5}, {"HeadYaw": 5.0})
    scene.stage.reset()
    scene.after(0.5)
    assert scene.robot.read().commands[yaw] == begun
    scene.stage.reset()
    scene.robot.command_positions({"HeadYaw": 0.5}, {"HeadYaw": 5.0})
    scene.after(0.5)
    assert scene.robot.read().commands[yaw] == 0.5


def test_carried_ball_is_reported_where_the_physics_has_it(scene):
    import mujoco

    scene.stage.place_object("BallRed", (0.4, 0.9, 0.7))
    scene.after(0.1)
    model = scene.robot._model
    data = mujoco.MjData(model.mj)
    data.qpos[:] = scene.robot._simulator.newest().qpos
    mujoco.mj_kinematics(model.mj, data)
    assert scene.place_of("BallRed") == pytest.approx(data.body("BallRed").xpos, abs=1e-9)


def test_placed_objects_stay_where_they_were_put(scene):
    for name, place in {
        "Ball": (0.2, 0.3, 0.05),
        "Cube": (0.0, -1.5, 0.1),
        "BallRed": (0.4, 0.9, 0.7),
    }.items():
        scene.stage.place_object(name, place)
        scene.after(0.5)
        assert scene.place_of(name) == pytest.approx(place, abs=0.005)


def test_what_is_put_into_the_air_falls(scene):
    scene.stage.place_object("Ball", (0.0, 0.0, 1.0))
    after_first_tick = scene.after(0.01).time
    fallen = scene.after(0.3)
    seconds = fallen.time - after_first_tick + 0.01
    assert 1.0 - fallen.objects["Ball"].position[2] == pytest.approx(9.81 / 2 * seconds**2, abs=0.02)


@pytest.mark.parametrize(
    ("name", "place", "what"),
    [
        ("Ball", (1.0, -0.5, 0.2), "the robot"),
        ("Ball", (-1.0, 1.0, 0.2), "Table"),
        ("Cube", (1.0, 1.0, 0.1), "Ball"),
        ("Ball", (3.0, 0.0, 0.2), "wall"),
        ("Ball", (0.0, 0.0, 0.0), "floor"),
        ("BallRed", (1.0, -0.45, 0.5), "distance"),
        ("BallRed", (0.0, 0.0, 9.0), "height"),
        ("Ball", (math.inf, 0.0, 0.1), "x"),
        ("Table", (0.0, 0.0, 0.2), "Table"),
    ],
)
def test_objects_go_where_there_is_room(scene, name, place, what):
    before = scene.stage.truth().objects
    with pytest.raises(InvalidCommand, match=what):
        scene.stage.place_object(name, place)
    after = scene.after(0.02).objects
    assert after["Cube"].position == pytest.approx(before["Cube"].position, abs=1e-3)


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (2.0, 1.5, -2.5)])
def test_placed_robot_stands_there(scene, place):
    scene.stage.place_robot(*place)
    truth = scene.after(1.0)
    assert truth.torso.position[:2] == pytest.approx(place[:2], abs=0.03)
    assert truth.torso.heading == pytest.approx(place[2], abs=0.03)
    assert np.linalg.norm(truth.velocity) < 0.01
    assert not scene.robot.state().fallen


@pytest.mark.parametrize(("place", "what"), [((-1.0, 1.0, 0.0), "Table"), ((1.0, 1.0, 0.0), "Ball")])
def test_robot_is_put_where_there_is_room(scene, place, what):
    with pytest.raises(InvalidCommand, match=what):
        scene.stage.place_robot(*place)


def test_a_push_lasts_as_long_as_asked_and_moves_by_its_impulse(scene):
    # Heavenwards and strong: for some moments nothing but the push and gravity act on the robot.
    scene.stage.push((0.0, 0.0, 400.0), 0.1)
    during = scene.after(0.1).velocity[2]
    assert during > 3.0
    assert during - scene.after(0.1).velocity[2] == pytest.approx(9.81 * 0.1, abs=0.5)


def test_there_is_an_end_to_how_many_push_and_how_strongly(scene):
    for _ in range(100):  # that come within one tick
        scene.stage.push((0.0, 0.0, 1000.0), 60.0)
    scene.after(0.02)
    with pytest.raises(InvalidCommand, match="16 pushes are already active"):
        scene.stage.push((0.0, 0.0, 1000.0), 60.0)
    before = scene.stage.truth().velocity[2]
    gained = scene.after(0.01).velocity[2] - before
    weight = sum(link.mass for link in H25.links)
    assert gained < 1.5 * 1000.0 / weight * 0.01


def test_robot_withstands_a_small_push_and_falls_by_a_large_one(scene):
    scene.stage.push((3.0, 0.0, 0.0), 0.1)
    scene.after(2.0)
    assert not scene.robot.state().fallen
    scene.stage.push((60.0, 20.0, 0.0), 0.2)
    scene.after(3.0)
    assert scene.robot.state().fallen


def test_reset_puts_a_fallen_robot_and_the_objects_back(scene):
    before = scene.stage.truth()
    scene.stage.place_object("Ball", (0.2, 0.3, 0.05))
    scene.stage.place_object("BallRed", (0.4, 0.9, 0.7))
    scene.robot.command_positions({"HeadYaw": 1.0}, {"HeadYaw": 2.0})
    scene.stage.push((60.0, 20.0, 0.0), 0.2)
    scene.after(3.0)
    scene.stage.reset()
    after = scene.after(1.0)
    assert after.time == pytest.approx(before.time + 4.0)
    assert after.torso.position == pytest.approx(before.torso.position, abs=0.005)
    for name, pose in before.objects.items():
        assert after.objects[name].position == pytest.approx(pose.position, abs=0.005)
    reading = scene.robot.read()
    assert reading.positions[0] == pytest.approx(0.0, abs=0.01)
    assert set(reading.stiffnesses) == {1.0}


def test_reset_cools_the_motors_but_a_robot_that_is_put_elsewhere_stays_warm(scene):
    scene.robot.command_positions({"LShoulderPitch": 0.0}, {"LShoulderPitch": 5.0})
    scene.after(10.0)
    assert max(scene.robot.read().temperatures) > 25.5
    scene.stage.place_robot(0.0, -0.5, 0.0)
    scene.after(0.1)
    assert max(scene.robot.read().temperatures) > 25.5
    scene.stage.reset()
    scene.after(0.1)
    assert scene.robot.read().temperatures == pytest.approx([25.0] * len(scene.robot.joints), abs=0.01)


def test_reset_ends_a_walk(scene):
    scene.robot.walker.command(WalkVelocity(forward=0.2))
    scene.after(1.0)
    scene.stage.reset()
    scene.after(0.02)
    assert not scene.robot.walker.walking
    assert scene.robot.walker.commanded() == STILL


def test_walking_robot_moves_as_the_truth_does(scene):
    begin = scene.stage.truth()
    scene.robot.walker.command(WalkVelocity(forward=0.2))
    end = scene.after(4.0)
    moved = np.array(end.torso.position) - begin.torso.position
    assert math.atan2(moved[1], moved[0]) == pytest.approx(1.2, abs=0.2)
    assert np.linalg.norm(moved[:2]) > 0.3


def test_pressed_sensor_feels_it_for_as_long_as_it_is_pressed(scene):
    scene.stage.press("HeadFront", 0.5)
    scene.after(0.2)
    assert "HeadFront" in scene.robot.senses.read().touched
    scene.after(0.5)
    assert "HeadFront" not in scene.robot.senses.read().touched


@pytest.mark.parametrize(
    "wrong",
    [
        lambda stage: stage.push((1e6, 0.0, 0.0), 0.1),
        lambda stage: stage.push((1.0, 0.0, 0.0), math.nan),
        lambda stage: stage.press("Tail", 0.1),
        lambda stage: stage.press("HeadFront", -1.0),
        lambda stage: stage.place_robot(1e9, 0.0, 0.0),
    ],
)
def test_nonsense_is_refused(scene, wrong):
    with pytest.raises(InvalidCommand):
        wrong(scene.stage)


def test_dropped_ball_comes_to_rest():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, world=load_world("soccer"))
    robot.stage.place_object("Ball", (1.5, 0.0, 0.5))
    clock.advance(8.0)
    x, y, z = robot.stage.truth().objects["Ball"].position
    robot.close()
    assert (x, y) == pytest.approx((1.5, 0.0), abs=0.1)
    assert z == pytest.approx(0.05, abs=0.003)
