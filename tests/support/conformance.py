"""The robots for the conformance tests, and how exactly they have to agree."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from typing import Final

import pytest

from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.server import serve
from tests.support.limits import FOREVER
from tests.support.processes import free_endpoint
from tests.support.robot_server import RobotClient, served_to_client
from zenoh_ice import initialize

__all__ = ["PATIENT", "ROBOTS", "Served"]

Served = Callable[[ServerOptions | None], AbstractContextManager[RobotClient]]
"""Serves a robot with some options, or with the defaults."""

PATIENT: Final = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
"""For tests in which a velocity must last."""


@contextmanager
def fake(options: ServerOptions | None) -> Iterator[RobotClient]:
    """Serve the robot without physics."""
    with served_to_client(FakeRobot(), options) as nao:
        yield nao


@contextmanager
def simulated(options: ServerOptions | None) -> Iterator[RobotClient]:
    """Serve the simulated robot."""
    pytest.importorskip("mujoco", reason="the simulated robot needs MuJoCo: pip install 'visualhfsm[sim]'")
    from naoserver_sim.robot import SimulatedRobot

    with served_to_client(SimulatedRobot(), options) as nao:
        yield nao


@contextmanager
def naoqi(options: ServerOptions | None) -> Iterator[RobotClient]:
    """Serve a robot over NAOqi: the robot without physics behind the services of NAOqi, over libqi."""
    pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")
    from naoserver_naoqi.link import RobotAddress
    from naoserver_naoqi.robot import NaoqiRobot
    from naoserver_qi import serve_as_naoqi
    from tests.support.naoqi import connect_patiently

    behind = FakeRobot()
    with (
        closing(behind),
        initialize(realm="behind", listen=[free_endpoint()], connect=[], clock="wall") as communicator,
        serve(behind, communicator.createObjectAdapter("Behind"), ServerOptions()) as assembly,
        serve_as_naoqi(behind, assembly, "tcp://127.0.0.1:0") as url,
    ):
        address = RobotAddress.parse(url)
        with served_to_client(NaoqiRobot(lambda _: connect_patiently(address)), options) as nao:
            yield nao


ROBOTS: Final = (
    pytest.param(fake, id="fake"),
    pytest.param(simulated, id="simulated", marks=pytest.mark.sim),
    pytest.param(naoqi, id="naoqi"),
)
