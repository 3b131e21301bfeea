"""Motions of the Booster T1 and the Unitree G1 in the simulation, with imperfect senses and gears; all kicks."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator
from itertools import starmap

import pytest

from interfaces.nao import ActionStatus
from naoserver.bodies import find_body
from naoserver.bodies.parts import Stance
from naoserver.moves.routes import RouteError, situation_of
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import World, load_world
from tests.support.motion_rig import MotionRig
from tests.support.soak import cases, repeated
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

BODIES = ("T1", "G1")
WAY = ("Crouch", "Stand", "StandInit", "StandZero")
"""Each posture once."""
FURTHER_WAY = ("Crouch", "StandZero", "Stand", "Crouch", "StandInit")
"""Each after others, too."""
LEAN = {"Crouch": 30.0}
"""The tilt of the trunk in a posture in degrees, at most."""

MakeRig = Callable[..., MotionRig]


@pytest.fixture
def rigs() -> Iterator[MakeRig]:
    """Make robots that stand at the origin."""
    made = []

    def make(body: str, world: World | None = None, seed: int = 1) -> MotionRig:
        clock = VirtualClock()
        world = world or load_world("empty")
        robot = SimulatedRobot(
            clock=clock, skin=False, world=world, body=find_body(body), seed=seed, noise=True
        )
        made.append(robot)
        rig = MotionRig(robot, clock)
        rig.let_go(0.5)
        return rig

    yield make
    for robot in made:
        robot.close()


def tilt(rig: MotionRig) -> float:
    """Return the tilt of the trunk in degrees."""
    return math.degrees(math.acos(min(1.0, situation_of(rig.robot).up[2])))


def largest_tilt(rig: MotionRig) -> float:
    """Let the motion end; return the largest tilt meanwhile in degrees."""
    largest = 0.0
    while rig.player.busy:
        rig.let_go(0.04)
        largest = max(largest, tilt(rig))
    assert rig.player.progress("motion").status is ActionStatus.Done
    return largest


@pytest.mark.parametrize("body", BODIES)
def test_it_goes_from_posture_to_posture_and_stays_there(rigs: MakeRig, body: str) -> None:
    rig = rigs(body)
    for posture in WAY + repeated(test=(), soak=FURTHER_WAY):
        progress = rig.go(posture)
        assert (progress.status, progress.message) == (ActionStatus.Done, "")
        rig.let_go(1.0)
        assert rig.posture == posture
        assert tilt(rig) < LEAN.get(posture, 5.0)


AHEAD, ASIDE = (40.0, 0.0), (-30.0, 30.0)


@pytest.mark.parametrize(
    ("body", "motion", "push"),
    cases(
        [("T1", "wave", ASIDE), ("T1", "nod", AHEAD), ("G1", "wave", ASIDE), ("G1", "bow", AHEAD)],
        starmap(
            pytest.param,
            [("T1", "wave", AHEAD), ("T1", "nod", ASIDE), ("G1", "wave", AHEAD), ("G1", "bow", ASIDE)],
        ),
    ),
)
def test_a_light_push_does_not_throw_it_over_in_a_gesture(
    rigs: MakeRig, body: str, motion: str, push: tuple[float, float]
) -> None:
    rig = rigs(body)
    rig.begin(motion)
    rig.let_go(1.0)
    rig.robot.stage.push((*push, 0.0), 0.15)
    assert largest_tilt(rig) < (20.0 if motion == "bow" else 8.0)


@pytest.mark.parametrize("body", BODIES)
def test_one_that_lies_says_that_it_cannot_get_up(rigs: MakeRig, body: str) -> None:
    rig = rigs(body)
    rig.robot.stage.push((-200.0, 0.0, 0.0), 0.4)
    rig.let_go(3.0)
    assert rig.stance not in (Stance.STANDING, Stance.SITTING)
    for posture in ("Stand", "Crouch"):
        message = f"it is {rig.stance}, and no motions lead from there to {posture}"
        with pytest.raises(RouteError, match=message):
            rig.begin_posture(posture)
    with pytest.raises(
        RouteError, match=f"kick begins standing, in StandInit, but the robot is {rig.stance}"
    ):
        rig.begin("kick")


KICKS = [("kick", 0), ("kick_left", 1)]
"""A motion, and where the ball lies of where it may lie: near, or far."""
OTHER_KICKS = [("kick", 1), ("kick_left", 0)]


@pytest.mark.parametrize(
    ("body", "motion", "far"),
    cases(
        [(body, *kick) for body in ("H25", *BODIES) for kick in KICKS],
        [pytest.param(body, *kick) for body in ("H25", *BODIES) for kick in OTHER_KICKS],
    ),
)
def test_it_kicks_a_ball_from_where_the_body_says_that_one_may_lie(
    rigs: MakeRig, body: str, motion: str, far: int
) -> None:
    kick = find_body(body).kicks[motion]
    x, y = kick.x[far], kick.y[far]
    rig = rigs(body, load_world("soccer"))
    stage = rig.robot.stage
    assert rig.go("StandInit").status is ActionStatus.Done
    robot = stage.truth().torso
    facing = cmath.rect(1.0, robot.heading)
    ball = complex(*robot.position[:2]) + facing * complex(x, y)
    stage.place_object("Ball", (ball.real, ball.imag, 0.05))
    rig.begin(motion)
    assert largest_tilt(rig) < 10.0
    rig.let_go(1.0)
    rolled = (complex(*stage.truth().objects["Ball"].position[:2]) - ball) / facing
    assert abs(rolled) > 0.5
    assert abs(cmath.phase(rolled)) < 0.25
    assert rig.posture == "StandInit"


@pytest.mark.parametrize(
    ("body", "motion"),
    cases(
        [("T1", "kick")],
        [pytest.param(*kick) for kick in (("T1", "kick_left"), ("G1", "kick"), ("G1", "kick_left"))],
    ),
)
def test_it_kicks_again_and_again(rigs: MakeRig, body: str, motion: str) -> None:
    rig = rigs(body)
    for _ in range(repeated(test=2, soak=3)):
        assert rig.go("StandInit").status is ActionStatus.Done
        rig.let_go(1.0)
        rig.begin(motion)
        assert largest_tilt(rig) < 10.0
