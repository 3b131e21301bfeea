"""The watch over what topics set in motion, when the robot server does not answer at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from types import SimpleNamespace
from typing import Any, cast

import pytest

from interfaces.nao import JointsPrx
from tests.support.waiting import until
from visualhfsm_ros2.gateway._vigil import JointMotion, Vigil
from zenoh_ice import BusyException, ConnectionLostException, SystemException, TimeoutException
from zenoh_ros2 import Sender

LATE = [BusyException("the server has no thread"), TimeoutException("no answer within 2 s")]


class Publisher:
    """The publisher of a topic, and a joint that it sent to 1.0 rad."""

    def __init__(self) -> None:
        self.gone = False
        self.position = 0.0
        self.held: list[dict[str, float]] = []
        self.trouble: list[SystemException] = []

    def getJointState(self) -> Any:
        self.position += 0.001
        return SimpleNamespace(commands=[self.position])

    def setJointPositions(self, targets: dict[str, float], _speed: float) -> None:
        if self.trouble:
            raise self.trouble.pop()
        self.held.append(targets)

    def motion(self) -> JointMotion:
        motion = JointMotion(cast("JointsPrx", self), ("HeadYaw",))
        motion.add({"HeadYaw": 1.0}, cast("Sender", self))
        return motion


@pytest.fixture
def publisher() -> Publisher:
    return Publisher()


class Moving:
    """Something that a topic set in motion."""

    def __init__(self, look: Callable[[], bool]) -> None:
        self.poll = look


@contextmanager
def watched(look: Callable[[], bool]) -> Iterator[None]:
    with closing(Vigil()) as vigil:
        vigil.watch(Moving(look))
        yield


@pytest.mark.parametrize("error", LATE, ids=["busy", "late"])
def test_a_server_that_is_late_ends_no_watch(error: SystemException) -> None:
    looks = 0

    def look() -> bool:
        nonlocal looks
        looks += 1
        raise error

    with watched(look):
        until(lambda: looks > 1)


def test_a_server_that_is_gone_ends_the_watch(caplog: pytest.LogCaptureFixture) -> None:
    def look() -> bool:
        raise ConnectionLostException("the server is offline")

    with watched(look):
        until(lambda: "cannot be watched: the server is offline" in caplog.text)


@pytest.mark.parametrize("error", [ZeroDivisionError, SystemExit])
def test_a_watch_that_fails_ends_no_other(
    caplog: pytest.LogCaptureFixture, error: type[BaseException]
) -> None:
    looks = 0

    def fail() -> bool:
        raise error

    def look() -> bool:
        nonlocal looks
        looks += 1
        return True

    with closing(Vigil()) as vigil:
        for each in (fail, look):
            vigil.watch(Moving(each))
        until(lambda: looks > 2)
    assert "is watched no more" in caplog.text
    assert error.__name__ in caplog.text


def test_what_moves_again_while_it_is_found_at_rest_is_watched() -> None:
    looks = 0

    def look() -> bool:
        nonlocal looks
        looks += 1
        if looks == 1:
            vigil.watch(moving)
        return False

    moving = Moving(look)
    with closing(Vigil()) as vigil:
        vigil.watch(moving)
        until(lambda: looks == 2)


def test_a_hold_that_was_not_carried_out_is_repeated(publisher: Publisher) -> None:
    publisher.trouble.append(TimeoutException("no answer within 2 s"))
    with watched(publisher.motion().poll):
        publisher.gone = True
        until(lambda: bool(publisher.held))


def test_a_joint_that_is_held_is_watched_no_more(publisher: Publisher) -> None:
    motion = publisher.motion()
    assert motion.poll()
    publisher.gone = True
    assert not motion.poll()
    assert publisher.held == [{"HeadYaw": publisher.position}]
