"""Call a robot that is served as NAOqi, like a program written for NAOqi."""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import qi

from tests.support.limits import CALL_LIMIT, MOVE_LIMIT
from visualhfsm_naoqi._libqi import start_libqi
from visualhfsm_naoqi.robot import calls
from visualhfsm_naoqi.robot._libqi_link import connect
from visualhfsm_naoqi.robot._link import RobotAddress
from visualhfsm_naoqi.robot.calls import CallLink, Reply

__all__ = ["call", "connect_patiently", "connected", "eventually_near"]

call = functools.partial(calls.call, timeout=CALL_LIMIT)
"""Return what NAOqi answers, on a busy machine, too."""


@contextmanager
def connected(url: str) -> Iterator[Any]:
    """Open a session and close it at the end."""
    start_libqi()
    session = qi.Session()
    session.connect(url)
    try:
        yield session
    finally:
        session.close()


def eventually_near(measure: Callable[[], float], value: float, tolerance: float) -> None:
    """Wait until a measurement is near a value; raise AssertionError after the limit."""
    deadline = time.monotonic() + MOVE_LIMIT
    while abs((measured := measure()) - value) > tolerance:
        assert time.monotonic() < deadline, f"it is {measured}, not {value}"
        time.sleep(0.01)


def connect_patiently(address: RobotAddress) -> CallLink:
    """Connect to a robot that may answer slowly on a busy machine without being reported as lost."""
    return _PatientLink(connect(address, CALL_LIMIT))


class _PatientLink:
    """A link whose answers may take CALL_LIMIT. Implements CallLink."""

    def __init__(self, link: CallLink) -> None:
        self._link = link

    @property
    def lost(self) -> threading.Event:
        return self._link.lost

    def begin(self, operation: str, *arguments: object) -> Reply:
        return _PatientReply(self._link.begin(operation, *arguments))

    def close(self) -> None:
        self._link.close()


class _PatientReply:
    """An answer with a longer limit. Implements Reply."""

    def __init__(self, reply: Reply) -> None:
        self._reply = reply

    @property
    def done(self) -> bool:
        return self._reply.done

    def result(self, timeout: float) -> Any:
        return self._reply.result(max(timeout, CALL_LIMIT))
