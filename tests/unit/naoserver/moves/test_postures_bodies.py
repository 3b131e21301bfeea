"""Stances, postures and the ways between them of bodies that are no Nao."""

import math
from typing import Any

import pytest
from msgspec import structs

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import InertialReading
from naoserver.bodies.parts import FallRules, Posture, Stance
from naoserver.fake import FakeRobot
from naoserver.moves.motion_file import Key, Motion, load_motions, parse_motion
from naoserver.moves.routes import (
    MotionRoute,
    PostureRoute,
    RouteError,
    SafestPostureRoute,
    Situation,
    nearest_posture,
    stance_of,
)
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from tests.support.bodies import ARM, CART, GIANT
from zenoh_ice import VirtualClock

UPRIGHT = (0.0, 0.0, 1.0)
ON_ITS_BACK = (1.0, 0.0, 0.0)
ON_ITS_SIDE = (0.0, 1.0, 0.0)
STRAIGHT = dict.fromkeys(GIANT.joint_names, 0.0)
BENT = STRAIGHT | {
    f"{side}_{joint}": angle
    for side in ("port", "starboard")
    for joint, angle in (("thigh", -0.7), ("shin", 1.4), ("heel", -0.7))
}
TALL = structs.replace(
    GIANT,
    postures={
        "Stand": Posture(stance=Stance.STANDING, angles=STRAIGHT),
        "Crouch": Posture(stance=Stance.STANDING, angles=BENT),
    },
)
"""A body that can only stand and crouch."""


def test_it_is_in_a_posture_however_it_looks_around():
    turned = Situation(BENT | {"belt_turn": 1.0, "belt_bow": 0.5}, UPRIGHT)
    assert nearest_posture(TALL, turned) == "Crouch"
    assert nearest_posture(TALL, Situation(BENT | {"port_swing": 1.0}, UPRIGHT)) == ""
    assert nearest_posture(TALL, Situation(BENT, ON_ITS_BACK)) == ""


@pytest.mark.parametrize(
    ("up", "stance"),
    [(UPRIGHT, Stance.STANDING), (ON_ITS_BACK, Stance.BACK), (ON_ITS_SIDE, Stance.RIGHT_SIDE)],
)
def test_its_tilt_says_how_it_lies(up, stance):
    assert stance_of(TALL, Situation(STRAIGHT, up)) is stance


def test_a_body_that_folds_lies_at_the_tilt_of_its_facts():
    folded = Situation(STRAIGHT, (math.sin(0.9), 0.0, math.cos(0.9)))
    folds = FallRules(standing_load=100.0, lying_load=50.0, lying_tilt=0.8)
    assert stance_of(TALL, folded) is Stance.STANDING
    assert stance_of(structs.replace(TALL, falls=folds), folded) is Stance.BACK


@pytest.mark.parametrize("body", [ARM, CART, GIANT], ids=lambda body: body.name)
def test_a_body_without_postures_has_no_stance(body):
    here = Situation(dict(body.resting_angles), UPRIGHT)
    assert stance_of(body, here) is None
    assert nearest_posture(body, here) == ""


def test_a_body_with_legs_that_sits_is_known_by_its_legs_alone():
    sitting = STRAIGHT | {"port_thigh": -1.5, "starboard_thigh": -1.5, "port_swing": -1.0}
    sits = structs.replace(
        TALL, postures=TALL.postures | {"Sit": Posture(stance=Stance.SITTING, angles=sitting)}
    )
    arms = {"port_swing": 1.5, "starboard_swing": 1.5, "belt_bow": -0.5}
    assert stance_of(sits, Situation(sitting | arms, UPRIGHT)) is Stance.SITTING
    assert stance_of(sits, Situation(BENT | arms, UPRIGHT)) is Stance.STANDING


def test_it_goes_straight_from_one_posture_to_the_other():
    route = PostureRoute(TALL, "Crouch", ())
    leg = route.next_leg(Situation(STRAIGHT, UPRIGHT), STRAIGHT)
    assert leg is not None
    assert leg.end == "Crouch"
    assert leg.at(leg.duration, STRAIGHT) == BENT
    assert route.next_leg(Situation(BENT, UPRIGHT), BENT) is None


@pytest.mark.parametrize(
    ("up", "stance"), [(ON_ITS_BACK, "lying on its back"), (ON_ITS_SIDE, "lying on its right side")]
)
def test_a_posture_that_no_motion_reaches_is_refused_with_the_reason(up, stance):
    with pytest.raises(RouteError, match=f"it is {stance}, and no motions lead from there to Stand"):
        PostureRoute(TALL, "Stand", ()).next_leg(Situation(STRAIGHT, up), STRAIGHT)


def test_the_safest_posture_is_a_crouch_or_the_one_in_which_it_is():
    here = Situation(STRAIGHT, UPRIGHT)
    leg = SafestPostureRoute(TALL, ()).next_leg(here, STRAIGHT)
    assert leg is not None
    assert leg.end == "Crouch"
    stiff = structs.replace(TALL, postures={"Stand": TALL.postures["Stand"]})
    assert SafestPostureRoute(stiff, ()).next_leg(here, STRAIGHT) is None


def test_a_motion_without_a_posture_moves_any_body():
    turn = Motion("turn", {"mast_turn": (Key(1.0, 0.5),)})
    angles = dict(CART.resting_angles)
    assert MotionRoute(CART, turn).next_leg(Situation(angles, UPRIGHT), angles) is turn
    assert MotionRoute(CART, turn).abandoned() is None


def test_a_motion_of_a_body_gives_its_own_joints():
    text = '[[frame]]\nafter = 1.0\nposture = "Crouch"\nswing = -0.5\nlift = 0.2\n'
    motion = parse_motion(text, "lift", "lift.toml", TALL)
    assert motion.at(1.0, STRAIGHT) == BENT | {
        "port_swing": -0.5, "starboard_swing": -0.5, "port_lift": 0.2, "starboard_lift": -0.2
    }  # fmt: skip


@pytest.mark.parametrize("body", [ARM, CART, TALL], ids=lambda body: body.name)
def test_a_body_of_a_user_has_no_motions(body):
    assert load_motions(body) == {}


def test_a_body_of_a_user_that_is_called_like_ours_has_none_of_ours():
    assert load_motions(structs.replace(CART, name="H25")) == {}


def test_an_h21_has_the_motions_of_the_h25():
    assert load_motions(find_body("H21")) == load_motions(find_body("H25"))


@pytest.mark.parametrize(
    ("body", "served"), [(TALL, True), (CART, False), (ARM, False)], ids=lambda of: str(of)[:9]
)
def test_postures_are_served_of_bodies_that_have_some(body, served):
    clock = VirtualClock()
    servants = Assembly(FakeRobot(clock, body=body), ServerOptions(), clock).servants
    assert ("Postures" in servants) is served
    assert "Motions" not in servants


def test_a_fallen_body_that_cannot_get_up_says_so():
    clock = VirtualClock()
    robot = FakeRobot(clock, body=TALL)
    robot.senses.feel(inertial=InertialReading(pitch=1.5))
    postures: Any = Assembly(robot, ServerOptions(), clock).servants["Postures"]
    with pytest.raises(RouteError, match="lying on its belly, and no motions lead from there to Stand"):
        postures.go("Stand", 1.0, "")
