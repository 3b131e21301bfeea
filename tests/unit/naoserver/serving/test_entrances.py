import tomllib
from importlib.metadata import EntryPoint

import pytest

from naoserver.bodies import find_body
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver.serving.server import find_entrance
from tests.support.bodies import CART
from tests.support.places import ROOT
from visualhfsm_makers.booster import serve_as_booster
from visualhfsm_makers.unitree import serve_as_unitree
from visualhfsm_naoqi_programs import serve_as_naoqi
from zenoh_ice import VirtualClock


def test_naoqi_is_an_entrance_of_an_installed_package():
    assert find_entrance("qi") is serve_as_naoqi


@pytest.mark.parametrize(("maker", "serve"), [("unitree", serve_as_unitree), ("booster", serve_as_booster)])
def test_the_project_declares_the_entrances_of_makers(maker, serve):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    declared = project["entry-points"]["naoserver.entrances"][maker]
    assert EntryPoint(maker, declared, "naoserver.entrances").load() is serve
    assert project["optional-dependencies"][maker] == ["cyclonedds==11.0.1"]


def test_an_entrance_that_no_package_provides():
    with pytest.raises(RobotError, match="no installed package serves robots as 'ros1'"):
        find_entrance("ros1")


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
