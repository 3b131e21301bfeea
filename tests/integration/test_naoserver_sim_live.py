"""The simulated robot with its threads and its cameras."""

import colorsys
import math
import threading
from contextlib import closing

import numpy as np
import pytest

from naoserver.errors import HardwareFailure
from naoserver_sim.robot import SimulatedRobot
from tests.support.camera_limits import PATIENT_CAMERAS
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

FOCAL = 160 / math.tan(math.radians(56.3 / 2))
"""Focal length of the head's cameras at 320 x 240 in pixels."""


@pytest.fixture
def running():
    robot = SimulatedRobot(speed=5.0, skin=False, camera_limits=PATIENT_CAMERAS)
    robot.start()
    yield robot
    robot.close()


@pytest.fixture(scope="module")
def clock():
    return VirtualClock()


@pytest.fixture(scope="module")
def robot(clock):
    """A robot whose time stands still, so that its images do."""
    robot = SimulatedRobot(clock=clock)
    robot.capture("Camera", 320, 240)  # starts the thread that the module's tests share
    yield robot
    robot.close()


def ball_pixels(pixels, red, green):
    """Return the rows and columns of the pixels of a saturated color."""
    r, g, b = (pixels[:, :, channel].astype(int) for channel in range(3))
    strong, weak = (r, g) if red else (g, r)
    assert red != green
    return np.nonzero((strong > 60) & (strong > 3 * weak) & (strong > 3 * b))


