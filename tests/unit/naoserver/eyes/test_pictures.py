"""Pictures that are seen once, and cameras that fail."""

from naoserver.errors import HardwareFailure
from naoserver.eyes._pictures import PictureEyes
from naoserver.eyes.looks import read_looks
from naoserver.fake import FakeRobot
from tests.support.local_camera import local_cameras
from zenoh_ice import VirtualClock


def eyes_of(robot):
    return PictureEyes(local_cameras(robot), read_looks())


def of(reading, kind):
    return [thing for thing in reading.things if (thing.kind, thing.camera) == (kind, "Camera")]


def test_a_picture_is_looked_at_once():
    robot = FakeRobot(VirtualClock())
    eyes = eyes_of(robot)
    assert eyes.look() is eyes.look()


def test_a_camera_that_fails_shows_nothing_until_it_works(caplog):
    class Fails(FakeRobot):
        failing = False

        def capture(self, camera, width, height):
            if self.failing and camera == "Camera":
                raise HardwareFailure("its cable is loose")
            return super().capture(camera, width, height)

    clock = VirtualClock()
    robot = Fails(clock)
    eyes = eyes_of(robot)
    assert of(eyes.look(), "ball")
    robot.failing = True
    clock.advance(0.2)
    eyes.look()
    clock.advance(0.2)
    reading = eyes.look()
    assert not of(reading, "ball")
    assert [record.message for record in caplog.records].count(
        "Camera shows nothing: its cable is loose"
    ) == 1
