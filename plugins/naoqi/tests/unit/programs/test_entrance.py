"""The way of NAOqi's programs into `naoserver-sim`."""

import pytest

from naoserver.bodies import find_body
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver.serving.entrances import find_entrances
from naoserver_sim._command import app
from tests.support.bodies import CART
from tests.support.commands import run_here
from tests.support.processes import free_endpoint
from visualhfsm_naoqi.programs import ENTRANCE, serve_as_naoqi
from zenoh_ice import VirtualClock


def test_naoserver_sim_finds_it():
    assert ENTRANCE in find_entrances()


def test_robots_serve_at_different_ports():
    assert ENTRANCE.apart["qi"]("tcp://127.0.0.1:9559", 1) == "tcp://127.0.0.1:9560"


@pytest.mark.slow
def test_it_is_not_served_beside_roles(tmp_path):
    why = "--qi beside [security]: programs of NAOqi"
    secured = tmp_path / "robot.toml"
    secured.write_text('[security]\nuser = "robot"\npassword = "secret"\n')
    options = ("--config", str(secured), "--listen", free_endpoint(), "--qi", "tcp://127.0.0.1:0")
    done = run_here(app, "naoserver-sim", *options, expected=(RobotError,), columns=300)
    assert done.returncode == 1
    assert f"{why} have no passwords" in done.stderr


@pytest.mark.parametrize(
    ("body", "title"), [(find_body("T1"), "Booster T1"), (CART, "Cart")], ids=lambda value: str(value)[:4]
)
def test_no_other_robot_than_a_nao_is_served_as_naoqi(body, title):
    clock = VirtualClock()
    robot = FakeRobot(clock, body=body)
    assembly = Assembly(robot, ServerOptions(), clock)
    message = f"--qi serves NAOqi, the system of the Nao; this robot is a {title}"
    with pytest.raises(RobotError, match=message):
        serve_as_naoqi(robot, assembly, "tcp://127.0.0.1:0")
