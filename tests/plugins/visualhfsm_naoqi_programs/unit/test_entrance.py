import pytest

from naoserver.bodies import find_body
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver.serving.server import find_entrance
from tests.support.bodies import CART
from visualhfsm_naoqi_programs import serve_as_naoqi
from zenoh_ice import VirtualClock


def test_naoqi_is_an_entrance_of_an_installed_package():
    assert find_entrance("qi") is serve_as_naoqi


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
