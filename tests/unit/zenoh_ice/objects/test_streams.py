"""Publishers without a network: numbers, and publishing from within a subscription."""

from __future__ import annotations

from typing import Final

import pytest

from tests.support.calculator import Reading
from tests.support.calculator_servant import CalculatorI
from zenoh_ice import MarshalException
from zenoh_ice.data.codec import Pieces
from zenoh_ice.data.wire import decode_attachment


class Echo:
    """An outlet whose listener publishes something else at the first sample, before it has taken that."""

    listening: Final = True

    def __init__(self, servant: CalculatorI) -> None:
        self.numbers: list[int] = []
        self._servant: Final = servant

    def put(self, payload: bytes | Pieces, attachment: bytes) -> None:
        self.numbers.append(decode_attachment(attachment).sequence)
        if len(self.numbers) == 1:
            self._servant.getReadingPublisher.publish(Reading(2, []))

    def close(self) -> None:
        pass


def attached() -> tuple[CalculatorI, Echo]:
    servant = CalculatorI()
    echo = Echo(servant)
    servant.getReadingPublisher.attach(echo)
    return servant, echo


def test_listener_may_publish_in_turn() -> None:
    servant, echo = attached()
    servant.getReadingPublisher.publish(Reading(1, []))
    assert echo.numbers == [1, 2]


def test_sample_that_is_too_large_has_no_number() -> None:
    """Otherwise subscribers would count it as lost."""
    servant, echo = attached()
    with pytest.raises(MarshalException, match="1048576 are sent"):
        servant.getReadingPublisher.publish(Reading(0, [0.5] * 200_000))
    servant.getReadingPublisher.publish(Reading(1, []))
    assert echo.numbers == [1, 2]
