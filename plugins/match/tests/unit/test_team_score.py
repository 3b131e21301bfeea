"""Football in a team, `team_score`: what a robot does follows from the role that the team leaves it."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import pytest

from interfaces.nao import RoleClaim, Teammate
from naoserver.errors import InvalidCommand
from naoserver.serving.medium import REPORT, Membership
from tests.support.present import present
from visualhfsm.testing import Behavior, MakeBehavior
from zenoh_ice.transport import Registration

pytestmark = pytest.mark.slow

DOCUMENT = "behaviors/team_score.xml"
HAND_OVER = 1.5
"""Seconds until a robot does what a lost mate did: the team's second, and its own cycles."""


class Mate:
    """A robot of the team as a medium: it reports where the ball is and which roles it has, until it is gone."""

    def __init__(self, *roles: str, ball: complex = 1.0 + 0j) -> None:
        self.is_there = True
        self.roles = list(roles)
        self.ball = ball
        self.place: complex | None = None
        self._hear: Callable[[bytes], object] = lambda _: None

    def send(self, team: str, message: bytes) -> None:
        """Hear nothing."""

    def subscribe(self, team: str, callback: Callable[[bytes], object]) -> Registration:
        self._hear = callback
        return Registration(lambda: None)

    def join(self, b: Behavior) -> None:
        """Report five times a second."""

        def report() -> None:
            if self.is_there:
                reported = Teammate(
                    name="mate",
                    session=1,
                    time=b.time,
                    ready=True,
                    placeAge=math.inf if self.place is None else 0.0,
                    x=self.place.real if self.place else 0.0,
                    y=self.place.imag if self.place else 0.0,
                    ballX=self.ball.real,
                    ballY=self.ball.imag,
                    claims=[RoleClaim(role, 0.1, True) for role in self.roles],
                )
                self._hear(bytes(REPORT.result.gather_result(reported, "what the mate reports")))

        b.world.clock.call_every(0.2, report)


@pytest.fixture
def play(behavior: MakeBehavior) -> Callable[[Mate], Behavior]:
    def begin(mate: Mate) -> Behavior:
        b = behavior(DOCUMENT, robot="fake", member=Membership("nao", "red", mate))
        mate.join(b)
        return b

    return begin


def test_alone_it_strikes(behavior: MakeBehavior) -> None:
    b = behavior(DOCUMENT, robot="fake")
    b.run_until("play/strike", limit=0.5)
    assert b.component.Team.getReport().doing == "strikes"


@pytest.mark.parametrize(
    ("roles", "state"),
    [(["striker"], "play/keep"), (["keeper"], "play/turn"), (["striker", "keeper"], "play/support")],
)
def test_it_does_what_the_team_leaves_it(
    play: Callable[[Mate], Behavior], roles: list[str], state: str
) -> None:
    b = play(Mate(*roles))
    b.advance(2.0)
    assert b.is_active(state)
    b.advance(2.0)
    assert b.is_active(state)
    assert not b.errors


def test_it_strikes_when_the_striker_is_gone(play: Callable[[Mate], Behavior]) -> None:
    mate = Mate("striker", "keeper")
    b = play(mate)
    b.advance(2.0)
    assert b.is_active("play/support")
    mate.is_there = False
    b.run_until("play/strike", limit=HAND_OVER)


def test_a_supporter_goes_where_the_ball_is_that_a_mate_sees(play: Callable[[Mate], Behavior]) -> None:
    b = play(Mate("striker", "keeper", ball=2.0 + 1.0j))
    b.advance(30.0)
    here, facing = b.component.place()
    assert abs(here - (2.0 + 1.0j)) < 2.0
    assert abs(here - (2.0 + 1.0j)) > 0.8
    assert ((2.0 + 1.0j - here) / facing).real > 0.0, "it does not face the ball"


@pytest.mark.parametrize("ball", [-2.0 + 1.5j, -3.8 - 0.5j])
def test_a_keeper_stays_between_its_goal_and_the_ball(
    ball: complex, play: Callable[[Mate], Behavior]
) -> None:
    b = play(Mate("striker", ball=ball))
    b.advance(60.0)
    (here, facing), goal = b.component.place(), -4.5 + 0j
    assert abs(here - goal) == pytest.approx(max(0.4, abs(ball - goal) - 1.5), abs=0.4)
    assert abs(((here - goal) / (ball - goal)).imag * abs(ball - goal)) < 0.4, "a ball passes it"
    assert ((ball - here) / facing).real > 0.0, "it does not face the ball"


def test_a_robot_that_has_fallen_gets_up_and_leaves_the_rest_to_the_others(
    behavior: MakeBehavior,
) -> None:
    b = behavior(DOCUMENT, robot="fake")
    b.run_until("play/strike", limit=0.5)
    standing = b.robot.device.state
    fallen = type(standing())(torso_tilt=1.5, fallen=True, real_time_factor=1.0, lag=0.0)
    b.robot.device.state = lambda: fallen  # type: ignore[method-assign]
    b.run_until("get up", limit=0.5)
    assert b.component.Team.getRobotOf("striker") == ""
    b.robot.device.state = standing  # type: ignore[method-assign]
    b.run_until("play/strike", limit=20.0)


@pytest.mark.parametrize(("away", "waits"), [(0.3, True), (1.5, False)])
def test_it_gets_up_where_there_is_room_and_waits_for_it_not_for_long(
    away: float, waits: bool, play: Callable[[Mate], Behavior]
) -> None:
    b = play(mate := Mate("striker", "keeper"))
    b.run_until("play/support", limit=1.0)
    here, _ = b.component.place()
    mate.place = here + away
    b.advance(0.5)
    standing = b.robot.device.state
    fallen = type(standing())(torso_tilt=1.5, fallen=True, real_time_factor=1.0, lag=0.0)
    b.robot.device.state = lambda: fallen  # type: ignore[method-assign]
    b.run_until("get up", limit=0.5)
    began = b.time
    b.run_until(lambda: b.calls("Postures.goToPosture"), limit=6.0)
    assert (b.time - began > 3.0) is waits


def test_a_walk_that_is_refused_ends_no_play(play: Callable[[Mate], Behavior]) -> None:
    b = play(Mate("striker", "keeper", ball=2.0 + 1.0j))
    b.run_until("play/support", limit=1.0)

    def refuse(velocity: object) -> None:
        raise InvalidCommand("velocity", "the robot lies")

    walker = present(b.robot.device.walker)
    command = walker.command
    walker.command = refuse  # type: ignore[method-assign]
    b.run_until("get up", limit=2.0)
    walker.command = command  # type: ignore[method-assign]
    b.run_until("play/support", limit=20.0)
    assert not b.errors


def test_a_striker_turns_to_where_a_mate_sees_the_ball(play: Callable[[Mate], Behavior]) -> None:
    b = play(Mate("keeper", ball=-3.0 + 0.0j))
    b.run_until("play/turn", limit=2.0)
    to_ball = cmath.phase(b.component.beside(-3.0 + 0.0j))
    b.advance(0.3)
    walk = b.calls("Walk.walkTo")[-1]
    assert (walk.x, walk.y) == (0.0, 0.0)
    assert walk.heading == pytest.approx(to_ball, abs=0.2)
    assert abs(to_ball) > 2.0
    b.run_until("play/strike/search", limit=7.0)  # the ball is not there
    b.advance(3.0)
    assert b.is_active("play/strike"), "it turns again and again"
