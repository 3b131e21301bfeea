"""Talk to what is served as NAOqi, as a program written for NAOqi does."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import qi

from naoserver.qi_service.libqi import start_libqi
from tests.support.limits import LIMIT

__all__ = ["connected", "eventually_near"]


@contextmanager
def connected(url: str) -> Iterator[Any]:
    """Open a session; close it at the end."""
    start_libqi()
    session = qi.Session()
    session.connect(url)
    try:
        yield session
    finally:
        session.close()


def eventually_near(measure: Callable[[], float], value: float, tolerance: float) -> None:
    """Wait until what is measured is near a value; AssertionError when it does not come there in time."""
    deadline = time.monotonic() + LIMIT
    while abs((measured := measure()) - value) > tolerance:
        assert time.monotonic() < deadline, f"it is {measured}, not {value}"
        time.sleep(0.01)
