"""The conformance suite that is shipped, as tests of a file: on robots of ours, which have what their bodies describe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from functools import partial
from types import ModuleType
from typing import Any, Final

import pytest

from naoserver.bodies.nao import H25
from naoserver.body import Body
from naoserver.conformance import (
    _plugin,
    test_abilities,
    test_actions,
    test_calls,
    test_joints,
    test_life,
    test_safety,
    test_setpoints,
    test_walk,
)
from naoserver.conformance._robot import CAMERA, GAINS, ROOM
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.robot import Robot
from tests.support.conformance import BODIES, FAMILIES, Implementation, Part
from tests.support.robot_server import RobotClient, served_to_client

__all__ = ["NAMED", "SUITE", "parametrize"]

TOPICS: Final = (
    test_abilities,
    test_actions,
    test_calls,
    test_joints,
    test_setpoints,
    test_safety,
    test_walk,
    test_life,
)
WEIGHTY: Final = (test_abilities, test_walk)
"""What masses and contacts decide: on every body in simulation, too."""
OF_BODIES: Final[dict[ModuleType, tuple[Body, ...]]] = {
    **dict.fromkeys((test_calls, test_joints, test_walk), BODIES),
    **dict.fromkeys((test_abilities, test_actions), FAMILIES),
}
"""The bodies that make a difference to a topic; for the others, those of an H25 are joints like any other's."""
SOON: Final = ServerOptions(safety=SafetyOptions(velocity_timeout=0.2))
FAKES: Final[dict[str, FakeRobot]] = {}
"""A robot of each body, to see what it has."""

Choose = Callable[[Part, Sequence[Body], bool], list[Any]]
"""Return the parameters of a test: those of some bodies that have what it needs; and whether weight decides it."""


def is_collected(name: str, value: object) -> bool:
    """Return whether a name of a topic is that of a test or of a fixture."""
    return name.startswith("test_") or type(value).__name__ == "FixtureFunctionDefinition"


@pytest.fixture(scope="module")
def implementation(request: pytest.FixtureRequest) -> Implementation:
    """A way to make a robot of a body."""
    way: Implementation = request.param
    return way


@pytest.fixture(scope="module")
def make(implementation: Implementation) -> Callable[[], AbstractContextManager[Robot]]:
    """What makes the robot."""
    return partial(implementation.way, implementation.body)


@pytest.fixture(scope="module")
def nao(make: Callable[[], AbstractContextManager[Robot]]) -> Iterator[RobotClient]:
    """The robot, and a client's session."""
    with make() as robot, served_to_client(robot, SOON) as nao:
        yield nao


@pytest.fixture(scope="module")
def closed(make: Callable[[], AbstractContextManager[Robot]]) -> Iterator[Robot]:
    """A robot that was closed, twice."""
    with make() as robot:
        robot.start()
        robot.close()
        robot.close()
        yield robot


NAMED: Final = [
    (name, value) for topic in TOPICS for name, value in vars(topic).items() if is_collected(name, value)
]
"""The tests and fixtures of all topics."""
SUITE: Final = dict(
    NAMED, rest=_plugin.rest, implementation=implementation, make=make, nao=nao, closed=closed
)
"""What a file needs that runs the suite, with a call of `parametrize`."""


def parametrize(metafunc: pytest.Metafunc, choose: Choose) -> None:
    """Run each test on the chosen robots that have what it needs."""
    if "implementation" not in metafunc.fixturenames:
        return
    topic = sys.modules[metafunc.function.__module__]
    needs = [need for mark in metafunc.definition.iter_markers("needs") for need in mark.args]
    needs += [need for mark in [getattr(topic, "pytestmark", None)] if mark for need in mark.args]
    bodies = FAMILIES if GAINS in needs else OF_BODIES.get(topic, (H25,))
    chosen = choose(partial(_able, needs), bodies, topic in WEIGHTY)
    if CAMERA in needs:
        chosen = [pytest.param(*one.values, marks=[*one.marks, pytest.mark.gl], id=one.id) for one in chosen]
    metafunc.parametrize("implementation", chosen, indirect=True, scope="module")


def _able(needs: Sequence[Any], body: Body) -> bool:
    """Return whether a fake robot of a body has some parts; it has what every robot of that body has."""
    robot = FAKES.setdefault(body.name, FakeRobot(body=body))
    return all(need is ROOM or need.has(robot) for need in needs)
