"""Curves of joints that lead effectors through places in space."""

import numpy as np
import pytest

from naoserver.bodies import find_body
from naoserver.bodies.kinematics import kinematics_of, matrix_of
from naoserver.errors import InvalidCommand
from naoserver.moves.effector_paths import (
    EVERY_AXIS,
    FIXED,
    LEGS,
    PLANE,
    POSITION,
    Waypoints,
    curves_along,
    curves_on_feet,
    reach_places,
)
from naoserver.moves.joint_paths import smooth_curve

HERE = np.eye(4)
REACHES = {"H25": (0.05, 0.0, 0.05), "T1": (0.05, -0.05, 0.1), "G1": (0.05, 0.0, 0.05)}
"""Shifts of the left hand from the body's posture of rest in m."""


def way_of(name):
    """Return kinematics, angles at rest, the place of the left hand, and a shifted one."""
    body = find_body(name)
    kinematics, start = kinematics_of(body), dict(body.resting_angles)
    begin = kinematics.place_of("LArm", start)
    goal = begin.copy()
    goal[:3, 3] += REACHES[name]
    return kinematics, start, begin, goal


def along(kinematics, start, *places, times):
    """Return what the places of the left hand are at a time on a way."""
    joints = kinematics.joints_of("LArm")
    curves = curves_along(kinematics, {"LArm": Waypoints(times, places, POSITION)}, HERE, start, joints)
    assert list(curves) == joints
    return lambda time: kinematics.place_of(
        "LArm", start | {name: of.at(time) for name, of in curves.items()}
    )


@pytest.mark.parametrize("name", REACHES)
def test_a_hand_goes_straight_to_a_place(name):
    kinematics, start, begin, goal = way_of(name)
    at = along(kinematics, start, goal, times=[2.0])
    for share in (0.0, 0.25, 0.5, 1.0):
        expected = begin[:3, 3] + share * np.array(REACHES[name])
        assert at(2.0 * share)[:3, 3] == pytest.approx(expected, abs=0.005)


def test_a_hand_passes_each_place_at_its_time():
    kinematics, start, begin, goal = way_of("H25")
    at = along(kinematics, start, goal, begin, times=[0.5, 1.0])
    assert at(0.5)[:3, 3] == pytest.approx(goal[:3, 3], abs=0.002)
    assert at(1.0)[:3, 3] == pytest.approx(begin[:3, 3], abs=0.002)


@pytest.mark.parametrize("base", [HERE, np.diag([-1.0, -1.0, 1.0, 1.0])], ids=["ahead", "turned"])
def test_the_feet_stay_where_they_are_while_the_torso_moves(base):
    body = find_body("H25")
    kinematics, start = kinematics_of(body), dict(body.resting_angles)
    torso = base.copy()
    torso[2, 3] -= 0.02
    found = reach_places(kinematics, {"Torso": (torso, EVERY_AXIS)}, base, start, near=start)
    for leg in LEGS:
        before, after = base @ kinematics.place_of(leg, start), torso @ kinematics.place_of(leg, found)
        assert after == pytest.approx(before, abs=0.002)


def on_feet(asked, state, seconds=3.0):
    """Return the places of the soles in each other's frames while joints go to angles, and the joints' ends."""
    kinematics, start = kinematics_of(find_body("H25")), dict(find_body("H25").resting_angles)
    curves = {joint: smooth_curve(joint, start[joint], [seconds], [angle]) for joint, angle in asked.items()}
    floor = np.linalg.inv(kinematics.place_of("LLeg", start)).astype(np.float64)
    found = curves_on_feet(kinematics, dict.fromkeys(LEGS, state), curves, floor, start)
    places = []
    for moment in np.linspace(0.0, seconds, 31):
        angles = start | {joint: curve.at(moment) for joint, curve in found.items()}
        left, right = (kinematics.place_of(leg, angles) for leg in LEGS)
        places.append(np.linalg.inv(left) @ right)
    return np.array(places), {joint: found[joint].at(seconds) for joint in asked}


def test_feet_that_are_fixed_stay_while_the_knees_bend():
    knees = {"LKneePitch": 1.2, "RKneePitch": 1.2}
    places, ends = on_feet(knees, FIXED)
    assert places == pytest.approx(np.broadcast_to(places[0], places.shape), abs=0.002)
    assert ends == pytest.approx(knees, abs=0.01)


