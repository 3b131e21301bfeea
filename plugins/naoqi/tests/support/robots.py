"""A Nao over NAOqi: the robot without physics behind the services of NAOqi, over libqi."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager

import pytest

from naoserver.bodies.nao import H25
from naoserver.body import Body
from naoserver.fake import FakeRobot
from naoserver.hardware.connection import HardwareLimits
from naoserver.options import ServerOptions
from naoserver.robot import Robot
from naoserver.serving.server import serve
from tests.support.processes import free_endpoint
from tests.support.robot_server import clock_at
from visualhfsm_naoqi.programs import serve_as_naoqi
from visualhfsm_naoqi.robot._link import RobotAddress
from visualhfsm_naoqi.robot._robot import NaoqiRobot
from zenoh_ice import initialize

__all__ = ["fake_as_naoqi", "naoqi"]


@contextmanager
def fake_as_naoqi(body: Body = H25, speed: float = 1.0) -> Iterator[str]:
    """Serve the robot without physics as NAOqi does; yield its URL."""
    behind = FakeRobot(clock_at(speed), body=body)
    with (
        closing(behind),
        initialize(realm="behind", listen=[free_endpoint()], connect=[], clock="wall") as communicator,
        serve(behind, communicator.createObjectAdapter("Behind"), ServerOptions()) as assembly,
        serve_as_naoqi(behind, assembly, "tcp://127.0.0.1:0") as url,
    ):
        yield url


@contextmanager
def naoqi(body: Body = H25) -> Iterator[Robot]:
    """Make a robot over NAOqi.

    It is polled less often than a real one: most of the work would be polls. Its time is the wall's: within what its
    contract says, orders and reports pass through threads and sockets.
    """
    pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")
    from plugins.naoqi.tests.support.naoqi import connect_patiently

    with fake_as_naoqi(body) as url:
        address, limits = RobotAddress.parse(url), HardwareLimits(period=0.05)
        yield NaoqiRobot(lambda _: connect_patiently(address), body=body, limits=limits)
