"""The paper's first experiment, `follow_ball`, in virtual time: follow, lose, search, find."""

from __future__ import annotations

import math
from contextlib import ExitStack
from typing import cast

import pytest

from interfaces.nao import SightReading
from naoserver.bodies.nao import H25
from tests.support.soak import cases, repeated
from visualhfsm.testing import Behavior, MakeBehavior, check_properties

DOCUMENT = "behaviors/follow_ball.xml"
CORNERS = [(1.8, 0.2), (-1.8, 0.2), (-1.8, -0.3), (1.8, -0.3), (0.45, -0.65), (-0.45, -0.65), (0.0, 0.45)]
(NECK,) = (table for table in H25.tables if table.dependent == "HeadPitch")
EYES = 0.5  # m above the floor


@pytest.fixture
def b(behavior: MakeBehavior) -> Behavior:
    return behavior(DOCUMENT, robot="fake")


def bearing_error(b: Behavior) -> float:
    """Return by how much the head points past the green ball in rad."""
    return abs(b.robot.head[0] - b.robot.ball("green").position[0])


def test_the_head_turns_to_the_ball_and_stays_there(b: Behavior) -> None:
    b.robot.ball("green").place(pan=0.4, distance=1.0, height=0.6)
    b.advance(2.0)
    assert b.active == "follow"
    assert bearing_error(b) < 0.02
    seen = b.variables("follow_ball")
    assert seen["missed"] == 0
    assert (seen["left"], seen["down"]) == pytest.approx((0, 0), abs=0.011)
    b.advance(10.0)
    assert bearing_error(b) < 0.02
    assert b.changes("follow_ball") == [(0.0, "follow")]


def test_the_head_keeps_up_with_a_ball_that_moves(b: Behavior) -> None:
    b.advance(2.0)
    b.robot.ball("green").move(pan=-0.8, height=0.8, speed=0.3)
    worst = 0.0
    for _ in range(50):
        b.advance(0.1)
        worst = max(worst, bearing_error(b))
    assert worst < 0.2
    assert b.robot.head[0] == pytest.approx(-0.8, abs=0.03)
    assert b.active == "follow"


def test_it_searches_half_a_second_after_the_ball_was_last_seen(b: Behavior) -> None:
    b.advance(2.0)
    b.robot.ball("green").hide()
    assert b.run_until("search", limit=2.0) == pytest.approx(2.65, abs=0.1)


def test_a_ball_that_is_lost_for_a_moment_is_no_reason_to_search(b: Behavior) -> None:
    b.advance(2.0)
    b.robot.ball("green").hide()
    b.advance(0.4)
    b.robot.ball("green").place(pan=0.15)
    b.advance(3.0)
    assert b.changes("follow_ball") == [(0.0, "follow")]


def test_the_search_goes_round_all_corners_in_their_order(b: Behavior) -> None:
    b.robot.ball("green").hide()
    b.run_until("search")
    for corner, (pan, tilt) in enumerate(CORNERS):
        assert b.variables("follow_ball")["corner"] == corner
        b.run_until(lambda: b.variables("follow_ball")["corner"] != corner, limit=5.0)  # noqa: B023
        assert b.robot.head == pytest.approx((pan, tilt), abs=0.1)
    assert b.variables("follow_ball")["corner"] == 0
    assert {(call.pan, call.tilt) for call in b.calls("Head.setPose")} == set(CORNERS)


@pytest.mark.sim
@pytest.mark.slow
@pytest.mark.parametrize("share", cases([1.0], [0.0, 0.5]))
def test_the_search_finds_a_ball_wherever_the_neck_can_point(behavior: MakeBehavior, share: float) -> None:
    b = behavior(DOCUMENT, robot="sim", camera="drawn")
    for pan in (-2.05, -1.5, 0.0, 0.9, 1.8):
        low, high = NECK.at(pan)
        height = EYES - math.tan(low + share * (high - low))
        b.robot.ball("green").hide()
        b.run_until("search", limit=2.0)
        b.robot.ball("green").place(pan=pan, distance=1.0, height=min(max(height, 0.05), 1.2))
        b.run_until("follow", limit=10.0)
        b.advance(1.0)
        assert b.active == "follow"
        assert bearing_error(b) < 0.1


@pytest.mark.sim
def test_the_search_asks_nothing_of_the_neck_that_it_cannot_do(behavior: MakeBehavior) -> None:
    b = behavior(DOCUMENT, robot="sim", camera="drawn")
    b.robot.ball("green").hide()
    b.run_until("search", limit=2.0)
    b.run_until(lambda: b.variables("follow_ball")["corner"] == len(CORNERS) - 1, limit=10.0)
    b.run_until(lambda: b.variables("follow_ball")["corner"] == 1, limit=10.0)
    assert b.robot.health == []


