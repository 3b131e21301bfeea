"""The pose of a robot from pictures of a field that are drawn from its model."""

from __future__ import annotations

import itertools
import math
from functools import cache, lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from naoserver.soccer_field import POST_RADIUS, Field
from tests.support.soak import cases
from visualhfsm_match.localization import Localizer, Pose

FIELD = Field()
WIDTH, HEIGHT, FOCAL = 320, 240, 272.0
EYE = np.array((0.05, 0.0, 0.5))
GRASS, WHITE, SKY, ORANGE = (46, 115, 51), (245, 245, 245), (170, 175, 180), (240, 130, 20)
PLACES = [(-0.75, 0.0, 0.0), (-2.0, 1.5, -0.8), (2.4, -1.2, 0.5)]


def turned(yaw: float, pitch: float):
    """Return the matrix of a camera that looks down by the pitch, then to the left by the yaw."""
    (a, b), (c, d) = (math.cos(yaw), math.sin(yaw)), (math.cos(pitch), math.sin(pitch))
    return np.array([[a, -b, 0], [b, a, 0], [0, 0, 1]]) @ [[c, 0, d], [0, 1, 0], [-d, 0, c]]


@cache
def drawn() -> NDArray[np.uint8]:
    """Return the floor from above, a pixel a centimeter: rows along x, columns along y."""
    size = np.round(100 * np.array((FIELD.length + 2 * FIELD.border, FIELD.width + 2 * FIELD.border)))
    floor = np.full((*size.astype(int), 3), GRASS, np.uint8)
    middle = size / 2
    for at, half in FIELD.lines():
        for x, y in itertools.product((1, -1), (1, -1)):
            begin, end = (
                np.round(middle + 100 * (np.multiply(at, (x, y)) + side * np.array(half))) for side in (-1, 1)
            )
            floor[int(begin[0]) : int(end[0]), int(begin[1]) : int(end[1])] = WHITE
    away = np.hypot(*np.meshgrid(*(np.arange(side) + 0.5 - side / 2 for side in size), indexing="ij"))
    floor[np.abs(away - 50 * FIELD.circle_diameter) < 50 * FIELD.line] = WHITE
    return floor


@cache
def drawn_with_net() -> NDArray[np.uint8]:
    """Return it with the net of a goal, as it looks from before the goal."""
    floor = drawn().copy()
    x, y = (np.array(floor.shape[:2]) / 2).astype(int)
    for row in range(x + 468, x + 510, 12):
        floor[row : row + 5, y - 75 : y + 75] = WHITE
    return floor


class Camera:
    """A camera at a pose of the robot; `lean` is by how much it looks down more than the robot knows."""

    def __init__(self, pose, *, yaw=0.0, pitch=0.25, lean=0.0, lines=True, posts=True, net=False, robots=()):
        self._known = turned(yaw, pitch)
        v, u = np.mgrid[:HEIGHT, :WIDTH]
        rays = self._rays(u.ravel(), v.ravel()) @ turned(yaw, pitch + lean).T
        x, y, heading = pose
        to_field = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
        pixels = np.full((len(rays), 3), SKY, np.uint8)
        below = np.flatnonzero(rays[:, 2] < -0.01)
        there = EYE[:2] + rays[below, :2] * (EYE[2] / -rays[below, 2])[:, None]
        floor = drawn_with_net() if net else drawn()
        cell = np.floor(100 * (there @ to_field.T + (x, y)) + np.array(floor.shape[:2]) / 2).astype(int)
        inside = ((cell >= 0) & (cell < floor.shape[:2])).all(axis=1)
        pixels[below[inside]] = floor[cell[inside, 0], cell[inside, 1]] if lines else GRASS
        for post in FIELD.posts if posts else ():
            way = (np.array(post) - (x, y)) @ to_field - EYE[:2]
            level = np.hypot(rays[:, 0], rays[:, 1])
            aside = np.abs(rays[:, 0] * way[1] - rays[:, 1] * way[0]) / level < POST_RADIUS
            up = EYE[2] + rays[:, 2] / level * np.hypot(*way)
            pixels[aside & (rays[:, :2] @ way > 0) & (up > 0) & (up < FIELD.goal_height)] = WHITE
        for robot in robots:
            way = (np.array(robot) - (x, y)) @ to_field - EYE[:2]
            level = np.hypot(rays[:, 0], rays[:, 1])
            up = EYE[2] + rays[:, 2] / level * np.hypot(*way)
            for side in (0.05, -0.05):
                leg = way + side * np.array((-way[1], way[0])) / np.hypot(*way)
                aside = np.abs(rays[:, 0] * leg[1] - rays[:, 1] * leg[0]) / level < 0.03
                seen = aside & (rays[:, :2] @ way > 0)
                pixels[seen & (up > 0) & (up < 0.5)] = WHITE
                pixels[seen & (up > 0.2) & (up < 0.3)] = ORANGE
        shape = SimpleNamespace(width=WIDTH, height=HEIGHT)
        self.image = SimpleNamespace(description=shape, pixelData=pixels.tobytes())

    @staticmethod
    def _rays(u, v):
        columns = ((WIDTH - 1) / 2 - u) / FOCAL, ((HEIGHT - 1) / 2 - v) / FOCAL
        return np.stack((np.ones_like(columns[0]), *columns), axis=-1)

    def floor_point(self, u, v, height):
        ray = self._known @ self._rays(u, v)
        way = (height - EYE[2]) / ray[2] if ray[2] else math.inf
        if way <= 0:
            return SimpleNamespace(x=math.inf, y=math.inf, distance=math.inf)
        return SimpleNamespace(x=EYE[0] + way * ray[0], y=way * ray[1], distance=way * math.hypot(*ray))


