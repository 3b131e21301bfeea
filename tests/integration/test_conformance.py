"""The conformance suite that is shipped, on every robot of ours, all of which have what their bodies describe."""

from __future__ import annotations

import sys
from functools import partial

import pytest

from naoserver.bodies.nao import H25
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
from tests.support.conformance import BODIES, FAMILIES, robots
from tests.support.robot_server import served_to_client

TOPICS = (
    test_abilities,
    test_actions,
    test_calls,
    test_joints,
    test_setpoints,
    test_safety,
    test_walk,
    test_life,
)
WEIGHTY = (test_abilities, test_walk)
"""What masses and contacts decide: on every body in simulation, too."""
OF_BODIES = {
    **dict.fromkeys((test_calls, test_joints, test_walk), BODIES),
    **dict.fromkeys((test_abilities, test_actions), FAMILIES),
}
"""The bodies that make a difference to a topic; for the others, those of an H25 are joints like any other's."""
SOON = ServerOptions(safety=SafetyOptions(velocity_timeout=0.2))
FAKES: dict[str, FakeRobot] = {}
"""A robot of each body, to see what it has."""


def is_collected(name, value):
    """Return whether a name of a topic is that of a test or of a fixture."""
    return name.startswith("test_") or type(value).__name__ == "FixtureFunctionDefinition"


SUITE = [
    (name, value) for topic in TOPICS for name, value in vars(topic).items() if is_collected(name, value)
]
globals().update(SUITE, rest=_plugin.rest)


def able(needs, body):
    """Return whether a fake robot of a body has some parts; it has what every robot of that body has."""
    robot = FAKES.setdefault(body.name, FakeRobot(body=body))
    return all(need is ROOM or need.has(robot) for need in needs)


def pytest_generate_tests(metafunc):
    """Run each test on the robots that have what it needs."""
    if "implementation" not in metafunc.fixturenames:
        return
    topic = sys.modules[metafunc.function.__module__]
    needs = [need for mark in metafunc.definition.iter_markers("needs") for need in mark.args]
    needs += [need for mark in [getattr(topic, "pytestmark", None)] if mark for need in mark.args]
    bodies = FAMILIES if GAINS in needs else OF_BODIES.get(topic, [H25])
    chosen = robots(partial(able, needs), bodies=bodies, weight=topic in WEIGHTY)
    if CAMERA in needs:
        chosen = [pytest.param(*one.values, marks=[*one.marks, pytest.mark.gl], id=one.id) for one in chosen]
    metafunc.parametrize("implementation", chosen, indirect=True, scope="module")


@pytest.fixture(scope="module")
def implementation(request):
    """A way to make a robot of a body."""
    return request.param


@pytest.fixture(scope="module")
def make(implementation):
    """What makes the robot."""
    return partial(implementation.way, implementation.body)


@pytest.fixture(scope="module")
def nao(make):
    """The robot, and a client's session."""
    with make() as robot, served_to_client(robot, SOON) as nao:
        yield nao


@pytest.fixture(scope="module")
def closed(make):
    """A robot that was closed, twice."""
    with make() as robot:
        robot.start()
        robot.close()
        robot.close()
        yield robot


def test_no_test_of_the_suite_hides_another():
    assert len(SUITE) == len(dict(SUITE))
