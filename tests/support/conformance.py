"""The robots for the conformance tests, and how exactly they have to agree."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from typing import Any, Final

import pytest

from interfaces.jderobot import Pose3DMotorsData
from naoserver.bodies import find_body
from naoserver.bodies.nao import H21, H25
from naoserver.bodies.parts import Steps
from naoserver.body import Body
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.robot import Robot
from naoserver.serving.server import serve
from tests.support.limits import FOREVER
from tests.support.processes import free_endpoint
from tests.support.robot_server import RobotClient, clock_at, served_to_client
from tests.support.soak import cases
from zenoh_ice import initialize

__all__ = [
    "BODIES",
    "FAMILIES",
    "PATIENT",
    "WAYS",
    "Implementation",
    "fake",
    "fake_as_naoqi",
    "in_simulation",
    "motors",
    "robots",
    "simulated",
]

SPEED: Final = 4.0
"""Robot seconds in a second of the wall: a robot moves as fast as the processor can follow, also beside others."""
PATIENT: Final = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
"""For tests in which a velocity must last."""


@contextmanager
def fake(body: Body = H25) -> Iterator[Robot]:
    """Make the robot without physics."""
    yield FakeRobot(clock_at(SPEED), body=body)


@contextmanager
def simulated(body: Body = H25) -> Iterator[Robot]:
    """Make the simulated robot."""
    pytest.importorskip("mujoco", reason="the simulated robot needs MuJoCo: pip install 'visualhfsm[sim]'")
    from naoserver_sim.robot import SimulatedRobot
    from tests.support.camera_limits import PATIENT_CAMERAS

    yield SimulatedRobot(speed=SPEED, skin=False, body=body, camera_limits=PATIENT_CAMERAS)


@contextmanager
def fake_as_naoqi(body: Body = H25, speed: float = 1.0) -> Iterator[str]:
    """Serve the robot without physics as NAOqi does; yield its URL."""
    pytest.importorskip("visualhfsm_naoqi.programs", reason="the robot behind NAOqi is that of a plug-in")
    from visualhfsm_naoqi.programs import serve_as_naoqi

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
    """Make a robot over NAOqi: the robot without physics behind the services of NAOqi, over libqi.

    It is polled less often than a real one: most of the work would be polls. Its time is the wall's: within what its
    contract says, orders and reports pass through threads and sockets.
    """
    pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")
    from naoserver.hardware.connection import HardwareLimits
    from tests.support.naoqi import connect_patiently
    from visualhfsm_naoqi.robot._link import RobotAddress
    from visualhfsm_naoqi.robot._robot import NaoqiRobot

    with fake_as_naoqi(body) as url:
        address, limits = RobotAddress.parse(url), HardwareLimits(period=0.05)
        yield NaoqiRobot(lambda _: connect_patiently(address), body=body, limits=limits)


BODIES: Final = (H25, H21, *(find_body(name) for name in ("T1", "G1", "Cart")))
"""Every body."""

FAMILIES: Final = tuple(body for body in BODIES if body is not H21)
"""A body of each kind of robot: for what is the same for an H21 as for an H25."""

Make = Callable[[Body], AbstractContextManager[Robot]]
WAYS: Final[tuple[Make, ...]] = (fake, simulated, naoqi)
"""The ways to make a robot; only a Nao has NAOqi."""


@dataclass(frozen=True)
class Implementation:
    """A way to make a robot of a body: without physics, in the simulation, or over NAOqi."""

    way: Make
    body: Body

    @contextmanager
    def __call__(self, options: ServerOptions | None) -> Iterator[RobotClient]:
        """Serve the robot to a client."""
        with self.way(self.body) as robot, served_to_client(robot, options) as nao:
            yield nao

    @property
    def parameter(self) -> Any:
        """The value of a test's parameter."""
        kind = self.way.__name__
        marks = [pytest.mark.sim] if kind == "simulated" else []
        return pytest.param(self, id=kind if self.body is H25 else f"{kind} {self.body.name}", marks=marks)


Part = Callable[[Body], object]
"""What a test needs of a body: it returns whether the body has it."""


def robots(
    *parts: Part, bodies: Iterable[Body] = BODIES, ways: Sequence[Make] = WAYS, weight: bool = False
) -> list[Any]:
    """Return the parameters of a test: some bodies, those that have the parts, served in some ways.

    `make test` takes an H25 in each way, and every other body in the first one: how a body is described makes
    the same difference in all of them. With `weight`, where masses and contacts decide, it takes every body in
    simulation, too. `make soak` takes the rest.
    """
    able = [body for body in bodies if all(part(body) for part in parts)]
    pairs = [
        Implementation(way, body)
        for body in able
        for way in ways
        if way is not naoqi or isinstance(body.walk, Steps)
    ]

    def in_test(robot: Implementation) -> bool:
        return robot.body is H25 or robot.way is ways[0] or (weight and robot.way is simulated)

    return cases(
        [robot.parameter for robot in pairs if in_test(robot)],
        [robot.parameter for robot in pairs if not in_test(robot)],
    )


def in_simulation(*parts: Part, bodies: Iterable[Body] = BODIES) -> pytest.MarkDecorator:
    """Run a test whose robot is the fixture `nao` with simulated bodies that have some parts."""
    return pytest.mark.parametrize("nao", robots(*parts, bodies=bodies, ways=[simulated]), indirect=True)


def motors(**values: float) -> Pose3DMotorsData:
    """Return a command of some values, the others zero."""
    return Pose3DMotorsData(**(dict.fromkeys(Pose3DMotorsData.__struct_fields__, 0.0) | values))
