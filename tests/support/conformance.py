"""The robots for the conformance tests, and how exactly they have to agree."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, Final

import pytest

from interfaces.jderobot import Pose3DMotorsData
from naoserver.bodies import find_body
from naoserver.bodies.nao import H21, H25
from naoserver.body import Body
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.robot import Robot
from tests.support.limits import FOREVER
from tests.support.robot_server import RobotClient, clock_at, served_to_client
from tests.support.soak import cases

__all__ = [
    "BODIES",
    "FAMILIES",
    "PATIENT",
    "WAYS",
    "Implementation",
    "Make",
    "Part",
    "fake",
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


BODIES: Final = (H25, H21, *(find_body(name) for name in ("T1", "G1", "Cart")))
"""Every body."""

FAMILIES: Final = tuple(body for body in BODIES if body is not H21)
"""A body of each kind of robot: for what is the same for an H21 as for an H25."""

Make = Callable[[Body], AbstractContextManager[Robot]]
WAYS: Final[tuple[Make, ...]] = (fake, simulated)
"""The ways to make a robot of any body."""


@dataclass(frozen=True)
class Implementation:
    """A way to make a robot of a body, such as without physics."""

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
    pairs = [Implementation(way, body) for body in able for way in ways]

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
