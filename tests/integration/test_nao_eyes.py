"""The command `nao eyes` beside a served robot: it serves Sight of the robot's pictures."""

from __future__ import annotations

from interfaces.nao import SightPrx
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from tests.support.limits import MOVE_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.robot_server import served
from zenoh_ice import initialize

BLIND = ServerOptions(sight=False)


def balls_seen(endpoint):
    """Return the names of the balls that are in the next reading."""
    with initialize(connect=[endpoint], listen=[], clock="wall") as communicator:
        sight = SightPrx.checkedCast(communicator.stringToProxy("Sight"))
        reading = next(iter(sight.getSight.samples(timeout=MOVE_LIMIT))).value
        return {thing.name for thing in reading.things if thing.kind == "ball"}


def test_it_serves_what_the_pictures_of_a_robot_show():
    endpoint = free_endpoint()
    with served(FakeRobot(), BLIND, realm="nao", endpoint=endpoint):
        with ComponentProcess(module("nao_tools", "eyes", "--connect", endpoint)) as eyes:
            eyes.wait_for("ready: Sight in realm nao, of Camera, CameraBottom")
            assert balls_seen(endpoint) == {"red", "green"}
        assert eyes.process.returncode == 130


def test_it_goes_on_when_the_robot_is_served_again():
    endpoint = free_endpoint()
    with ComponentProcess(module("nao_tools", "eyes", "--connect", endpoint)) as eyes:
        with served(FakeRobot(), BLIND, realm="nao", endpoint=endpoint):
            eyes.wait_for("ready:")
        eyes.wait_for("lost the robot")
        with served(FakeRobot(), BLIND, realm="nao", endpoint=endpoint):
            eyes.wait_for("the robot is back, with Camera, CameraBottom", MOVE_LIMIT)
            assert balls_seen(endpoint) == {"red", "green"}
