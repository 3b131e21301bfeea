"""The stream of a camera's images."""

from typing import Any

from msgspec.structs import replace

from interfaces.jderobot import CameraPrx
from naoserver.bodies.nao import H25
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from zenoh_ice import Communicator, Settings, VirtualClock
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.pool import Pool


def test_listeners_get_each_image_once_however_often_it_is_taken():
    clock = VirtualClock()
    camera: Any = Assembly(FakeRobot(clock), ServerOptions(), clock).servants["CameraBottom"]
    with Communicator(Settings(clock="wall"), pool=Pool(2, "test"), transport=InProcessTransport) as here:
        adapter = here.createObjectAdapter("Test")
        adapter.add(camera, "CameraBottom")
        adapter.activate()
        images = CameraPrx.uncheckedCast(here.stringToProxy("CameraBottom")).getImageData
        assert images.latest() is None
        first, times = 0, []
        for pause in (0.1, 0.0, 0.0, 0.1):
            clock.advance(pause)
            assert camera.publish()
            sample = images.wait()
            first = first or sample.sequence
            times.append((sample.sequence - first, sample.time))
    assert times == [(0, 0.1), (0, 0.1), (0, 0.1), (1, 0.2)]


def test_a_camera_without_the_usual_size_or_rate_starts_with_its_first():
    slow = replace(H25.cameras[0], rates=(2.0,) * len(H25.cameras[0].sizes))
    small = replace(H25.cameras[1], sizes=((64, 48),), rates=(30.0,))
    clock = VirtualClock()
    robot = FakeRobot(clock, body=replace(H25, cameras=(slow, small)))
    servants: dict[str, Any] = dict(Assembly(robot, ServerOptions(), clock).servants)
    of = [servants[facts.name].getImageDescription(None) for facts in (slow, small)]
    first = slow.sizes[0]
    assert [(each.width, each.height) for each in of] == [first, (64, 48)]