def test_it_follows_again_what_the_search_finds(b: Behavior) -> None:
    b.robot.ball("green").hide()
    b.run_until("search")
    b.robot.ball("green").place(pan=-0.9)
    found = b.run_until("follow", limit=5.0)
    b.advance(2.0)
    assert b.active == "follow"
    assert bearing_error(b) < 0.02
    b.robot.ball("green").hide()
    assert b.run_until("search") - found > 2.5, "the time since the last loss has not restarted"


def test_a_find_that_was_a_mistake_is_given_half_a_second(b: Behavior) -> None:
    b.robot.ball("green").hide()
    b.run_until("search")
    b.advance(2.0)
    b.guard("found", True)
    found = b.run_until("follow")
    b.guard("found", None)
    assert b.run_until("search") == pytest.approx(found + 0.55)


def test_the_red_ball_is_none_of_its_business(b: Behavior) -> None:
    b.robot.ball("green").hide()
    b.robot.ball("red").place(pan=0.0)
    assert b.run_until("search", limit=2.0) < 1.0


def test_the_head_turns_the_faster_the_farther_the_ball_is_from_the_middle(b: Behavior) -> None:
    b.robot.ball("green").place(pan=0.4, distance=1.0, height=0.6)
    b.advance(2.0)
    b.robot.ball("green").place(pan=0.5, distance=1.0, height=0.6)
    b.advance(0.2)
    seen, command = b.variables("follow_ball"), b.calls("Head.setSpeed")[-1]
    assert 0.01 < seen["left"] < 0.1
    assert (command.pan, command.tilt) == pytest.approx((8.0 * seen["left"], 8.0 * seen["down"]))


def test_the_head_does_not_swing_about_a_ball_that_it_sees_late(b: Behavior) -> None:
    b.robot.ball("green").place(pan=0.0, distance=1.0, height=0.6)
    for camera in ("Camera", "CameraBottom"):
        b.robot.fail(camera, "late", 0.2)
    b.advance(2.0)
    b.robot.ball("green").place(pan=0.4, distance=1.0, height=0.6)
    b.advance(2.0)
    pans = [call.result.pan for call in b.calls("Head.setSpeed") if call.time > 2.0]
    assert 0.3 < max(pans) < 0.6
    assert b.robot.head[0] == pytest.approx(0.4, abs=0.05)


def frozen(b: Behavior) -> SightReading:
    """Return what is seen now, for eyes that go on to report it."""
    return cast("SightReading", b.component.Sight.getSight())


@pytest.mark.parametrize("dead", [False, True])
def test_it_searches_within_a_second_when_its_eyes_see_nothing_new(b: Behavior, dead: bool) -> None:
    b.robot.ball("green").place(pan=0.4, distance=1.0, height=0.6)
    b.advance(2.0)
    with ExitStack() as away:
        if dead:
            away.enter_context(b.server_offline("Sight"))
        else:
            b.stub("Sight", getSight=frozen(b))
        assert b.run_until("search", limit=2.0) <= 3.0 + 1e-9
        b.advance(3.0)
    assert b.active == "search", "the ball of an old picture is none that it finds"
    assert not b.errors


def test_what_one_camera_shows_is_old_when_only_the_other_one_goes_on(b: Behavior) -> None:
    b.robot.ball("green").place(pan=0.0, distance=1.0, height=0.5)
    b.advance(2.0)
    seen = frozen(b)

    def half_dead() -> SightReading:
        return SightReading(time=b.component.Head.getPose().time, things=seen.things)

    b.stub("Sight", getSight=half_dead)
    assert b.run_until("search", limit=2.0) <= 3.0 + 1e-9


def test_a_server_that_goes_away_is_waited_for(b: Behavior) -> None:
    b.advance(2.0)
    with b.server_offline():
        b.advance(3.0)
    b.robot.ball("green").place(pan=-0.3)
    b.advance(2.0)
    assert b.active == "follow"
    assert bearing_error(b) < 0.02


def test_a_head_that_nobody_commands_any_longer_stops(b: Behavior) -> None:
    b.robot.ball("green").move(pan=1.2, speed=1.0)
    b.advance(0.5)
    with b.server_offline():
        b.advance(1.0)
        still = b.robot.head
        b.advance(1.0)
        assert b.robot.head == pytest.approx(still, abs=1e-3)
    assert any("was not renewed" in line for line in b.robot.health)


