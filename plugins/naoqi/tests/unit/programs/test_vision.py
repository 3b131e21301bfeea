"""What NAOqi's detectors see in pictures, and the events that they raise."""

import math

import numpy as np
import pytest

pytest.importorskip("qi")
pytest.importorskip("cv2")

from naoserver.errors import InvalidCommand
from naoserver.fake.robot import RADIUS
from naoserver.options import ServerOptions
from naoserver.robot import Frame
from naoserver_sim._surroundings import draw_face, draw_landmark
from plugins.naoqi.tests.support.rig import Rig
from visualhfsm_naoqi.programs._memory import ALMemory
from visualhfsm_naoqi.programs._vision import (
    ALColorBlobDetection,
    ALFaceDetection,
    ALRedBallDetection,
    find_blob,
    find_faces,
    find_landmarks,
)


def picture(drawn=None, left=0, top=0):
    """Return a grey picture of 320x240, with another drawn into it."""
    pixels = np.full((240, 320, 3), 120, np.uint8)
    if drawn is not None:
        height, width = drawn.shape[:2]
        pixels[top : top + height, left : left + width] = drawn
    return pixels


def disc(color, radius):
    size = 2 * radius + 1
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    drawn = np.full((size, size, 3), 120, np.uint8)
    drawn[x * x + y * y <= radius * radius] = color
    return drawn


def test_the_largest_blob_of_a_color_is_seen():
    pixels = picture(disc((20, 60, 200), 8), 20, 20)
    pixels[100:160, 200:280] = (30, 70, 190)
    assert find_blob(pixels, (25, 65, 195), 20) == pytest.approx((240, 130, 80, 60))
    assert find_blob(pixels, (200, 65, 195), 20) is None


@pytest.mark.parametrize("number", [0, 68, 249])
def test_the_number_of_a_landmark_is_read(number):
    small = draw_landmark(number)[::2, ::2]
    ((read, region),) = find_landmarks(picture(small, 60, 90))
    assert read == number
    assert region[:2] == pytest.approx((92, 122), abs=0.1)
    assert region[2:] == pytest.approx((48, 48), abs=0.4)


def test_a_face_has_two_eyes():
    face = draw_face()[::2, ::2]
    (region,) = find_faces(picture(face, 200, 100))
    assert region == pytest.approx((232, 135, 34, 52), abs=6)
    blind = face.copy()
    blind[25:34, 18:46] = (224, 172, 140)
    assert find_faces(picture(blind, 200, 100)) == []


def test_nothing_is_seen_where_nothing_is():
    assert find_landmarks(picture()) == []
    assert find_faces(picture()) == []


def test_a_ball_is_reported_as_angles(rig, memory):
    detector = rig.access.service(ALRedBallDetection)
    detector.subscribe("test")
    assert memory.getData("redBallDetected") == []
    detector._look()
    stamp, (left, down, width, height), torso, _, camera = memory.getData("redBallDetected")
    assert left == pytest.approx(-0.15, abs=0.03)
    assert down == pytest.approx(0.0, abs=0.3)
    assert width == pytest.approx(2 * math.atan(0.06), rel=0.25)
    assert (len(stamp), len(torso), height > 0.0, camera) == (2, 6, True, 0)


def test_a_ball_is_where_sight_says_as_large_as_its_distance_lets_it_look(rig, memory):
    detector = rig.access.service(ALRedBallDetection)
    detector.subscribe("test")
    rig.advance(0.5)
    detector._look()
    stamp, (left, down, width, height), *_ = memory.getData("redBallDetected")
    ball = next(thing for thing in rig.robot.eyes.look().things if thing.name == "red")
    assert stamp == [0, 500_000]
    assert (left, down, width) == pytest.approx((ball.left, ball.down, 2 * math.atan(0.06 / ball.distance)))
    assert height == width


