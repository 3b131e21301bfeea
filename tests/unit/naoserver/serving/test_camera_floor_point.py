"""What a pixel shows on the floor, against the simulation's truth."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from interfaces.jderobot import ConfigurationNotExistException, InvalidValueException
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.protocol.jobs import is_due
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim


class Scene:
    """A robot that stands somewhere on the floor, leans, and looks aside."""

    def __init__(self):
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(clock=self.clock, skin=False)
        self.cameras: dict[str, Any] = dict(Assembly(self.robot, ServerOptions(), self.clock).servants)
        self.robot.start()
        self.robot.stage.place_robot(0.3, -0.2, 0.7)
        self.robot.command_positions(
            {"HeadYaw": 0.5, "HeadPitch": 0.3, "LHipPitch": -0.55, "RHipPitch": -0.55},
            dict.fromkeys(("HeadYaw", "HeadPitch", "LHipPitch", "RHipPitch"), 0.5),
        )
        self.clock.advance(3.0)

    def pixel(self, camera, x, y, height):
        """Return the pixel that shows a point of the robot's frame, and how far that is from the camera."""
        torso = self.robot.stage.truth().torso
        cos, sin = math.cos(torso.heading), math.sin(torso.heading)
        point = (
            torso.position[0] + cos * x - sin * y,
            torso.position[1] + sin * x + cos * y,
            height,
        )
        place, axes = self.robot.camera_pose(camera)
        right, up, back = (np.array(point) - place) @ axes
        view = self.cameras[camera].getCameraDescription(None)
        pixel = view.u0 - view.fdistx * right / back, view.v0 + view.fdisty * up / back
        return pixel, math.hypot(right, up, back)


@pytest.fixture(scope="module")
def scene():
    scene = Scene()
    yield scene
    scene.robot.close()


@pytest.mark.parametrize("camera", ["Camera", "CameraBottom"])
@pytest.mark.parametrize("point", [(0.5, 0.3, 0.0), (1.2, 0.6, 0.0), (0.8, 0.2, 0.06), (2.5, 1.5, 0.0)])
def test_a_pixel_is_where_it_shows_the_floor_in_the_robots_frame(scene, camera, point):
    pixel, distance = scene.pixel(camera, *point)
    found = scene.cameras[camera].getFloorPoint(*pixel, point[2], None)
    assert (found.x, found.y) == pytest.approx(point[:2], rel=0.03)
    assert found.distance == pytest.approx(distance, rel=0.03)


def test_a_pixel_above_the_horizon_shows_no_floor(scene):
    found = scene.cameras["Camera"].getFloorPoint(160.0, -400.0, 0.0, None)
    assert (found.x, found.y, found.distance) == (math.inf, math.inf, math.inf)


def test_a_pixel_is_a_finite_number(scene):
    with pytest.raises(InvalidValueException, match="u is nan"):
        scene.cameras["Camera"].getFloorPoint(math.nan, 0.0, 0.0, None)


def test_a_camera_beside_the_robot_does_not_move_with_it(scene):
    with pytest.raises(ConfigurationNotExistException, match="CameraOutside is not on the robot"):
        scene.cameras["CameraOutside"].getFloorPoint(0.0, 0.0, 0.0, None)


class SlowCamera(FakeRobot):
    """Takes its pictures in the middle of 0.2 s."""

    def __init__(self, clock):
        super().__init__(clock)
        self.time = clock
        self.yaw = 0.0

    def capture(self, camera, width, height):
        self.time.advance(0.1)
        frame = super().capture(camera, width, height)
        self.yaw = self.read().positions[0]
        self.time.advance(0.1)
        return frame