@lru_cache(64)  # of hundreds of pictures
def camera_at(pose, yaw, **how):
    return Camera(pose, yaw=yaw, **how)


def look(localizer: Localizer, pose, times=6, **how):
    """Let it see pictures of the field, to the left and to the right."""
    for number in range(times):
        camera = camera_at(pose, (0.0, 0.7, -0.7)[number % 3], **how)
        localizer.see(camera.image, camera.floor_point)


def error(pose: Pose, truth) -> tuple[float, float]:
    """Return how far an estimate is off, in m and rad."""
    turn = (pose.heading - truth[2] + math.pi) % math.tau - math.pi
    return math.dist(pose[:2], truth[:2]), abs(turn)


@pytest.mark.parametrize("truth", PLACES)
def test_pictures_correct_a_start_that_is_wrong(truth):
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


def test_it_says_where_others_stand():
    localizer = Localizer(FIELD, (-0.2, 0.1, 0.0))
    camera = Camera((-0.2, 0.1, 0.0), robots=ROBOTS)
    localizer.see(camera.image, camera.floor_point)
    places = np.add(localizer.feet, (-0.2, 0.1))
    for robot in ROBOTS:
        assert np.hypot(*(places - robot).T).min() < 0.08
    away = np.min([np.hypot(*(places - robot).T) for robot in ROBOTS], axis=0)
    assert np.mean(away < 0.15) > 0.7  # edges of legs seem farther away


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


def test_without_pictures_it_gets_less_sure():
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
def test_a_picture_that_shows_nothing_changes_nothing(how):
    localizer = Localizer(FIELD, PLACES[2])
    before = localizer.confidence
    camera = Camera((9.0, 9.0, 0.5) if "lines" in how else PLACES[2], **how)
    localizer.see(camera.image, camera.floor_point)
    assert localizer.pose == pytest.approx(PLACES[2])
    assert localizer.confidence <= before


def look_to_all_sides(localizer: Localizer, pose, **how):
    localizer.look_around()
    for yaw in (0.0, 0.9, 1.8, -0.9, -1.8):
        for pitch in (0.15, 0.75):  # as two cameras
            camera = camera_at(pose, yaw, pitch=pitch, **how)
            localizer.see(camera.image, camera.floor_point)


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
def test_pictures_before_a_walk_count_where_they_were_taken():
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


def test_pictures_that_show_too_little_find_no_place():
    localizer = Localizer(FIELD, PLACES[0])
    localizer.look_around()
    assert not localizer.find()
    look_to_all_sides(localizer, PLACES[0], lines=False, posts=False)
    assert not localizer.find()
    assert localizer.pose == pytest.approx(PLACES[0])
