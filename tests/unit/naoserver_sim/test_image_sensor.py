"""Pictures as a camera makes them: noise, blur, exposure and color casts, by seed and robot time alone."""

from contextlib import closing

import numpy as np
import pytest

from naoserver.bodies.nao import H25
from naoserver_sim._image_sensor import ImageSensor, PictureNoise
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import parse_world
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

REAL = PictureNoise()
PERFECT = PictureNoise(white=0.0, cast=0.0, drift=0.0)
STILL = np.zeros(3)
FOCAL = 299.0
"""Pixels, of a picture 320 wide."""


def sensor(noise=PERFECT, seed=1):
    return ImageSensor(noise, H25.cameras, seed, np.zeros(1))


def grey(value, size=(240, 320)):
    return np.full((*size, 3), value, np.uint8)


def developed(sensor, picture, time=0.0, *, turning=STILL, mean=118.0, camera="Camera"):
    return sensor.develop(picture, camera, time, np.array(turning), lambda _: mean).astype(np.int16)


@pytest.mark.parametrize("size", [(120, 160), (240, 320), (480, 640), (960, 1280)])
def test_noise_is_as_large_as_it_says_and_changes_no_mean(size):
    noisy = developed(sensor(PictureNoise(cast=0.0, drift=0.0)), grey(118, size))
    assert noisy.mean() == pytest.approx(118.0, abs=0.6)
    assert noisy.std() == pytest.approx(REAL.white, rel=0.1)


def test_a_dim_picture_is_brightened_with_its_noise():
    noisy = developed(sensor(PictureNoise(cast=0.0, drift=0.0)), grey(40), mean=40.0)
    assert noisy.mean() == pytest.approx(118.0, abs=3.0)
    assert noisy.std() == pytest.approx(REAL.white * 118 / 40, rel=0.1)


@pytest.mark.parametrize(("mean", "expected"), [(250.0, 100 * PERFECT.least_gain), (5.0, 255.0)])
def test_exposure_has_limits(mean, expected):
    assert developed(sensor(), grey(100), mean=mean).mean() == pytest.approx(expected, abs=2.0)


def test_exposure_follows_the_brightness_slowly():
    camera, values = sensor(), []
    for tick in range(5, 405, 5):
        camera.expose(tick / 100, np.array([60.0 if tick >= 200 else 118.0]))
        picture = camera.develop(grey(60), "Camera", tick / 100, STILL, lambda qpos: float(qpos[0] or 118.0))
        values.append(picture.mean())
    before, after = np.array(values[:39]), np.array(values[39:])
    assert before == pytest.approx(60.0, abs=1.5)
    assert (np.diff(after) >= 0).all()
    assert 65.0 < after[5] < 95.0  # a quarter of a second after the light was dimmed
    assert after[-1] == pytest.approx(118.0, abs=4.0)


def test_blur_spreads_a_point_without_moving_it():
    point = grey(0)
    point[120, 160] = 240
    seen = developed(sensor(), point)[..., 0]
    rows, columns = np.nonzero(seen > 10)
    assert len(rows) == 7
    assert (rows.mean(), columns.mean()) == (120, 160)
    assert seen[120, 160] == pytest.approx(60, abs=2)


@pytest.mark.parametrize(("turning", "across"), [((0.0, 2.0, 0.0), 1), ((2.0, 0.0, 0.0), 0)])
def test_a_camera_that_turns_smears_along_its_turn(turning, across):
    point = grey(0)
    point[120, 160] = 240
    seen = developed(sensor(), point, turning=turning)[..., 0]
    spread = [np.ptp(indices) for indices in np.nonzero(seen > 1)]
    assert spread[across] == pytest.approx(FOCAL * 2.0 * PERFECT.exposure + 2, abs=2)
    assert spread[1 - across] == 2


def test_edges_of_a_picture_are_not_mixed_with_the_opposite_ones():
    picture = grey(0)
    picture[:, :40] = 200
    for rate in (-3.0, 3.0):
        assert developed(sensor(), picture, turning=(0.0, rate, 0.0))[:, 60:].max() <= 2


def test_colors_drift_slowly_about_a_constant_cast():
    camera = sensor(PictureNoise(white=0.0))
    times = np.arange(0.0, 30.0, 0.5)
    colors = np.array([developed(camera, grey(118, (24, 32)), time).mean(axis=(0, 1)) for time in times])
    ratios = colors[:, [0, 2]] / colors[:, [1]]
    assert np.ptp(ratios, axis=0) == pytest.approx(2 * REAL.drift, abs=0.015)
    assert np.abs(np.diff(ratios, axis=0)).max() < 0.015
    assert ratios == pytest.approx(1.0, abs=0.1)


