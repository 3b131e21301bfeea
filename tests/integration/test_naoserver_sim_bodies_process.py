"""The command `naoserver-sim` as a separate process, with bodies that are no Naos."""

import os
import signal

import pytest

from interfaces.jderobot import EncodersPrx, InvalidValueException, MotorsPrx
from interfaces.nao import WalkPrx
from naoserver.bodies import find_body
from tests.support.cart import CART, CART_TOML
from tests.support.limits import END_LIMIT
from tests.support.plugins import OWN_ROBOTS
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.robot_server import eventually, wait_for
from tests.support.soak import cases
from zenoh_ice import initialize

pytestmark = pytest.mark.sim

SPEED = 0.15  # m/s
ALWAYS = {"Body", "Clock", "Description", "Encoders", "Health", "Motors", "Safety", "Walk"}


@pytest.fixture(params=cases(["T1", pytest.param("my_cart.toml", marks=OWN_ROBOTS)], ["G1", "Cart"]))
def body(request, tmp_path):
    """What `--body` is given, and some of what such a robot announces."""
    if request.param != "my_cart.toml":
        hinges = {f"{hinge}Motors" for hinge in find_body(request.param).hinges}
        return request.param, ALWAYS | hinges | {"Camera", "Head", "InertialUnit"}
    (tmp_path / "cart.xml").write_text(CART)
    (tmp_path / request.param).write_text(CART_TOML)
    return str(tmp_path / request.param), ALWAYS | {"Head", "NeckMotors"}


def server(endpoint, body, directory, *options):
    """Start a server that keeps an emergency stop in a directory."""
    of_all = ("--listen", endpoint, "--no-skin", "--body", body, "--world", "empty", "--speed", "3")
    command = module("naoserver_sim", *of_all, *options)
    return ComponentProcess(command, {"XDG_STATE_HOME": os.fspath(directory), "MUJOCO_GL": "disable"})


def walk_on(communicator):
    """Walk until the robot has come some way."""
    encoders = EncodersPrx.checkedCast(communicator.stringToProxy("Encoders"))
    motors = MotorsPrx.checkedCast(communicator.stringToProxy("Motors"))
    start = encoders.getEncodersData().robotx

    def comes_on(data):
        motors.setV(SPEED)  # it lasts for half a second
        return data.robotx > start + 0.1

    wait_for(encoders.getEncodersData, comes_on)
    return motors


def test_it_announces_what_the_body_has_walks_and_ends_at_a_signal(body, tmp_path):
    name, expected = body
    endpoint = free_endpoint()
    with server(endpoint, name, tmp_path) as process:
        process.wait_for("^ready")
        with initialize(connect=[endpoint], listen=["tcp/127.0.0.1:0"]) as communicator:
            eventually(lambda: expected <= set(communicator.identities()))
            walk_on(communicator).stop()
        process.process.send_signal(signal.SIGTERM)
        assert process.wait(END_LIMIT) in {128 + signal.SIGTERM, -signal.SIGTERM}, process.output
        assert "Traceback" not in process.output


def test_it_can_be_hung_up(tmp_path):
    endpoint = free_endpoint()
    with server(endpoint, "G1", tmp_path, "--hang") as process:
        process.wait_for("^ready")
        with initialize(connect=[endpoint]) as communicator:
            walk = WalkPrx.checkedCast(communicator.stringToProxy("Walk"))
            with pytest.raises(InvalidValueException, match="does not stand on its feet"):
                walk.walkTo(0.5, 0.0, 0.0)
