"""Postures that a robot assumes by itself: who controls its joints on the way, and what stops it."""

import pytest

from naoserver.bodies.capabilities import PostureProgress
from naoserver.errors import HardwareFailure, InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from zenoh_ice import VirtualClock


class Postures:
    """Go on the way until a test says that it has ended."""

    names = ("Stand", "Crouch")

    def __init__(self):
        self.now = PostureProgress()
        self.fails: BaseException | None = None

    def go(self, name, fraction):
        if self.fails is not None:
            raise self.fails
        self.now = PostureProgress(name, moving=True)

    def stop(self):
        self.now = PostureProgress(self.now.name, message="it was stopped")

    def current(self):
        return ""

    def progress(self):
        return self.now


@pytest.fixture
def own():
    return Postures()


@pytest.fixture
def assembly(own):
    clock = VirtualClock()
    robot = FakeRobot(clock)
    robot.postures = own
    return Assembly(robot, ServerOptions(), clock)


@pytest.fixture
def servant(assembly):
    return assembly.servants["Postures"]


def test_on_the_way_the_joints_are_refused_to_others_and_free_at_its_end(assembly, servant, own):
    servant.go("Crouch", 1.0, "")
    with pytest.raises(InvalidCommand, match="HeadYaw is moved by the way into a posture"):
        assembly.body.move({"HeadYaw": 0.5}, {})
    servant.go("Stand", 1.0, "")
    assert servant.watch() is not None
    own.now = PostureProgress("Stand", reached=True)
    assert servant.watch() is None
    assembly.body.move({"HeadYaw": 0.5}, {})


@pytest.mark.parametrize(
    "stop",
    [
        lambda assembly: assembly.body.hold(),
        lambda assembly: assembly.gate.stop("a test"),
        lambda assembly: assembly.servants["Postures"].stop(None),
        lambda assembly: assembly.close(),
    ],
    ids=["hold", "emergency stop", "stop", "the server's end"],
)
def test_whatever_stops_the_body_stops_it_on_the_way(assembly, servant, own, stop):
    servant.go("Crouch", 1.0, "")
    stop(assembly)
    assert not own.now.moving
    assembly.gate.reset(resume=True)
    assembly.body.move({"HeadYaw": 0.5}, {})


@pytest.mark.parametrize("error", [HardwareFailure, OSError, SystemExit])
def test_a_robot_that_cannot_go_keeps_its_joints_free(assembly, servant, own, error):
    own.fails = error("the robot is lost")
    with pytest.raises(error):
        servant.go("Crouch", 1.0, "")
    assembly.body.move({"HeadYaw": 0.5}, {})


def test_no_way_begins_while_something_else_moves_the_joints(assembly, servant, own):
    assembly.body.claims.claim("the walk", ("LKneePitch",), lambda: None)
    with pytest.raises(InvalidCommand, match="the walk"):
        servant.go("Crouch", 1.0, "")
    assert not own.now.moving


def test_once_closed_no_way_begins(servant, own):
    servant.close()
    servant.go("Crouch", 1.0, "")
    assert not own.now.moving