WORLD = '[[carried_balls]]\nname = "BallGreen"\ncolor = [0.0, 0.8, 0.0]\nstart = [0.0, 1.0, 0.5]\n'


def course(seed=3, *, noise=True, steps=(0.3, 0.3, 0.2), others=()):
    """Return the last pictures of both cameras and of the spectator of a robot that turns its head."""
    clock = VirtualClock()
    world = parse_world(WORLD, "w")
    with closing(SimulatedRobot(clock=clock, world=world, skin=False, noise=noise, seed=seed)) as robot:
        robot.command_velocities({"HeadYaw": 0.5})
        for step in steps:
            clock.advance(step)
            robot.read()
            for camera in others:
                robot.capture(camera, 320, 240)
        return [robot.capture(name, 320, 240).pixels for name in ("Camera", "CameraBottom", "CameraOutside")]


@pytest.fixture(scope="module")
def first():
    return course()


@pytest.mark.gl
def test_a_picture_depends_on_seed_and_time_and_not_on_who_else_looks(first):
    for same in (course(steps=(0.8,)), course(others=("Camera", "CameraBottom"))):
        assert all(np.array_equal(one, other) for one, other in zip(first, same, strict=True))
    other = course(seed=4)
    assert (first[0] != other[0]).mean() > 0.5


@pytest.mark.gl
def test_noise_is_in_the_robots_pictures_and_not_in_the_spectators(first):
    exact = course(noise=False)
    spreads = [
        [picture[:10, :40].std(axis=(0, 1)).mean() for picture in pictures] for pictures in (first, exact)
    ]
    more = [noisy - plain for noisy, plain in zip(*spreads, strict=True)]  # in a corner without edges
    assert min(more[:2]) > 1.0
    assert more[2] == pytest.approx(0.0, abs=0.1)


def test_noise_is_another_in_each_picture_and_each_camera():
    camera = sensor(REAL)
    first = developed(camera, grey(118))
    for other in (developed(camera, grey(118), 0.01), developed(camera, grey(118), camera="CameraBottom")):
        alike = np.corrcoef(first[..., 1].ravel(), other[..., 1].ravel())[0, 1]
        assert abs(alike) < 0.05


def test_a_picture_that_is_drawn_late_is_exposed_as_at_its_time():
    late, timely = sensor(), sensor()
    late.expose(0.25, np.array([60.0]))
    pictures = [
        each.develop(grey(60), "Camera", 0.2, STILL, lambda qpos: float(qpos[0] or 118.0))
        for each in (late, timely)
    ]
    assert np.array_equal(*pictures)


def ball_of(robot, clock, seconds):
    """Move the ball for some seconds; return the last pictures of all cameras, and its column in the first."""
    (ball,) = robot.mechanisms
    ball.command_velocities({ball.joints[0].name: 1.0})
    clock.advance(seconds)
    frames = [robot.capture(name, 320, 240) for name in ("Camera", "CameraBottom", "CameraOutside")]
    pixels = frames[0].pixels.astype(int)
    return frames, np.flatnonzero((pixels[..., 1] - pixels[..., 0] > 60).any(axis=0)).mean()


@pytest.mark.gl
def test_a_robots_picture_is_60_to_100_ms_old_and_shows_what_was_then():
    clock, other = VirtualClock(), VirtualClock()
    world = parse_world(WORLD, "w")
    with closing(SimulatedRobot(clock=clock, world=world, skin=False, noise=True, seed=3)) as robot:
        assert robot.capture("Camera", 320, 240).time == 0.0  # the first of all
        frames, column = ball_of(robot, clock, 0.3)
    ages = [clock.now() - frame.time for frame in frames]
    assert ages[2] == 0.0
    assert 0.055 < ages[0] < 0.105
    assert 0.055 < ages[1] < 0.105
    assert ages[0] != ages[1]
    with closing(SimulatedRobot(clock=other, world=world, skin=False, seed=3)) as exact:
        _, then = ball_of(exact, other, frames[0].time)
        _, now = ball_of(exact, other, 0.3 - frames[0].time)
    assert column == pytest.approx(then, abs=0.3 * abs(now - then))


def test_the_latency_of_a_camera_is_its_own_and_the_seeds():
    ages = [[sensor(REAL, seed).latency(camera.name) for camera in H25.cameras] for seed in range(20)]
    assert ages == [[sensor(REAL, seed).latency(camera.name) for camera in H25.cameras] for seed in range(20)]
    assert 0.06 <= np.min(ages) < 0.065
    assert 0.095 < np.max(ages) <= 0.1
    assert len({age for pair in ages for age in pair}) == 40
