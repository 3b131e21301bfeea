"""Wait for conditions without notification."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final

import pytest

from tests.support.calculator import CalculatorPrx
from tests.support.limits import EVENT_LIMIT, FOREVER, START_LIMIT
from zenoh_ice import Publisher, SystemException
from zenoh_ice.objects.home import Home
from zenoh_ice.routes._transport import ZenohTransport

__all__ = ["at_once", "call_until_it_works", "links", "listened", "until"]


at_once: Final = pytest.mark.timeout(FOREVER / 4)
"""A test in which something that is to end at once may wait FOREVER: it fails before that."""


def until(condition: Callable[[], object], limit: float = EVENT_LIMIT, *, step: float = 0.005) -> None:
    """Poll until a condition holds, every `step` s."""
    deadline = time.monotonic() + limit
    while not condition():
        assert time.monotonic() < deadline, "it did not come true in time"
        time.sleep(step)


def listened(publisher: Publisher[Any], limit: float) -> bool:
    """Wait until a stream has subscribers; return whether it has."""
    until(lambda: publisher.listening, limit)
    return True


def call_until_it_works(calculator: CalculatorPrx) -> None:
    """Call until the server answers correctly."""

    def works() -> bool:
        try:
            return calculator.add(1.0, 2.0) == 3.0
        except SystemException:
            return False

    until(works, START_LIMIT)


def links(communicator: Home) -> set[str]:
    """Return the ids of the processes that a communicator is linked to."""
    transport = communicator.transport
    assert isinstance(transport, ZenohTransport)
    return {str(link.zid) for link in transport.session.info.transports()}
