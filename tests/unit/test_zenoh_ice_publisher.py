"""Publishers without a network: numbers, and who publishes while he hears of a sample."""

from __future__ import annotations

from typing import Final, cast

import pytest

from tests.support.calculator import Reading
from tests.support.calculator_servant import CalculatorI
from zenoh_ice import MarshalException
from zenoh_ice.streams.publisher import Channel
from zenoh_ice.wire.pieces import Pieces


class Echo:
    """A channel whose listener publishes something else at the first sample, before it has taken that."""

    listening: Final = True

    def __init__(self, servant: CalculatorI, size_limit: int) -> None:
        self.size_limit: Final = size_limit
        self.numbers: list[int] = []
        self._servant: Final = servant

    def send(self, payload: bytes | Pieces, number: int, robot_time: float) -> None:
        self.numbers.append(number)
        if number == 1:
            self._servant.getReadingPublisher.publish(Reading(2, []))


def attached(size_limit: int) -> tuple[CalculatorI, Echo]:
    servant = CalculatorI()
    echo = Echo(servant, size_limit)
    servant.getReadingPublisher.attach(cast("Channel", echo))
    return servant, echo


def test_listener_may_publish_in_turn() -> None:
    servant, echo = attached(1 << 20)
    servant.getReadingPublisher.publish(Reading(1, []))
    assert echo.numbers == [1, 2]


def test_sample_that_is_too_large_has_no_number() -> None:
    """Otherwise listeners would take it for a loss."""
    servant, echo = attached(100)
    with pytest.raises(MarshalException, match="100 are sent"):
        servant.getReadingPublisher.publish(Reading(0, [0.5] * 100))
    servant.getReadingPublisher.publish(Reading(1, []))
    assert echo.numbers == [1, 2]
