"""The server around a robot: what it serves, when images are taken, how it ends."""

import io
import threading

import pytest
from PIL import Image

from interfaces.jderobot import CameraPrx, Pose3DMotorsPrx
from interfaces.nao import HealthPrx, PoseHeadPrx
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.options import CameraOptions, ServerOptions
from naoserver.serving.server import serve
from tests.support.limits import EVENT_LIMIT, START_LIMIT
from tests.support.robot_server import eventually, served_to_client, wait_for
from zenoh_ice import ZenohIceError, initialize


class CountingRobot(FakeRobot):
    """A fake robot that counts the images it takes."""

    def __init__(self, **options):
        super().__init__(**options)
        self.taken = []
        self.took = threading.Condition()

    def capture(self, camera, width, height):
        with self.took:
            self.taken.append(camera)
            self.took.notify_all()
        return super().capture(camera, width, height)

    def wait_taken(self, count):
        with self.took:
            assert self.took.wait_for(lambda: len(self.taken) >= count, EVENT_LIMIT), self.taken


@pytest.fixture
def robot():
    return CountingRobot()


@pytest.fixture
def nao(robot):
    with served_to_client(robot) as nao:
        yield nao


def test_no_image_is_taken_for_nobody_and_only_of_the_camera_asked_for(robot, nao):
    wait_for(nao.proxy(PoseHeadPrx, "Head").getPose, lambda _: True)
    assert robot.taken == []
    nao.proxy(CameraPrx, "CameraBottom").getImageData("RGB8")
    assert robot.taken == ["CameraBottom"]


def test_calls_within_a_period_get_the_same_image(robot, nao):
    camera = nao.proxy(CameraPrx, "Camera")
    description = camera.getCameraDescription()
    description.rate = 0.01
    camera.setCameraDescription(description)
    stamps = {
        (image.timeStamp.seconds, image.timeStamp.useconds)
        for image in (camera.getImageData(name) for name in ("RGB8", "GRAY8", "BGR8"))
    }
    assert len(stamps) == 1
    assert robot.taken == ["Camera"]


def test_a_new_size_is_not_served_from_the_old_image(robot, nao):
    camera = nao.proxy(CameraPrx, "Camera")
    description = camera.getCameraDescription()
    description.rate = 0.01
    camera.setCameraDescription(description)
    camera.getImageData("RGB8")
    description.width, description.height = 640, 480
    camera.setCameraDescription(description)
    assert camera.getImageData("RGB8").description.width == 640


def test_the_stream_ends_with_its_last_listener(robot, nao):
    camera = nao.proxy(CameraPrx, "Camera")
    with nao.client() as listener:
        listener.proxy(CameraPrx, "Camera").getImageData.wait(timeout=START_LIMIT)
        assert camera.getCameraDescription().streamingUri == f"{nao.realm}/Camera/getImageData"
        assert nao.proxy(HealthPrx, "Health").getHealth().cameraRates["Camera"] > 0.0
    eventually(lambda: camera.getCameraDescription().streamingUri == "")


def test_streaming_without_listeners_is_started_and_stopped(robot, nao):
    camera = nao.proxy(CameraPrx, "Camera")
    assert camera.startCameraStreaming() == f"{nao.realm}/Camera/getImageData"
    robot.wait_taken(4)
    camera.stopCameraStreaming()
    assert camera.getCameraDescription().streamingUri == ""


def test_streaming_goes_on_until_the_last_client_that_started_it_has_stopped_it_or_is_gone(nao):
    camera = nao.proxy(CameraPrx, "Camera")
    with nao.client() as first, nao.client() as second:
        for client in (first, second):
            client.proxy(CameraPrx, "Camera").startCameraStreaming()
        camera.stopCameraStreaming()  # it has started none
        first.proxy(CameraPrx, "Camera").stopCameraStreaming()
        assert camera.getCameraDescription().streamingUri
    eventually(lambda: not camera.getCameraDescription().streamingUri)


def test_formats_hold_the_same_picture(nao):
    camera = nao.proxy(CameraPrx, "Camera")
    description = camera.getCameraDescription()
    description.rate = 0.01
    camera.setCameraDescription(description)
    rgb, bgr, gray = (camera.getImageData(name).pixelData for name in ("RGB8", "BGR8", "GRAY8"))
    assert (rgb[0::3], rgb[1::3], rgb[2::3]) == (bgr[2::3], bgr[1::3], bgr[0::3])
    expected = [
        0.299 * r + 0.587 * g + 0.114 * b for r, g, b in zip(rgb[0::3], rgb[1::3], rgb[2::3], strict=True)
    ]
    assert max(abs(a - b) for a, b in zip(gray, expected, strict=True)) < 2.0


def test_a_picture_is_given_as_jpeg_on_demand(nao):
    camera = nao.proxy(CameraPrx, "Camera")
    assert {"RGB8", "BGR8", "GRAY8", "YUV422", "JPEG"} == set(camera.getImageFormat())
    image = camera.getImageData("JPEG")
    assert image.description.size == len(image.pixelData)
    with Image.open(io.BytesIO(image.pixelData)) as picture:
        assert picture.size == (image.description.width, image.description.height)


def test_closing_stops_the_motion_and_takes_the_servants_away(robot):
    with served_to_client(robot) as nao:
        neck = nao.proxy(Pose3DMotorsPrx, "NeckMotors")
        data = neck.getPose3DMotorsData()
        data.pan, data.panSpeed = 2.0, 0.5
        neck.setPose3DMotorsData(data)
        eventually(lambda: robot.read().commands[0] > 0.1)
        nao.serving.close()
        there = robot.read().commands[0]
        with pytest.raises(ZenohIceError):
            nao.proxy(PoseHeadPrx, "Head").getPose()
        assert robot.read().commands[0] == there < 2.0


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (ServerOptions(cameras={"CameraBack": CameraOptions()}), "'CameraBack'.*CameraBottom"),
        (ServerOptions(cameras={"Camera": CameraOptions(width=321)}), "321x240"),
        (ServerOptions(cameras={"Camera": CameraOptions(rate=99.0)}), "99 images/s"),
    ],
)
def test_options_that_the_robot_cannot_meet_are_refused_before_anything_starts(robot, options, reason):
    with initialize(
        realm="test-options", listen=["tcp/127.0.0.1:0"], connect=[], clock="wall"
    ) as communicator:
        adapter = communicator.createObjectAdapter("Robot")
        with pytest.raises(RobotError, match=reason), serve(robot, adapter, options):
            pass
        assert adapter.find("Head") is None
        assert adapter.removeAll(["Head"]) == {}


def test_options_of_one_camera_are_its_own(robot):
    options = ServerOptions(cameras={"CameraBottom": CameraOptions(width=640, height=480, rate=5.0)})
    with served_to_client(robot, options) as nao:
        assert nao.proxy(CameraPrx, "CameraBottom").getImageDescription().width == 640
        assert nao.proxy(CameraPrx, "Camera").getImageDescription().width == 320
