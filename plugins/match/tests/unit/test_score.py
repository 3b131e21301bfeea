"""Football, `score`: it searches, walks behind the ball, and kicks it towards the goal, by what it sees.

The whole match, up to the goal, is the test of docs/tutorial/football.md.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from hfsm_runtime.loading import load_module
from naoserver.bodies.capabilities import STILL, Truth
from naoserver_sim.world import RobotPlace, StartPose, load_world
from tests.support.soak import cases
from visualhfsm.simulation import Team, simulate_team
from visualhfsm.testing import Behavior, BehaviorFailed, MakeBehavior

DOCUMENT = "behaviors/score.xml"
GOAL_LINE = 4.5

pytestmark = pytest.mark.sim


def play(
    behavior: MakeBehavior, x: float, y: float, start: StartPose | None = None, **settings: Any
) -> Behavior:
    """Begin with the ball somewhere on the field, and the robot perhaps not where it believes."""
    soccer = load_world("soccer")
    ball = replace(soccer.balls[0], position=(x, y))
    world = replace(soccer, balls=(ball,), robot=start or soccer.robot)
    return behavior(DOCUMENT, robot="sim", world=world, **settings)


def truth(b: Behavior) -> Truth:
    assert b.robot.device.stage is not None
    return b.robot.device.stage.truth()


def test_it_kicks_towards_the_goal_with_the_foot_that_is_nearer_though_it_was_put_down_carelessly(
    behavior: MakeBehavior,
) -> None:
    start = StartPose(position=(2.6, 0.1), heading=-0.14)
    b = play(behavior, 3.3, 0.3, start, seed=2, noise=True, parameters={"start_x": 2.7})
    b.run_until("kick", limit=40.0)
    kick = b.calls("Motions.play")[-1]
    assert kick.name == "kick_left"
    commands = [call.target for call in b.calls("Walk") if call.target != "Walk.getWalkState"]
    assert commands[-1] == "Walk.stop"
    x, y, _ = truth(b).objects["Ball"].position
    b.advance(5.0)
    after = truth(b).objects["Ball"].position
    assert math.dist((x, y), after[:2]) > 1.0
    bearing = math.atan2(after[1] - y, after[0] - x) - math.atan2(-y, GOAL_LINE - x)
    assert abs(bearing) < 0.3
    assert not b.robot.state.fallen


@pytest.mark.parametrize(("x", "y"), cases([(0.4, 0.5)], [pytest.param(-0.4, -0.2), pytest.param(1.2, -0.3)]))
def test_it_knows_where_the_ball_is_on_the_field(behavior: MakeBehavior, x: float, y: float) -> None:
    b = play(behavior, x, y)
    b.run_until("approach", limit=10.0)
    assert abs(b.variables("score")["ball"] - complex(x, y)) < 0.08


@pytest.mark.gl
def test_it_knows_where_the_ball_is_by_pictures_too(behavior: MakeBehavior) -> None:
    b = play(behavior, 0.4, 0.5, eyes="pictures", camera="rendered")
    b.run_until("approach", limit=10.0)
    assert abs(b.variables("score")["ball"] - complex(0.4, 0.5)) < 0.08


def test_what_it_sees_corrects_where_it_believes_to_face(behavior: MakeBehavior) -> None:
    b = play(behavior, 0.0, 0.0, StartPose(position=(-0.75, 0.0), heading=0.14))
    b.run_until("approach", limit=10.0)
    b.advance(2.0)
    _, facing = b.component.place()
    assert cmath.phase(facing) == pytest.approx(truth(b).torso.heading, abs=0.05)


def test_a_robot_that_was_carried_away_does_not_kick(behavior: MakeBehavior) -> None:
    b = play(behavior, 0.5, 2.5)
    b.advance(1.0)

    def kicks_what_lies_before_its_foot() -> bool:
        here, facing = b.component.place()
        return bool(b.component.can_kick(here + facing * complex(0.17, -0.05)))

    assert kicks_what_lies_before_its_foot()
    b.robot.device.stage.place_robot(1.5, 1.0, -2.2)  # type: ignore[union-attr]
    b.run_until(lambda: b.component.localizer.confidence < 0.5, limit=10.0)
    assert not kicks_what_lies_before_its_foot()


def test_it_finds_a_ball_behind_it(behavior: MakeBehavior) -> None:
    b = play(behavior, -1.7, 0.2)
    b.run_until(lambda: b.robot.head[1] > 0.4, limit=20.0)
    assert b.active == "search"
    assert b.component.find_ball() is None
    b.run_until("approach", limit=30.0)
    assert b.calls("Walk.walkTo")
    assert abs(b.variables("score")["ball"] - complex(-1.7, 0.2)) < 0.15


def test_a_robot_with_a_wrong_start_looks_for_lines_and_knows_it_then(
    behavior: MakeBehavior,
) -> None:
    b = play(behavior, 0.0, 0.0, seed=2, noise=True, parameters={"start_x": -1.75})
    b.run_until("orient", limit=15.0)
    b.run_until("search", limit=20.0)
    place, facing = b.component.place()
    x, y, _ = truth(b).torso.position
    assert abs(place - complex(x, y)) < 0.15
    assert cmath.phase(facing) == pytest.approx(truth(b).torso.heading, abs=0.08)
    assert b.component.is_sure()


def test_a_robot_that_cannot_kick_for_long_looks_for_lines(behavior: MakeBehavior) -> None:
    b = play(behavior, 3.3, 0.0, StartPose(position=(3.05, 0.05)), parameters={"start_x": 3.05})
    b.guard("before the foot", False)
    b.run_until("orient", limit=30.0)
    assert b.variables("score")["lost"]


def test_what_it_saw_to_all_sides_counts_when_it_looks_down_and_sees_no_line(behavior: MakeBehavior) -> None:
    b = play(behavior, 0.5, 2.5)
    b.advance(1.0)
    b.robot.device.stage.place_robot(1.5, 1.0, -2.2)  # type: ignore[union-attr]
    b.run_until(lambda: b.component.localizer.confidence < 0.5, limit=10.0)
    assert not b.component.is_sure()
    b.component.oriented = b.time - b.component.SURE + 0.5
    assert b.component.is_sure()
    b.component.oriented -= 0.5
    assert not b.component.is_sure()


@pytest.mark.parametrize(
    ("ball", "y", "seed", "scored"),
    cases(
        [
            ((4.54, 0.46), -0.34, 317, False),  # at first it does not know that it was put down elsewhere
            ((4.9, 0.2), 0.0, 5, True),
        ],
        [pytest.param((4.5, 0.2), 0.0, 5, False), pytest.param((4.54, 0.2), 0.0, 5, False)],
    ),
)
def test_a_ball_on_the_goal_line_is_no_goal(
    behavior: MakeBehavior, ball: tuple[float, float], y: float, seed: int, scored: bool
) -> None:
    b = play(
        behavior, *ball, StartPose(position=(2.5, y)), seed=seed, noise=True, parameters={"start_x": 2.5}
    )
    if scored:
        b.run_until("scored", limit=15.0)
    else:
        b.run_until("approach", limit=10.0)
        b.advance(3.0)
        assert b.active != "scored"


@pytest.mark.parametrize(
    ("before", "x", "half"), [((0.9, 0.1), -0.8, -1), ((0.9, 0.1), 0.8, 1), (None, -0.8, 1)]
)
def test_the_ball_distinguishes_the_halves(
    behavior: MakeBehavior, before: tuple[float, float] | None, x: float, half: int
) -> None:
    b = play(behavior, 0.0, 0.0)
    b.advance(0.1)
    place, _ = b.component.place()
    ball = b.component.settle_half(complex(x, 0.0), None if before is None else complex(*before))
    assert ball == pytest.approx(half * x)
    assert b.component.place()[0] == pytest.approx(half * place)


@pytest.mark.parametrize(
    ("distance", "bearing"),
    cases([(0.7, 70)], [pytest.param(*each) for each in ((0.7, -80), (1.2, 50), (1.2, -100))]),
)
def test_one_camera_finds_a_ball_beside_the_robot_without_a_step(
    behavior: MakeBehavior, distance: float, bearing: float
) -> None:
    ball = complex(1.0, 0.5) + cmath.rect(distance, math.radians(bearing))
    start, place = StartPose(position=(1.0, 0.5)), {"start_x": 1.0, "start_y": 0.5}
    b = play(behavior, ball.real, ball.imag, start, body="G1", parameters=place)
    b.run_until("approach", limit=15.0)
    assert abs(b.variables("score")["ball"] - ball) < 0.1
    assert b.calls("Walk.walkTo")[0].time == b.time, "before, it walked"


def test_one_camera_looks_before_its_feet_first_for_a_ball_that_lay_there(behavior: MakeBehavior) -> None:
    b = play(behavior, -0.4, 0.0, body="G1")
    b.advance(0.1)
    here, facing = b.component.place()
    assert b.component.first_corner(here + 0.3 * facing) < 0
    assert b.component.first_corner(here + 2.0 * facing) == b.component.first_corner(None) == 0


@pytest.mark.parametrize("ball", [4.4 + 0.0j, 4.75 + 0.3j, 4.85 - 0.65j, 4.95 + 0.7j])
def test_a_ball_at_the_goal_or_deep_in_it_is_kicked_on_not_back(
    behavior: MakeBehavior, ball: complex
) -> None:
    b = play(behavior, 0.0, 0.0)
    b.advance(0.1)
    assert b.component.to_goal(ball).real > 0.1


def test_a_body_that_kicks_far_kicks_softly_where_the_ball_is_to_stop_before_the_goal(
    behavior: MakeBehavior,
) -> None:
    b = play(behavior, 0.0, 0.0, body="G1")
    b.advance(0.1)
    before_the_goal, beside_it = 3.0 + 0.2j, 4.2 + 1.4j
    assert b.component.pace_for(before_the_goal) == 1.0
    assert b.component.pace_for(beside_it) == pytest.approx(0.7, abs=0.05)  # for 1.7 m of 3.5
    assert b.component.aim(beside_it) == pytest.approx(3.2)


@pytest.mark.parametrize("body", ["H25", "T1", "G1"])
def test_no_start_of_its_trials_touches_a_post(behavior: MakeBehavior, body: str) -> None:
    trials = load_module("score_trials", Path("behaviors/score_trials.py"))
    b = play(behavior, 0.0, 0.0, body=body)
    stage, apart = b.robot.device.stage, trials.room(body) + 0.001
    light = {"light.brightness": 0.7, "light.ambient": 0.4}
    for bearing in (-45, 0, 45):  # the plan draws none behind the goal line
        at = complex(trials.LINE, trials.POST) - cmath.rect(apart, math.radians(bearing))
        start = {"robot.x": at.real, "robot.y": at.imag, "Ball.x": 0.0, "Ball.y": 0.0, **light, "body": body}
        assert trials.is_legal(start)
        for heading in range(-180, 180, 20):
            stage.place_robot(at.real, at.imag, math.radians(heading))  # type: ignore[union-attr]


def test_its_gaze_asks_nothing_of_the_neck_that_it_cannot_do(behavior: MakeBehavior) -> None:
    b = play(behavior, 0.0, 0.0)
    b.guard("unsure", False)
    b.advance(0.1)
    for bearing in (0.0, 0.3, 0.6, 0.9, 1.3, -0.2, -0.5, -0.8, -1.1, -1.3, 2.5, -2.5):
        for distance in (0.15, 0.6):
            b.component.look_at(cmath.rect(distance, bearing))
    assert b.robot.health == []


def test_a_robot_that_fell_gets_up_and_looks_for_its_place(behavior: MakeBehavior) -> None:
    b = play(behavior, 0.5, 2.5, seed=4)
    b.advance(1.0)
    b.robot.device.stage.push((-120.0, 0.0, 0.0), 0.2)  # type: ignore[union-attr]
    b.run_until(lambda: b.robot.state.fallen, limit=5.0)
    b.run_until("orient", limit=45.0)
    b.run_until("search", limit=60.0)
    assert not b.robot.state.fallen


def among_others(x: float, ball: complex, *others: complex) -> AbstractContextManager[Team]:
    """Begin at a place on the middle line from goal to goal, with a ball, and other robots that do nothing."""
    soccer = load_world("soccer")
    robots = (
        RobotPlace(name="nao", position=(x, 0.0)),
        *(
            RobotPlace(name=f"other{number}", position=(other.real, other.imag), heading=math.pi)
            for number, other in enumerate(others)
        ),
    )
    balls = (replace(soccer.balls[0], position=(ball.real, ball.imag)),)
    world = replace(soccer, balls=balls, robots=robots)
    return simulate_team([DOCUMENT], world=world, seed=1, parameters={"start_x": x})


def test_the_orange_parts_of_another_robot_are_no_ball() -> None:
    with among_others(-3.0, -4.4 + 0.0j, -0.2 + 0.1j, -0.1 + 0.8j, -0.3 - 0.7j) as team:
        (b,) = team.behaviors
        for _ in range(20):
            team.advance(0.1)
            assert b.component.sight[0] is None


def run_until(team: Team, condition: Callable[[Behavior], bool], limit: float) -> Behavior:
    """Run a team of one until a condition holds."""
    (b,) = team.behaviors
    end = team.time + limit
    while not condition(b):
        assert team.time < end, b.timeline
        team.advance(0.1)
    return b


def test_a_ball_before_the_orange_toes_of_another_robot_is_seen() -> None:
    with among_others(-0.8, 0.0j, 0.24 + 0.0j) as team:
        (b,) = team.behaviors
        team.advance(1.0)
        ball, seen_at = b.component.sight
        assert seen_at > 0.0
        assert abs(ball) < 0.1


@pytest.mark.parametrize(("other", "rolls"), [(0.24 + 0.0j, 0.15), (1.0 + 0.0j, 1.2)])
def test_a_ball_before_another_robot_is_kicked_past_it(other: complex, rolls: float) -> None:
    with among_others(-0.8, 0.0j, other) as team:
        b = run_until(team, in_kick, 40.0)
        assert 0.2 < abs(truth(b).torso.heading) < 1.4  # the goal is straight ahead
        x, y, _ = truth(b).objects["Ball"].position
        run_until(team, lambda b: not in_kick(b), 10.0)
        after = truth(b).objects["Ball"].position
        assert math.dist((x, y), after[:2]) > rolls


def test_a_ball_that_lies_where_it_was_kicked_from_is_kicked_another_way(behavior: MakeBehavior) -> None:
    b = play(behavior, 0.0, 1.0)
    b.advance(0.1)
    ball = 0.0 + 1.0j
    ways = [b.component.to_goal(ball)]
    for _ in range(2):
        b.component.turn_aside(ball)
        ways.append(b.component.to_goal(ball))
    off = [cmath.phase(way / ways[0]) for way in ways]
    assert off == pytest.approx([0.0, -0.4, -0.8])  # towards the middle of the field
    assert b.component.to_goal(ball + 0.4) != pytest.approx(ways[-1])


def test_a_kick_past_a_robot_does_not_miss_a_goal_that_is_near(behavior: MakeBehavior) -> None:
    b = play(behavior, 0.0, 0.0, StartPose(position=(3.2, 0.0)), parameters={"start_x": 3.2})
    b.advance(0.1)
    ball = 3.6 + 0.0j
    b.component.others = [(b.time, 4.1 + 0.0j)] * 9
    b.component.avoid_others(ball)
    way = b.component.to_goal(ball)
    assert abs(cmath.phase(way)) > 0.2
    assert abs((GOAL_LINE - ball.real) * way.imag / way.real) < 0.7


def test_it_leaves_a_ball_to_a_robot_that_is_nearer_but_not_for_long() -> None:
    with among_others(-1.5, 0j, 0.3 + 0j) as team:
        b = run_until(team, lambda b: b.active == "yield", 10.0)
        began = b.time
        run_until(team, lambda b: b.active != "yield", 12.0)
        assert b.active == "approach"
        assert b.time - began == pytest.approx(b.component.PATIENCE[0], abs=1.0)
        x, y, _ = truth(b).torso.position
        assert x < -0.2, "it did not walk to its own side"
        assert math.hypot(x, y) > 0.5


def test_it_walks_round_a_robot_in_its_way() -> None:
    other = -1.2 + 0.05j
    with among_others(-2.5, 0j, other) as team:
        apart = []

        def stands(b: Behavior) -> bool:
            x, y, _ = truth(b).torso.position
            apart.append(abs(complex(x, y) - other))
            return b.active == "stand"

        run_until(team, stands, 60.0)
        assert min(apart) > 0.4


def test_a_robot_whose_walk_is_held_up_steps_back() -> None:
    with among_others(-0.8, 1.5 + 0.0j, -0.2 - 0.2j) as team:
        team.behaviors[0].component.APART = 0.0  # as if it had not seen that
        b = run_until(team, lambda b: b.active_paths[-1] == "back", 20.0)
        x, _, _ = truth(b).torso.position
        run_until(team, lambda b: b.active_paths[-1] != "back", 20.0)
        assert truth(b).torso.position[0] < x - 0.1
        assert not b.robot.state.fallen


def in_kick(b: Behavior) -> bool:
    return b.active_paths[-1] == "kick"


def test_it_does_not_walk_on_by_what_frozen_cameras_show(behavior: MakeBehavior) -> None:
    b = play(behavior, 3.0, 0.5)
    b.run_until("approach", limit=20.0)
    b.advance(1.0)
    walker = b.robot.device.walker
    assert walker is not None
    assert walker.commanded() != STILL
    for camera in b.robot.device.body.cameras:
        b.robot.fail(camera.name, "frozen")
    b.advance(3.0)
    assert walker.commanded() == STILL


def test_it_ends_with_the_name_of_a_joint_that_does_not_follow(behavior: MakeBehavior) -> None:
    b = play(behavior, 3.0, 0.5)
    b.run_until("approach", limit=20.0)
    b.advance(1.0)
    b.robot.fail("LKneePitch", "stuck")
    with pytest.raises(BehaviorFailed, match="LKneePitch does not follow"):
        b.run_until("kick", limit=10.0)