def test_a_robot_that_serves_no_sight_sees_the_ball_in_its_pictures(sightless):
    detector = sightless.access.service(ALRedBallDetection)
    detector.subscribe("test")
    detector._look()
    _, (left, down, width, _), *_ = sightless.access.service(ALMemory).getData("redBallDetected")
    ball = next(thing for thing in sightless.robot.eyes.look().things if thing.name == "red")
    assert (left, down) == pytest.approx((ball.left, ball.down), abs=0.005)
    assert width == pytest.approx(2 * math.atan(RADIUS / ball.distance), rel=0.05)


def test_what_is_gone_is_reported_once(rig, memory):
    detector = rig.access.service(ALRedBallDetection)
    detector.subscribe("test")
    detector._look()
    rig.complete(rig.motion.angleInterpolation, "HeadYaw", 1.5, 1.0, True)
    detector._look()
    assert memory.getData("redBallDetected") == []


def test_it_looks_while_there_are_subscribers(rig):
    detector = rig.access.service(ALFaceDetection)
    assert not detector._wanted()
    detector.subscribe("test", 500, 0.0)
    assert detector._wanted()
    assert detector.getSubscribersInfo() == [["test", 500, 0.0]]
    detector.unsubscribe("test")
    assert not detector._wanted()
    with pytest.raises(InvalidCommand, match="'test' has not subscribed"):
        detector.unsubscribe("test")


def test_the_color_of_a_blob_is_chosen(rig, memory):
    detector = rig.access.service(ALColorBlobDetection)
    detector.setColor(30, 200, 40, 60)
    assert detector.getColor() == [30, 200, 40, 60]
    detector.subscribe("test")
    detector._look()
    assert memory.getData(detector.KEY)[1][0] == pytest.approx(0.15, abs=0.03)
    with pytest.raises(InvalidCommand, match="green is 300"):
        detector.setColor(30, 300, 40, 60)


@pytest.fixture
def sightless():
    """A fake robot that serves no Sight."""
    rig = Rig(options=ServerOptions(sight=False))
    yield rig
    rig.close()


@pytest.fixture
def show(rig, monkeypatch):
    """Let the cameras of a robot see a picture, at first a face."""
    shown = {}

    def see(pixels):
        shown["pixels"] = pixels

    def capture(name, width, height):
        return Frame(name, rig.clock.now(), width, height, shown["pixels"])

    monkeypatch.setattr(rig.robot, "capture", capture)
    see(picture(draw_face()[::2, ::2], 200, 100))
    return see


def names_seen(detector, memory):
    """Return the name of each face in the newest picture, and what is new about people."""
    detector._look()
    *faces, news = memory.getData("FaceDetected")[1]
    return [name for _, (_, _, name) in faces], news


def test_a_learned_face_has_a_name_which_is_told_again_when_nobody_was_there_for_a_while(rig, memory, show):
    faces = rig.access.service(ALFaceDetection)
    assert names_seen(faces, memory) == ([""], [])
    rig.complete(faces.learnFace, "Ada")
    assert names_seen(faces, memory) == (["Ada"], [2, ["Ada"]])
    assert names_seen(faces, memory) == (["Ada"], [])
    show(picture())
    faces._look()
    rig.advance(5.0)
    show(picture(draw_face()[::2, ::2], 200, 100))
    assert names_seen(faces, memory) == (["Ada"], [2, ["Ada"]])
    faces.setRecognitionEnabled(False)
    assert names_seen(faces, memory) == ([""], [])


def test_a_face_is_learned_only_where_one_is_seen(rig, show):
    faces = rig.access.service(ALFaceDetection)
    show(picture())
    learn = rig.begin(faces.learnFace, "Ada")
    learn.join()
    assert learn.result is False
    assert faces.getLearnedFacesList() == []


def test_learned_faces_are_forgotten(rig, memory, show):
    faces = rig.access.service(ALFaceDetection)
    for name in ("Ada", "Bob", "Ada"):
        rig.complete(faces.learnFace, name)
    assert faces.getLearnedFacesList() == ["Bob", "Ada"]
    assert faces.forgetPerson("Ada")
    assert not faces.forgetPerson("Ada")
    assert names_seen(faces, memory)[0] == ["Bob"]
    assert faces.clearDatabase()
    assert names_seen(faces, memory)[0] == [""]
