"""The facts files of all bodies: whole, like their makers', and consistent in themselves."""

import re
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.kinematics import kinematics_of
from naoserver.bodies.parts import Stance
from naoserver.errors import RobotError

MASSES = {"H25": 5.36, "H21": 5.36, "T1": 31.61, "G1": 33.34, "Cart": 3.945}
"""In kg, as the maker or its own model says; the cart's is that of a TurtleBot 4."""
JOINTS = {"H25": 26, "H21": 22, "T1": 23, "G1": 29, "Cart": 4}
HUMANOIDS = ("H25", "T1", "G1")
MIRRORED = {"T1": ("Left", "Right"), "G1": ("left", "right")}
NEW = ("T1", "G1", "Cart")
EDGE = 0.015
"""Distance in m of the center of mass from the edge of the soles."""


@pytest.fixture(params=BODY_NAMES)
def body(request):
    return find_body(request.param)


def test_a_body_is_found_by_its_name(body):
    assert find_body(body.name) is body
    assert len(body.joints) == JOINTS[body.name]


def test_an_unknown_body_is_refused_with_the_names_of_the_known_ones():
    with pytest.raises(RobotError, match="there is no body 'T2'; there are H25, H21, T1, G1, Cart"):
        find_body("T2")


def test_a_body_has_its_makers_mass(body):
    assert body.mass == pytest.approx(MASSES[body.name], rel=0.01)


def test_every_link_with_mass_has_an_inertia_that_is_possible(body):
    for link in body.links:
        of = link.inertia
        matrix = np.array([[of.ixx, of.ixy, of.ixz], [of.ixy, of.iyy, of.iyz], [of.ixz, of.iyz, of.izz]])
        moments = np.linalg.eigvalsh(matrix)
        if link.mass > 0:
            assert moments[0] > 0, link.name
            assert moments[2] <= moments[0] + moments[1] + 1e-9, link.name


@pytest.mark.parametrize("name", MIRRORED)
def test_the_right_side_mirrors_the_left(name):
    body, (left, right) = find_body(name), MIRRORED[name]
    mirrored = [joint for joint in body.joints if joint.name.startswith(left)]
    assert len(mirrored) == (len(body.joints) - len(body.groups.trunk) - len(body.groups.head)) / 2
    for joint in mirrored:
        other = body.joint[joint.name.replace(left, right, 1)]
        about_y = joint.axis == (0, 1, 0)
        expected = (joint.lower, joint.upper) if about_y else (-joint.upper, -joint.lower)
        assert (other.lower, other.upper) == expected, joint.name
        assert other.axis == joint.axis
        assert (other.max_velocity, other.max_torque, other.gear) == (
            joint.max_velocity, joint.max_torque, joint.gear,
        )  # fmt: skip
        x, y, z = joint.origin
        assert other.origin == pytest.approx((x, -y, z), abs=2e-5)


def test_each_joint_is_in_one_group_and_each_but_a_wheel_in_one_hinge(body):
    groups = body.groups
    limbs = (groups.head, groups.trunk, groups.arms, groups.legs, groups.wheels)
    assert sorted(joint for limb in limbs for joint in limb) == sorted(body.joint_names)
    hinged = [axis.joint for axes in body.hinges.values() for axis in axes.values()]
    assert sorted(hinged) == sorted(set(body.joint_names) - set(groups.wheels))


def test_a_group_leads_from_the_trunk_outwards(body):
    groups = body.groups
    for limb in (groups.head, groups.left_arm, groups.right_arm, groups.left_leg, groups.right_leg):
        for inner, outer in pairwise(limb):
            assert body.joint[inner].child == body.joint[outer].parent


@pytest.mark.parametrize("name", NEW)
def test_postures_are_within_ranges_and_tables(name):
    body = find_body(name)
    for posture in body.postures.values():
        for joint in body.joints:
            assert joint.lower <= posture.angles[joint.name] <= joint.upper, joint.name
        for table in body.tables:
            lower, upper = table.at(posture.angles[table.independent])
            assert lower <= posture.angles[table.dependent] <= upper, table.dependent


@pytest.mark.parametrize("name", ["T1", "G1"])
def test_in_each_posture_the_center_of_mass_is_over_flat_soles(name):
    body = find_body(name)
    assert {"Stand", "StandInit", "StandZero", "Crouch"} <= body.postures.keys()
    for title, posture in body.postures.items():
        assert posture.stance is Stance.STANDING
        kinematics = kinematics_of(body)
        feet = kinematics.soles(posture.angles)
        level = feet[0][:3, :3]
        assert feet[1][:3, :3] == pytest.approx(level, abs=1e-3)
        _, center = kinematics.center_of_mass("Body", posture.angles)
        for foot, sole in zip(feet, body.soles, strict=True):
            ahead = (level.T @ (center - foot[:3, 3]))[0]
            rear, front = (edge(x for x, _ in sole.outline) for edge in (min, max))
            assert rear + EDGE < ahead < front - EDGE, title
        left, right = ((level.T @ (center - foot[:3, 3]))[1] for foot in feet)
        assert left < 0 < right, title


@pytest.mark.parametrize("name", HUMANOIDS)
def test_a_humanoid_crouches_lower_than_it_stands(name):
    body = find_body(name)
    heights = {
        title: -min(foot[2, 3] for foot in kinematics_of(body).soles(body.postures[title].angles))
        for title in ("Stand", "Crouch")
    }
    assert heights["Crouch"] < 0.85 * heights["Stand"]


def sources_in(part):
    """Yield the sources that are named anywhere in a part of a description."""
    if isinstance(part, dict):
        yield from [part["source"]] if part.get("source") else []
        part = list(part.values())
    if isinstance(part, (list, tuple)):
        for each in part:
            yield from sources_in(each)


@pytest.mark.parametrize("name", NEW)
def test_every_source_is_explained(name):
    body = find_body(name)
    for source in sources_in(msgspec.to_builtins(body)):
        letters = re.match(r"((?:[A-Z]|own)(?:, (?:[A-Z]|own))*)\b", source)
        assert letters, source
        assert set(letters[1].split(", ")) <= body.sources.keys(), source
    for parts in (body.gears.values(), body.cameras, body.soles, body.lights.values()):
        assert all(part.source for part in parts)
    assert body.notes


def test_cameras_have_the_images_that_behaviors_ask_for(body):
    for camera in body.cameras:
        assert {(320, 240), (640, 480)} <= set(camera.sizes)
        assert len(camera.sizes) == len(camera.rates)


@pytest.mark.parametrize("name", ["T1", "G1"])
def test_soles_are_as_high_and_no_wider_than_the_boxes_on_which_the_feet_stand(name):
    body = find_body(name)
    for side, sole in zip(("left", "right"), body.soles, strict=True):
        box = next(shape for shape in body.shapes if shape.name == f"{side}_sole")
        assert box.link == sole.link
        assert sole.height == pytest.approx(box.size[2] - box.position[2])
        for x, y in sole.outline:
            assert abs(x - box.position[0]) <= box.size[0] + 1e-9
            assert abs(y - box.position[1]) <= box.size[1] + 1e-9


def test_the_first_camera_is_turned_by_the_neck(body):
    kinematics, neck = kinematics_of(body), body.neck
    turning = {axis.joint for axis in neck.axes.values()}
    link, movers = body.cameras[0].link, set()
    while link in body.moved_by:
        movers.add(body.moved_by[link].name)
        link = body.moved_by[link].parent
    assert turning <= movers
    straight = kinematics.link_place(body.cameras[0].link, body.resting_angles)
    assert straight[0, 0] > 0.9
