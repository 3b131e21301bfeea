"""The pose of a robot from what is seen of a field, computed from its model."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest

from naoserver.soccer_field import Field, FieldLines
from tests.support.soak import cases
from visualhfsm_match.localization import Localizer, Pose

FIELD = Field()
LINES = FieldLines(FIELD).samples
HALF_WIDTH, HALF_HEIGHT = math.tan(0.53), math.tan(0.415)
EYE = np.array((0.05, 0.0, 0.5))
FARTHEST = {"line": 3.0, "crossing": 3.0, "goalpost": 8.0}
PLACES = [(-0.75, 0.0, 0.0), (-2.0, 1.5, -0.8), (2.4, -1.2, 0.5)]


class Thing(NamedTuple):
    """A thing as `Sight` has it."""

    kind: str
    name: str
    x: float
    y: float
    camera: str = "Camera"


def turned(yaw: float, pitch: float):
    """Return the matrix of a camera that looks down by the pitch, then to the left by the yaw."""
    (a, b), (c, d) = (math.cos(yaw), math.sin(yaw)), (math.cos(pitch), math.sin(pitch))
    return np.array([[a, -b, 0], [b, a, 0], [0, 0, 1]]) @ [[c, 0, d], [0, 1, 0], [-d, 0, c]]


def on_field(*, lines: bool, posts: bool, net: bool) -> Iterator[tuple[str, str, float, float]]:
    """Yield what there is on the field, with the net of a goal as it looks from before the goal."""
    if lines:
        yield from (("line", "", x, y) for x, y in LINES[::2].tolist())
        yield from (("crossing", name, x, y) for x, y, name in FIELD.crossings)
    if posts:
        yield from (("goalpost", "", x, y) for x, y in FIELD.posts)
    if net:
        yield from (
            ("line", "", x, y / 10) for x in np.arange(4.68, 5.1, 0.05).tolist() for y in range(-7, 8)
        )


def seen(pose, *, yaw=0.0, pitch=0.25, lean=0.0, lines=True, posts=True, net=False, robots=()) -> list[Thing]:
    """Return what a camera shows at a pose; `lean` is by how much it looks down more than the robot knows."""
    x, y, heading = pose
    true, known = turned(yaw, pitch + lean), turned(yaw, pitch)
    things = [Thing("robot", "blue", *robot) for robot in robots]
    for kind, name, at_x, at_y in on_field(lines=lines, posts=posts, net=net):
        cos, sin = math.cos(heading), math.sin(heading)
        own = np.array((cos * (at_x - x) + sin * (at_y - y), -sin * (at_x - x) + cos * (at_y - y), 0.0))
        high = np.add(own, (0.0, 0.0, EYE[2] if kind == "goalpost" else 0.0))
        ahead, left, up = (high - EYE) @ true
        if math.hypot(*own) > FARTHEST[kind] or ahead <= 0.0:
            continue
        if abs(left) > HALF_WIDTH * ahead or abs(up) > HALF_HEIGHT * ahead:
            continue
        ray = known @ ((own - EYE) @ true)
        there = EYE + ray * (EYE[2] / -ray[2])
        things.append(Thing(kind, name, float(there[0]), float(there[1])))
    return things


@lru_cache(64)
def seen_at(pose, yaw, **how) -> list[Thing]:
    return seen(pose, yaw=yaw, **how)


def look(localizer: Localizer, pose, times=6, **how):
    """Let it look at the field, to the left and to the right."""
    for number in range(times):
        localizer.see(seen_at(pose, (0.0, 0.7, -0.7)[number % 3], **how))


def error(pose: Pose, truth) -> tuple[float, float]:
    """Return how far an estimate is off, in m and rad."""
    turn = (pose.heading - truth[2] + math.pi) % math.tau - math.pi
    return math.dist(pose[:2], truth[:2]), abs(turn)


@pytest.mark.parametrize("truth", PLACES)
def test_looks_correct_a_start_that_is_wrong(truth):
    start = (truth[0] + 0.12, truth[1] - 0.1, truth[2] + 0.12)
    localizer = Localizer(FIELD, start)
    assert localizer.pose == pytest.approx(start)
    look(localizer, truth)
    place, turn = error(localizer.pose, truth)
    assert place < 0.03
    assert turn < 0.015
    assert localizer.confidence > 0.9


def test_it_learns_how_far_the_camera_leans():
    localizer = Localizer(FIELD, PLACES[0])
    look(localizer, PLACES[0], times=12, lean=0.025)
    assert error(localizer.pose, PLACES[0])[0] < 0.03
    assert localizer.confidence > 0.9


def test_a_lean_that_it_has_learned_makes_it_no_less_sure():
    truth = (0.9, 2.1, math.pi / 2)
    localizer = Localizer(FIELD, truth)
    look(localizer, truth, times=12, lean=0.05, pitch=0.5)
    assert localizer.confidence > 0.9


def test_the_net_of_a_goal_makes_it_no_less_sure():
    truth = (3.7, 0.2, 0.0)
    localizer = Localizer(FIELD, truth)
    look(localizer, truth, times=12, net=True)
    assert error(localizer.pose, truth)[0] < 0.05
    assert localizer.confidence > 0.9


ROBOTS = (0.8, 0.1), (1.0, -0.5), (1.4, 0.6)


def test_other_robots_make_it_no_less_sure():
    truth = (-0.2, 0.1, 0.0)
    localizer = Localizer(FIELD, truth)
    look(localizer, truth, times=12, robots=ROBOTS)
    assert error(localizer.pose, truth)[0] < 0.03
    assert localizer.confidence > 0.9


def test_posts_alone_correct_the_heading():
    truth = (0.5, 0.3, 0.0)
    localizer = Localizer(FIELD, (0.5, 0.3, 0.1))
    look(localizer, truth, times=3, lines=False, pitch=0.1)
    assert error(localizer.pose, truth)[1] < 0.02


def test_the_start_is_where_the_odometry_began():
    localizer = Localizer(FIELD, (1.0, 0.0, math.pi / 2))
    localizer.move(0.5, 0.1, 0.3)
    assert localizer.pose == pytest.approx((0.9, 0.5, math.pi / 2 + 0.3))
    localizer.move(0.5 + math.cos(0.3), 0.1 + math.sin(0.3), 0.3)
    x, y = 0.9 + math.cos(math.pi / 2 + 0.3), 0.5 + math.sin(math.pi / 2 + 0.3)
    assert localizer.pose == pytest.approx((x, y, math.pi / 2 + 0.3))


@pytest.mark.slow
def test_a_slipping_walk_is_corrected_on_the_way():
    localizer, x = Localizer(FIELD, (-2.0, 0.5, 0.0)), -2.0
    while x < 0.0:
        x += 0.1
        localizer.move(1.2 * (x + 2.0), 0.0, 0.1 * (x + 2.0))  # 20 % too far, and 6 degrees a meter aside
        look(localizer, (x, 0.5, 0.0), times=1)
    place, turn = error(localizer.pose, (x, 0.5, 0.0))
    assert place < 0.15  # instead of 0.46
    assert turn < 0.1


def test_without_looks_it_gets_less_sure():
    localizer = Localizer(FIELD, PLACES[0])
    before, covariance = localizer.confidence, localizer.covariance
    localizer.move(4.0, 0.0, 0.0)
    assert localizer.confidence < 0.5 < before
    assert (np.diag(localizer.covariance) > np.diag(covariance)).all()


@pytest.mark.parametrize("carried_to", [(-2.6, -1.0, 2.0), (0.4, 1.4, -0.5), (2.2, 0.3, 1.2)])
def test_a_robot_that_was_carried_away_is_not_believed(carried_to):
    localizer = Localizer(FIELD, PLACES[0])
    look(localizer, PLACES[0])
    assert localizer.confidence > 0.9
    look(localizer, carried_to, times=12)
    assert localizer.confidence < 0.5


def test_only_the_start_distinguishes_the_halves_of_the_field():
    x, y, heading = PLACES[0]
    localizer = Localizer(FIELD, PLACES[0])
    look(localizer, (-x, -y, heading + math.pi))
    assert error(localizer.pose, PLACES[0])[0] < 0.03
    assert localizer.confidence > 0.9


@pytest.mark.parametrize("how", [{"pitch": -0.6}, {"lines": False, "posts": False}])
def test_a_look_that_shows_nothing_changes_nothing(how):
    localizer = Localizer(FIELD, PLACES[2])
    before = localizer.confidence
    localizer.see(seen((9.0, 9.0, 0.5) if "lines" in how else PLACES[2], **how))
    assert localizer.pose == pytest.approx(PLACES[2])
    assert localizer.confidence <= before


def look_to_all_sides(localizer: Localizer, pose, **how):
    localizer.look_around()
    for yaw in (0.0, 0.9, 1.8, -0.9, -1.8):
        for pitch in (0.15, 0.75):  # as two cameras
            localizer.see(seen_at(pose, yaw, pitch=pitch, **how))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "start"),
    cases(
        [
            ((-0.75, 0.0, -3.0), (-0.75, 0.0, 0.0)),  # turned
            ((-0.75, 0.0, 0.0), (-0.75, 1.0, -0.2)),
            ((3.3, -0.8, 0.4), (-0.75, 0.0, 0.0)),  # anywhere
            ((-1.5, -2.8, 1.6), (-0.75, 0.0, 0.0)),  # at the side line
            ((1.5, 1.0, 0.3), (-0.75, 0.0, 0.0)),  # carried away
        ],
        [
            pytest.param((-0.75, 0.0, 1.6), (-0.75, 0.0, 0.0)),
            pytest.param((-0.75, 0.0, 0.0), (-1.75, 0.0, 0.2)),
            pytest.param((-2.5, 1.5, -1.5), (-0.75, 0.0, 0.0)),
        ],
    ),
)
def test_a_lost_robot_that_looks_to_all_sides_finds_its_place(truth, start):
    localizer = Localizer(FIELD, start)
    look_to_all_sides(localizer, truth, lean=0.015)
    assert localizer.find()
    place, turn = error(localizer.pose, truth)
    assert place < 0.1
    assert turn < 0.04
    look(localizer, truth, times=3, lean=0.015)
    assert localizer.confidence > 0.6


@pytest.mark.slow
def test_looks_before_a_walk_count_where_they_were_taken():
    localizer = Localizer(FIELD, (-0.75, 0.0, 0.0))
    look_to_all_sides(localizer, (-2.0, 1.5, 0.5))
    localizer.move(0.3, 0.1, 0.4)
    assert localizer.find()
    there = complex(-2.0, 1.5) + complex(0.3, 0.1) * complex(math.cos(0.5), math.sin(0.5))
    place, turn = error(localizer.pose, (there.real, there.imag, 0.9))
    assert place < 0.1
    assert turn < 0.04


@pytest.mark.slow
def test_of_two_halves_that_look_the_same_it_takes_the_nearer_one():
    for start, truth in (((-1.0, 0.5, 0.3), PLACES[1]), ((1.0, -0.5, 0.3 - math.pi), PLACES[1])):
        localizer = Localizer(FIELD, start)
        look_to_all_sides(localizer, truth)
        assert localizer.find()
        x, y, heading = truth
        twin = (-x, -y, heading + math.pi)
        assert error(localizer.pose, truth if start[0] < 0 else twin)[0] < 0.1


def test_something_else_may_distinguish_the_halves():
    localizer = Localizer(FIELD, (-1.0, 0.5, 0.3))
    before = localizer.covariance
    localizer.change_halves()
    assert localizer.pose == pytest.approx((1.0, -0.5, 0.3 - math.pi))
    assert np.diag(localizer.covariance) == pytest.approx(np.diag(before))
    localizer.change_halves()
    assert localizer.pose == pytest.approx((-1.0, 0.5, 0.3))


def test_looks_that_show_too_little_find_no_place():
    localizer = Localizer(FIELD, PLACES[0])
    localizer.look_around()
    assert not localizer.find()
    look_to_all_sides(localizer, PLACES[0], lines=False, posts=False)
    assert not localizer.find()
    assert localizer.pose == pytest.approx(PLACES[0])


def test_a_look_counts_where_it_was_taken():
    """A turn of 0.3 rad/s, seen 0.1 s late, would be off by 0.03 rad."""
    localizer, heading = Localizer(FIELD, (0.0, 0.0, 0.0)), 0.0
    for number in range(20):
        before, heading = heading, 0.03 * number
        localizer.move(0.0, 0.0, heading, 0.1 * number)
        localizer.see(seen_at((0.0, 0.0, before), 0.0), 0.1)
    assert error(localizer.pose, (0.0, 0.0, heading))[1] < 0.005
