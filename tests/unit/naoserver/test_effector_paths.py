"""Curves of joints that lead effectors through places in space."""

import numpy as np
import pytest

from naoserver._effector_paths import EVERY_AXIS, LEGS, POSITION, Waypoints, curves_along, reach_places
from naoserver.bodies import find_body
from naoserver.kinematics import kinematics_of

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
