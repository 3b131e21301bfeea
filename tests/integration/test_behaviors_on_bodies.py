"""The same behaviors, unchanged, on every body that has what they need.

Each behavior runs on bodies of different kinds in `make test`, and on all of them in `make soak`.
"""

from __future__ import annotations

import math

import pytest
from msgspec.structs import replace

from naoserver.bodies.capabilities import WalkVelocity
from naoserver_sim.world import StartPose, load_world
from tests.support.present import present
from tests.support.soak import cases
from visualhfsm.testing import Behavior, MakeBehavior

pytestmark = pytest.mark.sim

ORDER = ["up", "out", "front", "low"]
LEANS = 0.3
"""Tilt of the torso in rad that no dance is to reach."""
CORNERS = 7
"""Number of poses of the head in a search."""
PLACES = {"ahead": (1.2, 0.5), "behind": (-0.9, -0.8)}
"""Of the ball, seen from the robot, in m."""
ARMS = ("RightShoulder", "RightElbow", "LeftShoulder", "LeftElbow")


def off_the_middle(b: Behavior, automaton: str) -> float:
    """Return how far from the picture's middle the ball is that is followed, in degrees."""
    seen = b.variables(automaton)
    assert seen["missed"] == 0
    return math.degrees(math.hypot(seen["left"], seen["down"]))


@pytest.mark.parametrize("body", cases(["H25", "T1"], ["H21", "G1"]))
def test_it_dances_and_stays_on_its_feet(behavior: MakeBehavior, body: str) -> None:
    b = behavior("behaviors/dance.xml", robot="sim", body=body)
    b.run_until(lambda: len(b.changes("dance")) == 9 or b.robot.state.torso_tilt > LEANS, limit=60.0)
    assert [state for _, state in b.changes("dance")] == (ORDER * 3)[:9]
    assert not b.robot.state.fallen


@pytest.mark.parametrize("body", cases(["H25", "T1", "Cart"], ["H21", "G1"]))
def test_it_looks_everywhere_for_a_lost_ball_as_far_as_its_neck_reaches(
    behavior: MakeBehavior, body: str
) -> None:
    b = behavior("behaviors/follow_ball.xml", robot="sim", body=body, camera="drawn")
    b.robot.ball("green").place(pan=math.pi, distance=3.0)
    visited = set()

    def has_looked_everywhere() -> bool:
        visited.add(b.variables("follow_ball")["corner"])
        return len(visited) == CORNERS

    b.run_until(has_looked_everywhere, limit=60.0)
    assert b.active == "search"
    assert not b.robot.state.fallen


@pytest.mark.parametrize("body", cases(["T1"], ["H25", "H21", "G1"]))
def test_it_looks_everywhere_while_it_walks_and_turns(behavior: MakeBehavior, body: str) -> None:
    b = behavior("behaviors/follow_ball.xml", robot="sim", body=body, camera="drawn")
    b.robot.ball("green").place(pan=math.pi, distance=3.0)
    b.advance(1.0)
    walker = present(b.robot.device.walker)
    for velocity in (WalkVelocity(turn=-0.5), WalkVelocity(0.2, 0.0, 0.3), WalkVelocity(-0.1, 0.0, -0.3)):
        walker.command(velocity)
        b.advance(4.0)
    assert walker.ended == ""
    assert not b.robot.state.fallen


@pytest.mark.parametrize("body", cases(["H25"], ["H21", "T1", "G1"]))
def test_it_follows_a_ball_and_dances_in_turn(behavior: MakeBehavior, body: str) -> None:
    b = behavior("behaviors/dance_and_follow.xml", robot="sim", body=body)
    b.advance(7.9)
    assert b.is_active("followBall/red")
    assert off_the_middle(b, "red") < 2.0
    assert not [call for arm in ARMS for call in b.calls(f"{arm}Motors")]
    while b.time < 19.9:
        b.advance(0.5)
        assert b.robot.state.torso_tilt < LEANS
    assert b.changes("dance_and_follow") == [(0.0, "followBall"), (10.0, "dance")]
    assert [state for _, state in b.changes("dance")][:2] == ["right", "left"], "ten positions are reached"
    assert {call.automaton for arm in ARMS for call in b.calls(f"{arm}Motors")} == {"dance"}
    b.run_until("followBall", limit=1.0)
    assert not b.robot.state.fallen


@pytest.mark.parametrize(
    ("at", "body"),
    cases(
        [("ahead", "H25"), ("ahead", "G1"), ("ahead", "Cart"), ("behind", "Cart")],
        [pytest.param("ahead", "T1"), *(pytest.param("behind", body) for body in ("H25", "T1", "G1"))],
    ),
)
def test_it_goes_to_the_ball(behavior: MakeBehavior, at: str, body: str) -> None:
    soccer, place = load_world("soccer"), PLACES[at]
    world = replace(soccer, balls=(replace(soccer.balls[0], position=place),), robot=StartPose())
    b = behavior("behaviors/drive_to_ball.xml", robot="sim", body=body, world=world)
    b.run_until("there", limit=60.0)
    b.advance(2.0)
    assert b.active == "there"
    truth = b.robot.device.stage.truth()  # type: ignore[union-attr]
    (x, y, _), torso = truth.objects["Ball"].position, truth.torso
    assert math.dist((x, y), place) < 0.01, "it does not run into it"
    assert math.dist((x, y), torso.position[:2]) == pytest.approx(b.component.near, abs=0.15)
    bearing = math.atan2(y - torso.position[1], x - torso.position[0])
    assert abs(math.remainder(bearing - torso.heading, math.tau)) < 0.4
    assert not b.robot.state.fallen


@pytest.mark.parametrize("body", ["H25", "Cart"])
def test_it_goes_after_a_ball_that_is_taken_away(behavior: MakeBehavior, body: str) -> None:
    soccer = load_world("soccer")
    world = replace(soccer, balls=(replace(soccer.balls[0], position=(0.7, 0.0)),), robot=StartPose())
    b = behavior("behaviors/drive_to_ball.xml", robot="sim", body=body, world=world)
    b.run_until("there", limit=20.0)
    b.robot.device.stage.place_object("Ball", (1.3, -0.4, 0.05))  # type: ignore[union-attr]
    b.run_until("go", limit=5.0)
    b.run_until("there", limit=40.0)


@pytest.mark.parametrize("body", ["H25", "Cart"])
def test_it_stops_within_a_second_when_its_eyes_see_nothing_new(behavior: MakeBehavior, body: str) -> None:
    soccer = load_world("soccer")
    world = replace(soccer, balls=(replace(soccer.balls[0], position=(2.0, 0.0)),), robot=StartPose())
    b = behavior("behaviors/drive_to_ball.xml", robot="sim", body=body, world=world)
    b.run_until("go", limit=5.0)
    b.advance(1.0)
    walker, died = present(b.robot.device.walker), b.time
    assert walker.commanded().forward > 0.05
    with b.server_offline("Sight"):
        assert b.run_until("search", limit=2.0) <= died + 1.0
        assert walker.commanded() == WalkVelocity()
        b.advance(2.0)
        assert b.active == "search", "the ball of an old picture is none that it finds"
        assert walker.commanded() == WalkVelocity()
    b.run_until("go", limit=10.0)