def test_it_is_where_the_picture_showed_it_although_the_head_turns():
    clock = VirtualClock()
    robot = SlowCamera(clock)
    camera: Any = Assembly(robot, ServerOptions(), clock).servants["CameraBottom"]
    robot.command_velocities({"HeadYaw": 1.0})
    clock.advance(0.3)
    view = camera.getCameraDescription(None)
    camera.getImageData("GRAY8", None)
    point = camera.getFloorPoint(view.u0, view.v0, 0.0, None)
    assert robot.yaw > 0.2
    assert math.atan2(point.y, point.x) == pytest.approx(robot.yaw, abs=0.01)


def test_it_is_of_the_newest_image_whatever_size_the_next_one_has():
    clock = VirtualClock()
    camera: Any = Assembly(FakeRobot(clock), ServerOptions(), clock).servants["CameraBottom"]
    image = camera.getImageData("GRAY8", None).description
    before = camera.getFloorPoint(160.0, 220.0, 0.0, None)
    other = camera.getCameraDescription(None)
    other.width, other.height, other.rate = 640, 480, 5.0
    camera.setCameraDescription(other, None)
    assert (image.width, camera.getFloorPoint(160.0, 220.0, 0.0, None)) == (320, before)
    camera.getImageData("GRAY8", None)
    after = camera.getFloorPoint(2 * 160.0 + 0.5, 2 * 220.0 + 0.5, 0.0, None)
    assert (after.x, after.y) == pytest.approx((before.x, before.y))


def test_a_reset_by_one_client_ends_nobody_elses_streaming():
    clock = VirtualClock()
    camera: Any = Assembly(FakeRobot(clock), ServerOptions(), clock).servants["CameraBottom"]
    one, other = (
        SimpleNamespace(client=client, identity="CameraBottom", communicator=SimpleNamespace(realm="nao"))
        for client in ("one", "other")
    )
    camera.startCameraStreaming(one)
    camera.startCameraStreaming(other)
    camera.reset(one)
    assert camera.wanted
    camera.reset(other)
    assert not camera.wanted


class LateCamera(FakeRobot):
    """Delivers its pictures 80 ms late."""

    def capture(self, camera, width, height):
        frame = super().capture(camera, width, height)
        return replace(frame, time=frame.time - 0.08)


def test_it_is_where_a_late_picture_showed_it_however_the_head_has_turned_since():
    clock = VirtualClock()
    robot = LateCamera(clock)
    woken = []
    assembly = Assembly(robot, ServerOptions(), clock)
    assembly.on_wake = lambda: woken.append(clock.now())
    camera: Any = assembly.servants["CameraBottom"]
    job = next(job for job in assembly.jobs if job.name == "places of the body")
    assert not is_due(job, clock.now())
    robot.command_velocities({"HeadYaw": 1.0})
    camera.getImageData("GRAY8", None)
    assert woken == [0.0]
    yaws = {}
    for tick in range(1, 43):
        clock.advance(0.01)
        yaws[tick] = robot.read().positions[0]
        if tick == 25:
            robot.command_velocities({"HeadYaw": -3.0})
        if is_due(job, clock.now()):
            job.run()
        if tick in (20, 31, 42):
            camera.getImageData("GRAY8", None)
            view = camera.getCameraDescription(None)
            point = camera.getFloorPoint(view.u0, view.v0, 0.0, None)
            assert math.atan2(point.y, point.x) == pytest.approx(yaws[tick - 8], abs=0.01)
    clock.advance(5.0)
    assert not is_due(job, clock.now())


def test_an_image_is_as_fresh_as_its_arrival_and_not_as_its_exposure():
    clock = VirtualClock()
    robot = LateCamera(clock)
    camera: Any = Assembly(robot, ServerOptions(), clock).servants["CameraBottom"]
    period = 1.0 / camera.getCameraDescription(None).rate
    clock.advance(1.0)
    first = camera.getImageData("GRAY8", None).timeStamp
    clock.advance(0.8 * period)
    assert camera.getImageData("GRAY8", None).timeStamp == first
    clock.advance(0.4 * period)
    assert camera.getImageData("GRAY8", None).timeStamp != first