def test_feet_in_a_plane_turn_with_the_hips_and_both_soles_stay_flat():
    places, ends = on_feet({"LHipYawPitch": -0.78}, PLANE)
    assert ends["LHipYawPitch"] == pytest.approx(-0.78, abs=0.01)
    assert places[:, 2, 2] == pytest.approx(1.0, abs=1e-4)
    assert places[:, 2, 3] == pytest.approx(0.0, abs=0.002)
    turned = np.arctan2(places[-1, 1, 0], places[-1, 0, 0])
    assert turned == pytest.approx(-1.18, abs=0.05)


def test_the_torso_stays_in_the_middle_over_feet_in_a_plane_while_the_knees_bend():
    body = find_body("H25")
    kinematics, start = kinematics_of(body), dict(body.resting_angles)
    knees = {knee: smooth_curve(knee, start[knee], [2.0], [1.2]) for knee in ("LKneePitch", "RKneePitch")}
    curves = curves_on_feet(kinematics, dict.fromkeys(LEGS, PLANE), knees, HERE, start)
    halfway = start | {joint: curve.at(1.0) for joint, curve in curves.items()}
    left, right = (kinematics.place_of(leg, halfway)[1, 3] for leg in LEGS)
    assert left + right == pytest.approx(0.0, abs=0.01)


def test_fixed_feet_do_not_turn_with_the_hips():
    places, ends = on_feet({"LHipYawPitch": -0.78}, FIXED)
    assert places == pytest.approx(np.broadcast_to(places[0], places.shape), abs=0.003)
    assert ends["LHipYawPitch"] == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("change", [(0.0, -0.2, 0.0), (0.0, 0.0, -0.3), (0.15, 0.0, 0.1)])
def test_the_feet_stay_where_they_are_while_the_torso_goes_where_it_cannot(change):
    body = find_body("H25")
    kinematics, start = kinematics_of(body), dict(body.resting_angles)
    torso = HERE.copy()
    torso[:3, 3] += change
    found = reach_places(kinematics, {"Torso": (torso, EVERY_AXIS)}, HERE, start, near=start)
    left, right = (np.linalg.inv(kinematics.place_of("LLeg", angles)) for angles in (start, found))
    before, after = left @ kinematics.place_of("RLeg", start), right @ kinematics.place_of("RLeg", found)
    assert after == pytest.approx(before, abs=0.02)


def test_the_other_foot_stays_flat_on_the_floor_while_one_turns():
    body = find_body("H25")
    kinematics, start = kinematics_of(body), dict(body.resting_angles)
    goal = kinematics.place_of("LLeg", start).copy()
    goal[:3, :3] = goal[:3, :3] @ [[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]
    found = reach_places(kinematics, {"LLeg": (goal, EVERY_AXIS)}, HERE, start, near=start)
    before, after = (np.linalg.inv(kinematics.place_of("RLeg", angles)) for angles in (start, found))
    assert after @ kinematics.place_of("LLeg", found) == pytest.approx(before @ goal, abs=0.01)


FALLS = {"far ahead": (0.15, 0.0, 0.0, 0.0, 0.0, 0.0), "to a side": (0.0, 0.0, 0.0, 0.9, 0.0, 0.0)}
"""Changes of the torso: the center of mass leaves the soles; a sole leaves the floor."""


@pytest.mark.parametrize("change", FALLS.values(), ids=FALLS)
def test_a_torso_does_not_go_where_the_robot_would_fall(change):
    kinematics, start, _, _ = way_of("H25")
    place = matrix_of(change)
    with pytest.raises(InvalidCommand, match="the robot would fall"):
        reach_places(kinematics, {"Torso": (place, EVERY_AXIS)}, HERE, start, near=start)


def test_a_torso_goes_far_over_feet_of_which_one_moves_or_is_free():
    kinematics, start, _, _ = way_of("H25")
    far = {"Torso": (matrix_of(FALLS["far ahead"]), EVERY_AXIS)}
    reach_places(kinematics, far, HERE, start, near=start, feet={"LLeg": FIXED})
    moving = far | {"LLeg": (kinematics.place_of("LLeg", start), EVERY_AXIS)}
    reach_places(kinematics, moving, HERE, start, near=start)


def test_a_torso_goes_far_when_the_robot_did_not_stand_on_its_feet():
    kinematics, start, _, _ = way_of("H25")
    start |= {"LHipPitch": -1.2}
    reach_places(kinematics, {"Torso": (matrix_of(FALLS["far ahead"]), EVERY_AXIS)}, HERE, start, near=start)
