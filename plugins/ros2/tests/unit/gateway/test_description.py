"""The description that the gateway takes from a robot server, which it does not trust."""

import json

import pytest

from interfaces.nao import Description, InertialUnitPrx, PosturesPrx, SonarPrx
from naoserver.bodies import BODY_NAMES, find_body
from naoserver.body import write_body
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver.serving.server import serve
from tests.support.bodies import CART
from visualhfsm_ros2.gateway._description import DescribedRobot, GatewayError
from zenoh_ice import Communicator, Settings, VirtualClock
from zenoh_ice.routes.in_process import InProcessTransport


class AnyDescription(Description):
    """Describe the robot by any text."""

    def __init__(self, body):
        self.body = body

    def getBody(self, current):
        return self.body

    def getLooks(self, current):
        return ""


@pytest.fixture
def network():
    with Communicator(Settings(), transport=InProcessTransport) as communicator:
        yield communicator


@pytest.fixture
def adapter(network):
    return network.createObjectAdapter("NaoServer")


@pytest.mark.parametrize("body", [*map(find_body, BODY_NAMES), CART], ids=lambda body: body.name)
def test_the_gateway_has_the_body_of_the_robot(network, adapter, body):
    with serve(FakeRobot(body=body), adapter):
        adapter.activate()
        assert write_body(DescribedRobot(network).body) == write_body(body)


def test_what_the_robot_lacks_is_none_and_what_it_has_is_found_also_after_that(network, adapter):
    with serve(FakeRobot(body=CART), adapter):
        adapter.activate()
        robot = DescribedRobot(network)
        for _ in range(2):
            assert robot.find(PosturesPrx, "Postures") is None
            assert robot.find(SonarPrx, "Sonar") is not None
        assert robot.find(InertialUnitPrx, "InertialUnit") is None


def read(network, adapter, described):
    """Return the description of a server that says anything of its robot, a cart."""
    adapter.add(AnyDescription(described), "Description")
    clock = VirtualClock()
    assembly = Assembly(FakeRobot(clock, body=CART), ServerOptions(), clock)
    adapter.add(assembly.servants["Body"], "Body")
    adapter.activate()
    return DescribedRobot(network).body


def changed(**parts):
    return json.dumps(json.loads(write_body(CART)) | parts)


@pytest.mark.parametrize(
    ("described", "message"),
    [
        ("", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("null", "description"),
        (changed(name="\x00"), "write a name of 1 to 64 printable characters"),
        (changed(name="n" * 65), "64"),
        (changed(links=[]), "links"),
        (changed(links=[{"name": f"link {i}", "mass": 1} for i in range(1001)]), "links"),
        (changed(mass=1), "no such key"),
        ('{"name": 1, "name": 2}', "'name' is there twice"),
        (changed(**{"\ud800": 1}), "not printable"),
        (changed(joints=[]), "no joint"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_fault_in_it_is_an_error_of_the_gateway(network, adapter, described, message):
    with pytest.raises(GatewayError, match=message) as refused:
        read(network, adapter, described)
    assert str(refused.value).startswith("the robot's description")
    assert len(str(refused.value)) < 2000


def test_one_of_another_robot_is_refused(network, adapter):
    with pytest.raises(GatewayError, match=r"has the joints HeadYaw, .*; its server moves drive_port"):
        read(network, adapter, write_body(find_body("H25")))
