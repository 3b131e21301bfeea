"""Serve a robot in the test's process, as the conformance suite does, with the limits of these tests."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, TypeVar

from naoserver.conformance import _robot
from naoserver.conformance._robot import RobotClient, ServedRobot
from naoserver.options import ServerOptions
from naoserver.robot import Robot
from tests.support.limits import CALL_LIMIT, MOVE_LIMIT
from tests.support.processes import free_endpoint
from tests.support.waiting import until
from zenoh_ice import RobotClock
from zenoh_ice.objects.proxy import StreamedCall

__all__ = [
    "HASTE",
    "RobotClient",
    "ServedRobot",
    "clock_at",
    "eventually",
    "served",
    "served_to_client",
    "wait_for",
]

HASTE: Final = CALL_LIMIT / 8.0
"""Limit in s of the calls of a client that asks for what is not served: it waits for a tenth of it."""

V = TypeVar("V")


@contextmanager
def served(
    robot: Robot,
    options: ServerOptions | None = None,
    *,
    realm: str = "",
    endpoint: str = "",
    limit: float = MOVE_LIMIT,
) -> Iterator[ServedRobot]:
    """Start and serve a robot on loopback, by default in a separate realm; close both at the end."""
    endpoint = endpoint or free_endpoint()
    with _robot.served(robot, options, realm=realm, endpoint=endpoint, limit=limit) as server:
        yield server


@contextmanager
def served_to_client(
    robot: Robot, options: ServerOptions | None = None, *, limit: float = MOVE_LIMIT, **settings: Any
) -> Iterator[RobotClient]:
    """Serve a robot, and open a session that calls it, with further settings."""
    with served(robot, options, limit=limit) as server, server.client(**settings) as client:
        yield client


def clock_at(speed: float) -> RobotClock:
    """Return a clock that runs faster than the wall's."""
    return RobotClock(0.0, speed, simulated=False, silence=math.inf)


def eventually(condition: Callable[[], object], limit: float = MOVE_LIMIT) -> None:
    """Wait until a condition holds, as long as a robot may move; raise AssertionError after `limit` s."""
    until(condition, limit)


def wait_for(stream: StreamedCall[..., V], condition: Callable[[V], bool]) -> V:
    """Return the first value of a stream that meets a condition; raise AssertionError after the limit."""
    deadline = time.monotonic() + MOVE_LIMIT
    value: V | None = None
    for sample in stream.samples(timeout=MOVE_LIMIT):
        value = sample.value
        if condition(value):
            return value
        if time.monotonic() > deadline:
            break
    raise AssertionError(f"not met in time; the last is {value}")