class TestTime:
    def test_physics_runs_by_itself_and_ends_with_close(self, running):
        until(lambda: running.clock.now() > 1.0)
        running.close()
        last = running.read()
        assert not [thread for thread in threading.enumerate() if thread.name in {"physics", "cameras"}]
        assert running.read() == last

    def test_clock_sleeps_by_simulated_time(self):
        slow = SimulatedRobot(speed=0.2, skin=False)
        slow.start()
        try:
            begin = slow.clock.now()
            slow.clock.sleep(0.1)
            assert slow.clock.now() - begin >= 0.1  # five times as long by the wall's clock
            assert slow.clock.simulated
        finally:
            slow.close()

    def test_clock_waits_for_an_event_by_simulated_time(self, running):
        event = threading.Event()
        assert not running.clock.wait(event, 0.2)
        event.set()
        assert running.clock.wait(event, 0.2)

    def test_a_clock_that_stands_still_keeps_nobody(self, running):
        running.close()
        running.clock.sleep(1000.0)
        assert running.clock.rate == 0.0

    def test_commands_from_several_threads_all_arrive(self, running):
        joints = ["HeadYaw", "LShoulderPitch", "RShoulderPitch", "LWristYaw"]
        threads = [
            threading.Thread(target=running.command_positions, args=({name: 0.3}, {name: 5.0}))
            for name in joints
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        places = [[joint.name for joint in running.joints].index(name) for name in joints]
        until(lambda: all(abs(running.read().commands[place] - 0.3) < 1e-9 for place in places))


@pytest.mark.gl
class TestCameras:
    @pytest.mark.parametrize("camera", ["Camera", "CameraBottom", "CameraOutside"])
    def test_image_has_its_size_and_something_on_it(self, robot, camera):
        facts = {facts.name: facts for facts in robot.cameras}[camera]
        for width, height in facts.sizes:
            frame = robot.capture(camera, width, height)
            assert frame.pixels.shape == (height, width, 3)
            assert frame.pixels.dtype == np.uint8
            assert frame.pixels.flags.c_contiguous
            assert frame.pixels.std() > 2

    def test_image_bears_the_robot_time(self, robot, clock):
        clock.advance(0.1)
        assert robot.capture("Camera", 320, 240).time == pytest.approx(robot.read().time)

    @pytest.mark.parametrize(("name", "red"), [("BallRed", True), ("BallGreen", False)])
    def test_ball_is_seen_where_it_is(self, robot, clock, name, red):
        ball = next(ball for ball in robot.mechanisms if ball.name == name)
        pan, distance = (-0.2 if red else 0.2), 1.0
        targets = dict(zip((joint.name for joint in ball.joints), (pan, distance, 0.5), strict=True))
        ball.command_positions(targets, dict.fromkeys(targets, 2.0))
        clock.advance(3.0)
        rows, columns = ball_pixels(robot.capture("Camera", 320, 240).pixels, red=red, green=not red)
        # The camera stands 0.09 m before the robot's axis and 2 mm above the ball, and leans with the torso.
        depth, left = distance * math.cos(pan) - 0.09, distance * math.sin(pan)
        assert columns.mean() == pytest.approx(159.5 - FOCAL * left / depth, abs=4)
        assert rows.mean() == pytest.approx(119.5 - FOCAL * math.tan(math.radians(7.5)), abs=8)
        assert len(rows) == pytest.approx(math.pi * (FOCAL * 0.06 / depth) ** 2, rel=0.2)

    @pytest.mark.parametrize(("name", "hue"), [("BallRed", 0), ("BallGreen", 120)])
    @pytest.mark.parametrize("distance", [0.7, 1.2])
    def test_ball_has_a_clean_saturated_color(self, robot, clock, name, hue, distance):
        ball = next(ball for ball in robot.mechanisms if ball.name == name)
        targets = dict(zip((joint.name for joint in ball.joints), (0.0, distance, 0.5), strict=True))
        away = next(ball for ball in robot.mechanisms if ball.name != name)
        aside = {away.joints[0].name: 1.5}
        ball.command_positions(targets, dict.fromkeys(targets, 2.0))
        away.command_positions(aside, dict.fromkeys(aside, 2.0))
        clock.advance(3.0)
        pixels = robot.capture("Camera", 320, 240).pixels
        rows, columns = ball_pixels(pixels, red=hue == 0, green=hue == 120)
        colors = [colorsys.rgb_to_hsv(*(pixels[r, c] / 255)) for r, c in zip(rows, columns, strict=True)]
        hues = [(color[0] * 360 - hue + 180) % 360 - 180 for color in colors]
        assert max(map(abs, hues)) < 10
        assert np.median([color[1] for color in colors]) > 0.9
        assert min(color[2] for color in colors) > 0.25

    def test_turning_the_head_left_moves_the_ball_to_the_right(self, robot, clock):
        def column():
            return ball_pixels(robot.capture("Camera", 320, 240).pixels, red=True, green=False)[1].mean()

        red, green = robot.mechanisms
        for ball, pan in ((red, 0.0), (green, 1.5)):
            targets = dict(zip((joint.name for joint in ball.joints), (pan, 1.0, 0.5), strict=True))
            ball.command_positions(targets, dict.fromkeys(targets, 2.0))
        clock.advance(2.0)
        before = column()
        robot.command_positions({"HeadYaw": 0.3}, {"HeadYaw": 1.0})
        clock.advance(1.0)
        assert column() > before + 60

    @pytest.mark.parametrize(
        ("camera", "size", "message"),
        [("Tail", (320, 240), "there is no camera 'Tail'"), ("Camera", (321, 240), "320x240")],
    )
    def test_what_it_cannot_take_is_refused(self, robot, camera, size, message):
        with pytest.raises(HardwareFailure, match=message):
            robot.capture(camera, *size)

    def test_two_threads_take_images_of_a_running_robot(self, running):
        frames = {}

        def take(camera):
            frames[camera] = [running.capture(camera, 320, 240) for _ in range(10)]

        threads = [threading.Thread(target=take, args=(name,)) for name in ("Camera", "CameraBottom")]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(EVENT_LIMIT)
        for camera in ("Camera", "CameraBottom"):
            times = [frame.time for frame in frames[camera]]
            assert times == sorted(times)
            assert {frame.camera for frame in frames[camera]} == {camera}


@pytest.mark.gl
def test_gl_is_set_up_for_the_first_image_and_not_before():
    before = set(threading.enumerate())

    def started():
        return sorted(thread.name for thread in threading.enumerate() if thread not in before)

    with closing(SimulatedRobot(skin=False, camera_limits=PATIENT_CAMERAS)) as robot:
        robot.start()
        assert started() == ["physics"]
        robot.capture("Camera", 320, 240)
        assert started() == ["cameras", "physics"]


class TestWithoutGL:
    def test_everything_but_the_cameras_works(self, monkeypatch, caplog):
        monkeypatch.setenv("MUJOCO_GL", "disable")
        robot = SimulatedRobot(speed=5.0, skin=False)
        robot.start()
        try:
            assert "the cameras are off: rendering is switched off by MUJOCO_GL=disable" in caplog.text
            until(lambda: robot.clock.now() > 0.2)
            for _ in range(2):
                with pytest.raises(HardwareFailure, match="MUJOCO_GL=disable: unset it"):
                    robot.capture("Camera", 320, 240)
            robot.command_positions({"HeadYaw": 0.3}, {"HeadYaw": 5.0})
            until(lambda: robot.read().positions[0] > 0.25)
        finally:
            robot.close()
