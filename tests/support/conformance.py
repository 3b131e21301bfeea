"""The robots for the conformance tests, and how exactly they have to agree."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from functools import partial
from typing import Final
from unittest.mock import patch

import pytest

from interfaces.jderobot import Pose3DMotorsData
from naoserver.body import H21, H25, Body
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.server import serve
from tests.support.limits import FOREVER
from tests.support.processes import free_endpoint
from tests.support.robot_server import RobotClient, served_to_client
from zenoh_ice import initialize

__all__ = [
    "BODIES",
    "PATIENT",
    "ROBOTS",
    "WITH_AN_H21",
    "Served",
    "fake_as_naoqi",
    "in_simulation",
    "motors",
    "on_each_body",
]

Served = Callable[[ServerOptions | None], AbstractContextManager[RobotClient]]
"""Serves a robot with some options, or with the defaults."""

PATIENT: Final = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
"""For tests in which a velocity must last."""


@contextmanager
def fake(options: ServerOptions | None, body: Body = H25) -> Iterator[RobotClient]:
    """Serve the robot without physics."""
    with served_to_client(FakeRobot(body=body), options) as nao:
        yield nao


@contextmanager
def simulated(options: ServerOptions | None, body: Body = H25) -> Iterator[RobotClient]:
    """Serve the simulated robot."""
    pytest.importorskip("mujoco", reason="the simulated robot needs MuJoCo: pip install 'visualhfsm[sim]'")
    from naoserver_sim.robot import SimulatedRobot

    with served_to_client(SimulatedRobot(skin=False, body=body), options) as nao:
        yield nao


@contextmanager
def fake_as_naoqi(body: Body = H25) -> Iterator[str]:
    """Serve the robot without physics as NAOqi does; yield its URL."""
    from naoserver.qi import serve_as_naoqi

    behind = FakeRobot(body=body)
    with (
        closing(behind),
        initialize(realm="behind", listen=[free_endpoint()], connect=[], clock="wall") as communicator,
        serve(behind, communicator.createObjectAdapter("Behind"), ServerOptions()) as assembly,
        serve_as_naoqi(behind, assembly, "tcp://127.0.0.1:0") as url,
    ):
        yield url


@contextmanager
def naoqi(options: ServerOptions | None, body: Body = H25) -> Iterator[RobotClient]:
    """Serve a robot over NAOqi: the robot without physics behind the services of NAOqi, over libqi.

    It is polled less often than a real one: most of the work would be polls.
    """
    pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")
    from naoserver.naoqi._link import RobotAddress
    from naoserver.naoqi._robot import NaoqiRobot
    from tests.support.naoqi import connect_patiently

    with fake_as_naoqi(body) as url, patch("naoserver.naoqi._connection.PERIOD", 0.05):
        address = RobotAddress.parse(url)
        robot = NaoqiRobot(lambda _: connect_patiently(address), body=body)
        with served_to_client(robot, options) as nao:
            yield nao


ROBOTS: Final = (
    pytest.param(fake, id="fake"),
    pytest.param(simulated, id="simulated", marks=pytest.mark.sim),
    pytest.param(naoqi, id="naoqi"),
)
"""Each implementation, with the body of an H25."""
BODIES: Final = (
    *ROBOTS,
    pytest.param(partial(fake, body=H21), id="fake H21"),
    pytest.param(partial(naoqi, body=H21), id="naoqi H21"),
    pytest.param(partial(simulated, body=H21), id="simulated H21", marks=pytest.mark.sim),
)
"""Each implementation with each body: for what depends on which joints and sensors there are."""

on_each_body: Final = pytest.mark.parametrize("nao", BODIES, indirect=True)
"""Runs a test whose robot is the fixture `nao` with each body."""

WITH_AN_H21: Final = (*ROBOTS, BODIES[-1])
"""Each implementation with the body of an H25, and an H21 in simulation."""

in_simulation: Final = pytest.mark.parametrize("nao", ROBOTS[1:2], indirect=True)
"""Runs a test whose robot is the fixture `nao` with the simulated one."""


def motors(**values: float) -> Pose3DMotorsData:
    """Return a command of some values, the others zero."""
    return Pose3DMotorsData(**(dict.fromkeys(Pose3DMotorsData.__struct_fields__, 0.0) | values))
