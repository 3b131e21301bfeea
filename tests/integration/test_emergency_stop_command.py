"""`visualhfsm emergency-stop`, on a fake robot."""

import pytest
from typer.testing import CliRunner

from interfaces.nao import SafetyPrx
from naoserver.fake import FakeRobot
from tests.support.processes import free_endpoint
from tests.support.robot_server import served_to_client
from visualhfsm.command import app
from zenoh_ice import ConnectFailedException


def run(*arguments):
    result = CliRunner().invoke(app, ["emergency-stop", *arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


def test_the_robot_is_stopped_with_a_reason_and_reset():
    with served_to_client(FakeRobot()) as nao:
        where = ["--realm", nao.realm, "--connect", nao.endpoint]
        safety = nao.proxy(SafetyPrx, "Safety")
        assert "stopped: the robot takes no command" in run("stairs ahead", *where)
        assert safety.getSafetyState().reason == "stairs ahead"
        assert "reset: the robot takes commands" in run("--reset", *where)
        assert not safety.getSafetyState().stopped


def test_without_a_robot_it_says_so():
    with pytest.raises(ConnectFailedException):
        run("--connect", free_endpoint(), "--timeout", "0.1")
