"""Trajectories of a topic, on joints that are at once where they are sent."""

from __future__ import annotations

import queue
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import pytest

from interfaces.nao import JointState
from plugins.ros2.tests.unit.gateway.test_trajectory import LIMITS, point
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until
from visualhfsm_ros2.gateway._trajectory import MESSAGE, TrajectoryError, TrajectoryFollower, TrajectoryTopic
from zenoh_ice import Sample, TimeoutException
from zenoh_ros2 import Types

NAMES = [*LIMITS]
MEASURED = {"HeadYaw": 0.0}
"""Where the joint was in the only state that came."""
FOLLOWER: Any = TrajectoryFollower  # of a stand-in for a proxy
TOPIC: Any = TrajectoryTopic  # that gets stand-ins for publishers


class Body:
    """Joints whose state comes when the test says so."""

    def __init__(self) -> None:
        self.getJointState = self
        self.sent: list[dict[str, float]] = []
        self.waiting = 0
        self.fault: BaseException | None = None
        self._times: queue.Queue[float] = queue.Queue()
        self._newest = 0.0
        self._positions = dict.fromkeys(NAMES, 0.0)

    def step(self, time: float) -> None:
        self._times.put(time)

    def getJointNames(self) -> list[str]:
        return NAMES

    def getJointLimits(self) -> list[Any]:
        return [*LIMITS.values()]

    def wait(self, after: object = None, timeout: float = 0.0) -> Sample[JointState]:
        if after is not None:
            self.waiting += 1
            try:
                self._newest = self._times.get(timeout=0.01)
            except queue.Empty:
                raise TimeoutException("paused") from None
        zero, now = [0.0] * len(NAMES), [*self._positions.values()]
        state = JointState(self._newest, now, zero, now, zero, zero, zero)
        return Sample(state, 1, self._newest, 0.0)

    def setJointPositions(self, targets: dict[str, float], _fraction: float) -> None:
        if self.fault is not None:
            fault, self.fault = self.fault, None
            raise fault
        self.sent.append(targets)
        self._positions |= targets


@dataclass
class Publisher:
    """Who sent a message."""

    gone: bool = False


@dataclass
class Bench:
    """A topic, the joints that it moves, and why messages were refused."""

    topic: Any
    body: Body
    refused: list[str]
    types: Types

    def send(self, publisher: Publisher, *points: object, joint: str = "HeadYaw") -> None:
        message = self.types.make(MESSAGE, joint_names=[joint] if points else [], points=[*points])
        self.topic.receive(message, publisher)

    def followed(self) -> None:
        """Wait until the trajectory is followed, and waits for the next state."""
        before = self.body.waiting
        until(lambda: self.body.waiting > before + 1, EVENT_LIMIT)


@pytest.fixture(scope="module")
def types() -> Types:
    return Types()


@pytest.fixture
def bench(types: Types) -> Iterator[Bench]:
    body, refused = Body(), list[str]()
    topic = TOPIC(types, FOLLOWER(body, lambda seconds: seconds, lambda: 0), refused.append)
    with closing(topic):
        yield Bench(topic, body, refused, types)


def test_the_newest_replaces_the_one_before_where_that_is(bench: Bench) -> None:
    bench.send(Publisher(), point(1.0, 0.8))
    bench.followed()
    bench.body.step(0.5)
    until(lambda: bench.body.sent, EVENT_LIMIT)
    reached = bench.body.sent[-1]["HeadYaw"]
    bench.send(Publisher(), point(0.1, -0.4, velocities=[0.0]))
    for tick in range(5):
        bench.body.step(0.6 + 0.1 * tick)
    until(lambda: bench.body.sent[-1] == {"HeadYaw": -0.4}, EVENT_LIMIT)
    assert bench.body.sent[1]["HeadYaw"] != reached, "it is not held in between"
    assert not bench.refused


def test_one_that_is_replaced_before_it_began_has_its_turn(bench: Bench) -> None:
    for angle in (0.1, 0.2, 0.3):
        bench.send(Publisher(), point(0.0, angle))
        bench.followed()  # and no state has come since
    for tick in range(1, 5):
        bench.body.step(0.02 * tick)
    until(lambda: {"HeadYaw": 0.3} in bench.body.sent, EVENT_LIMIT)
    assert bench.body.sent[0] == {"HeadYaw": 0.1}


def test_its_joints_are_held_when_its_publisher_is_gone(bench: Bench) -> None:
    publisher = Publisher()
    bench.send(publisher, point(10.0, 1.0))
    bench.followed()
    bench.body.step(1.0)
    until(lambda: bench.body.sent, EVENT_LIMIT)
    publisher.gone = True
    until(lambda: bench.refused, EVENT_LIMIT)
    assert bench.refused == ["its publisher is gone: its joints are held"]
    assert bench.body.sent[-1] == MEASURED


def test_an_empty_one_holds_the_joints(bench: Bench) -> None:
    bench.send(Publisher(), point(10.0, 1.0))
    bench.followed()
    bench.body.step(1.0)
    until(lambda: bench.body.sent, EVENT_LIMIT)
    bench.send(Publisher())
    until(lambda: len(bench.body.sent) == 2, EVENT_LIMIT)
    assert bench.body.sent[1] == MEASURED


@pytest.mark.parametrize("fault", [ZeroDivisionError(), SystemExit(3)])
def test_after_one_that_fails_the_next_is_followed(
    bench: Bench, caplog: pytest.LogCaptureFixture, fault: BaseException
) -> None:
    bench.body.fault = fault
    bench.send(Publisher(), point(1.0, 0.5))
    bench.body.step(0.1)
    until(lambda: "a trajectory of a topic failed" in caplog.text, EVENT_LIMIT)
    bench.send(Publisher(), point(0.0, 0.3))
    bench.body.step(0.2)
    until(lambda: {"HeadYaw": 0.3} in bench.body.sent, EVENT_LIMIT)


def test_one_that_makes_no_sense_disturbs_nothing(bench: Bench) -> None:
    bench.send(Publisher(), point(1.0, 0.5))
    with pytest.raises(TrajectoryError, match="there is no joint 'Nose'"):
        bench.send(Publisher(), point(1.0, 0.1), joint="Nose")
    bench.body.step(2.0)
    until(lambda: {"HeadYaw": 0.5} in bench.body.sent, EVENT_LIMIT)
