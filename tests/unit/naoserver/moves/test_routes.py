"""Routes between postures: the motions that they consist of."""

import math

import pytest

from naoserver.bodies import find_body
from naoserver.bodies.parts import Stance
from naoserver.moves.routes import (
    MotionRoute,
    PostureRoute,
    RouteError,
    SafestPostureRoute,
    Situation,
    nearest_posture,
    stance_of,
)
from tests.support.motion_rig import MOTIONS

H25 = find_body("H25")
POSTURES = {name: posture.angles for name, posture in H25.postures.items()}
STANCES = {name: posture.stance for name, posture in H25.postures.items()}
UP = {
    Stance.STANDING: (0.0, 0.0, 1.0), Stance.SITTING: (0.0, 0.0, 1.0), Stance.BELLY: (-1.0, 0.0, 0.0),
    Stance.BACK: (1.0, 0.0, 0.0), Stance.LEFT_SIDE: (0.0, -1.0, 0.0), Stance.RIGHT_SIDE: (0.0, 1.0, 0.0),
}  # fmt: skip
"""What points up in the torso's frame."""


def situation(posture, up=None):
    return Situation(dict(POSTURES[posture]), up or UP[STANCES[posture]])


def legs(begin, end):
    """Return the names of the legs when each ends as it should."""
    route, here, names = PostureRoute(H25, end, MOTIONS.values()), begin, []
    while (leg := route.next_leg(situation(here), POSTURES[here])) is not None:
        names.append(leg.name)
        here = leg.end
    assert here == end
    return names


@pytest.mark.parametrize("posture", POSTURES)
def test_each_posture_is_known_when_the_body_is_in_it(posture):
    assert nearest_posture(H25, situation(posture)) == posture
    assert stance_of(H25, situation(posture)) is STANCES[posture]


def test_a_head_that_looks_around_makes_no_other_posture():
    here = situation("Crouch")
    turned = Situation({**here.joints, "HeadYaw": 1.5, "RHand": 1.0}, here.up)
    assert nearest_posture(H25, turned) == "Crouch"


def test_raised_arms_are_no_posture_but_the_body_still_stands():
    here = situation("StandInit")
    raised = Situation({**here.joints, "LShoulderPitch": -1.5}, here.up)
    assert (nearest_posture(H25, raised), stance_of(H25, raised)) == ("", Stance.STANDING)


@pytest.mark.parametrize("degrees", [-55, 0, 55])
def test_a_body_that_leans_does_not_lie(degrees):
    lean = math.radians(degrees)
    here = situation("StandInit", (math.sin(lean), 0.0, math.cos(lean)))
    assert stance_of(H25, here) is Stance.STANDING


@pytest.mark.parametrize("begin", POSTURES)
@pytest.mark.parametrize("end", POSTURES)
def test_there_is_a_way_from_every_posture_to_every_other(begin, end):
    assert len(legs(begin, end)) <= 8


@pytest.mark.parametrize(
    ("begin", "end", "names"),
    [
        ("StandZero", "Crouch", ["to Crouch"]),
        ("LyingBelly", "Stand", ["stand_up_from_belly", "to Stand"]),
        ("LyingBack", "StandInit", ["sit_up", "sit_upright", "stand_up_from_sit", "to StandInit"]),
        ("StandZero", "Sit", ["to StandInit", "sit_down", "to Sit"]),
        ("Sit", "Stand", ["stand_up_from_sit", "to Stand"]),
        ("SitRelax", "Sit", ["sit_upright"]),
        ("Sit", "LyingBack", ["lean_back", "lie_back", "to LyingBack"]),
    ],
)
def test_a_way_takes_few_motions(begin, end, names):
    assert legs(begin, end) == names


@pytest.mark.parametrize("side", [Stance.LEFT_SIDE, Stance.RIGHT_SIDE])
def test_from_its_side_the_body_first_turns(side):
    leg = PostureRoute(H25, "Stand", MOTIONS.values()).next_leg(
        situation("StandInit", UP[side]), POSTURES["StandInit"]
    )
    assert leg is not None
    assert leg.end == ""


def test_what_fails_again_and_again_is_given_up():
    route, here = PostureRoute(H25, "Stand", MOTIONS.values()), situation("LyingBelly")
    for _ in range(3):
        leg = route.next_leg(here, POSTURES["LyingBelly"])
        assert leg is not None
        assert leg.name == "stand_up_from_belly"
    with pytest.raises(RouteError, match="still lying on its belly after 3 motions"):
        route.next_leg(here, POSTURES["LyingBelly"])


@pytest.mark.parametrize("posture", [name for name, stance in STANCES.items() if stance is Stance.STANDING])
def test_the_safest_posture_of_a_body_that_stands_is_a_crouch(posture):
    route = SafestPostureRoute(H25, MOTIONS.values())
    leg = route.next_leg(situation(posture), POSTURES[posture])
    assert leg is not None
    assert leg.end == "Crouch"
    assert route.next_leg(situation("Crouch"), POSTURES["Crouch"]) is None
    assert route.abandoned() is route


@pytest.mark.parametrize(
    "posture", [name for name, stance in STANCES.items() if stance is not Stance.STANDING]
)
def test_a_body_that_does_not_stand_is_safe_as_it_is(posture):
    assert SafestPostureRoute(H25, MOTIONS.values()).next_leg(situation(posture), POSTURES[posture]) is None


def test_without_its_client_only_what_changes_the_stance_goes_on():
    going_on = {name for name, motion in MOTIONS.items() if MotionRoute(H25, motion).abandoned() is not None}
    gestures = {"dance", "kick", "kick_left", "lean_back", "sit_upright", "wave"}
    assert going_on == MOTIONS.keys() - gestures
    assert PostureRoute(H25, "StandZero", MOTIONS.values()).abandoned() is not None


def test_a_motion_that_begins_elsewhere_is_refused():
    route = MotionRoute(H25, MOTIONS["kick"])
    with pytest.raises(
        RouteError, match="kick begins standing, in StandInit, but the robot is lying on its back"
    ):
        route.next_leg(situation("LyingBack"), POSTURES["LyingBack"])


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=lambda motion: motion.name)
def test_a_motion_of_our_own_ends_in_the_posture_that_it_names(motion):
    assert motion.description
    if motion.end:
        end = motion.at(motion.duration, dict.fromkeys(H25.joint_names, 0.0))
        wrong = {
            joint: angle for joint, angle in end.items() if abs(angle - POSTURES[motion.end][joint]) > 1e-3
        }
        assert not wrong or motion.name in ("roll_over",)