@pytest.mark.slow
def test_the_head_never_leaves_its_range_whatever_the_ball_does() -> None:
    def head_in_range(b: Behavior) -> bool:
        pan, tilt = b.robot.head
        return abs(pan) <= 2.0857 + 1e-6 and -0.672 - 1e-6 <= tilt <= 0.515 + 1e-6

    def every_call_is_finite(b: Behavior) -> bool:
        return all(math.isfinite(call.pan + call.tilt) for call in b.calls("Head.setSpeed"))

    check_properties(
        DOCUMENT,
        head_in_range,
        every_call_is_finite,
        abstract=False,
        robot="fake",
        balls=["green"],
        examples=repeated(3, 6),
        steps=10,
    )


@pytest.mark.sim
@pytest.mark.gl
@pytest.mark.parametrize(
    "light",
    cases(["[light]\nbrightness = 0.2\nambient = 0.1\n"], ["", "[light]\ncolor = [1.0, 0.65, 0.35]\n"]),
)
def test_it_follows_in_pictures_like_a_cameras_in_any_light(behavior: MakeBehavior, light: str) -> None:
    from naoserver_sim.world import parse_world

    ball = '[[carried_balls]]\nname = "BallGreen"\ncolor = [0.02, 0.85, 0.05]\nstart = [0.25, 1.0, 0.5]\n'
    b = behavior(
        DOCUMENT,
        robot="sim",
        camera="rendered",
        eyes="pictures",
        noise=True,
        seed=1,
        world=parse_world(ball + light, "w"),
    )
    b.robot.ball("green").place(pan=-0.4)
    b.advance(1.2)
    assert bearing_error(b) < 0.03
    b.robot.ball("green").move(pan=0.4, speed=0.3)
    worst = 0.0
    for _ in range(12):
        b.advance(0.1)
        worst = max(worst, bearing_error(b))
    assert worst < 0.15
    assert b.changes("follow_ball") == [(0.0, "follow")]


@pytest.mark.sim
def test_it_follows_on_while_something_hides_nearly_half_of_the_ball(behavior: MakeBehavior) -> None:
    b = behavior(DOCUMENT, robot="sim", camera="drawn")

    def certainty() -> float:
        (green,) = (thing for thing in frozen(b).things if thing.name == "green")
        return green.certainty

    b.robot.ball("red").hide()
    b.robot.ball("green").place(pan=0.1, distance=1.0, height=0.5)
    b.advance(1.0)
    whole = certainty()
    b.robot.ball("red").place(pan=0.035, distance=0.8, height=0.5)
    b.advance(2.0)
    assert certainty() < 0.8 * whole
    assert b.changes("follow_ball") == [(0.0, "follow")]


BALL = '[[carried_balls]]\nname = "Ball{}"\ncolor = [0.02, 0.85, 0.05]\nstart = [0.0, 1.0, 0.5]\n'
BOX = '[[boxes]]\nname = "Box"\nsize = [0.3, 0.3, 0.9]\nposition = [1.1, {}]\ncolor = [0.02, 0.85, 0.05]\n'


def sees(behavior: MakeBehavior, world: str, **balls: float) -> Behavior:
    """Return a behavior whose simulated robot has had a while with a world, in which balls are at these pans."""
    from naoserver_sim.world import parse_world

    made = parse_world(world, "w")
    b = behavior(DOCUMENT, robot="sim", camera="rendered", eyes="pictures", noise=True, seed=1, world=made)
    for name, pan in balls.items():
        b.robot.ball(name).place(pan=pan, distance=1.0, height=0.5)
    b.advance(1.5)
    return b


@pytest.mark.sim
@pytest.mark.gl
@pytest.mark.parametrize(
    "world",
    cases(
        [pytest.param(BALL.format("Green") + BALL.format("Other"), id="two balls")],
        [pytest.param(BALL.format("Green") + BOX.format(-0.4), id="a box beside it")],
    ),
)
def test_it_follows_one_ball_whatever_else_is_green(behavior: MakeBehavior, world: str) -> None:
    others = {"BallOther": -0.3} if "BallOther" in world else {}
    b = sees(behavior, world, BallGreen=0.15, **others)
    for _ in range(10):
        b.advance(0.1)
        assert bearing_error(b) < 0.03


@pytest.mark.sim
@pytest.mark.gl
@pytest.mark.parametrize("left", cases([0.0], [-0.3, 0.3]))
def test_a_green_box_is_no_ball(behavior: MakeBehavior, left: float) -> None:
    b = sees(behavior, BALL.format("Green") + BOX.format(left), BallGreen=math.pi)
    assert b.active == "search"
