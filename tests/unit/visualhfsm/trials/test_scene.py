"""The scene of a trial."""

from __future__ import annotations

import pytest

from naoserver_sim.world import load_world
from visualhfsm.testing import MakeBehavior
from visualhfsm.trials import TrialsError
from visualhfsm.trials._quantities import Value
from visualhfsm.trials._scene import Scene

FOLLOW = "behaviors/follow_ball.xml"

pytestmark = pytest.mark.sim


def test_robot_ball_and_light_are_where_the_values_say() -> None:
    values: dict[str, Value] = {
        "world": "soccer",
        "robot.x": 1.5,
        "robot.heading": 0.3,
        "Ball.y": 0.7,
        "light.brightness": 0.2,
    }
    settings = Scene(values, "sim").settings
    soccer, world = load_world("soccer"), settings["world"]
    assert world.robot.position == (1.5, soccer.robot.position[1])
    assert world.robot.heading == 0.3
    assert world.balls[0].position == (soccer.balls[0].position[0], 0.7)
    assert world.light.brightness == 0.2
    assert settings == {"world": world}


def test_a_carried_ball_has_a_pan_a_distance_and_a_height() -> None:
    world = Scene({"BallGreen.pan": 0.4, "BallGreen.height": 0.3}, "sim").settings["world"]
    green = next(ball for ball in world.carried_balls if ball.name == "BallGreen")
    assert (green.start[0], green.start[2]) == (0.4, 0.3)


def test_the_balls_of_the_fake_robot_are_placed(behavior: MakeBehavior) -> None:
    b = behavior(FOLLOW, robot="fake")
    Scene({"BallRed.pan": -0.3, "BallRed.distance": 1.1}, "fake").set_up(b)
    assert b.robot.ball("red").position[:2] == (-0.3, 1.1)


def test_settings_of_the_simulation_are_passed_on() -> None:
    values: dict[str, Value] = {"noise": True, "body": "H21", "posture": "Crouch"}
    assert Scene(values, "sim").settings == values


@pytest.mark.parametrize(
    ("robot", "values", "message"),
    [
        (
            "sim",
            {"speed": 1.0},
            "speed: there is no such quantity of a scene; there are body, posture, world",
        ),
        ("sim", {"Bal.x": 1.0}, "Bal: there is no such thing in the world; there are robot, light, BallRed"),
        ("sim", {"robot.z": 1.0}, "robot.z: there is x, y, heading"),
        ("sim", {"BallRed.x": 1.0}, "BallRed.x: it is carried, and has pan, distance, height"),
        ("sim", {"BallRed.distance": 9.0}, "the scene is not possible: start of BallRed"),
        ("sim", {"world": "moon"}, "the scene is not possible: moon"),
        ("sim", {"noise": 1}, "noise = 1: write true or false"),
        ("sim", {"robot.x": "here"}, "robot.x = 'here': write a number"),
        (
            "fake",
            {"world": "soccer"},
            "world: there is no such quantity of a scene; there are body, and places",
        ),
        ("fake", {"robot.x": 1.0}, "robot.x: the fake robot has balls with pan, distance, height"),
        ("none", {"world": "soccer"}, 'these trials have no robot; write robot = "sim" or "fake"'),
    ],
)
def test_a_name_that_sets_nothing_is_refused(robot: str, values: dict[str, object], message: str) -> None:
    with pytest.raises(TrialsError) as caught:
        Scene(values, robot)  # type: ignore[arg-type]
    assert message in str(caught.value)
