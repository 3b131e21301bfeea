"""Jumps of the machine's date."""

from __future__ import annotations

import time
from dataclasses import dataclass

import pytest

from tests.support.calculator import CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.suite import Pair
from tests.support.waiting import listened, until

HOUR = 3600.0  # s


@dataclass
class Date:
    """The machine's date as Python sees it."""

    set_by: float = 0.0


@pytest.fixture
def date(monkeypatch: pytest.MonkeyPatch) -> Date:
    date, genuine = Date(), time.time
    monkeypatch.setattr(time, "time", lambda: genuine() + date.set_by)
    return date


@pytest.mark.parametrize("jump", [-HOUR, HOUR])
def test_a_sample_ages_whatever_becomes_of_the_date(pair: Pair, date: Date, jump: float) -> None:
    servant = CalculatorI()
    pair.adapter.add(servant, "Calculator")
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    calculator.getReading.latest()
    assert listened(servant.getReadingPublisher, EVENT_LIMIT)
    servant.getReadingPublisher.publish(Reading(1, []))
    sample = calculator.getReading.wait(timeout=EVENT_LIMIT)
    before = sample.age
    date.set_by = jump
    assert before <= sample.age < HOUR
    until(lambda: sample.age > before)


@pytest.mark.parametrize("jump", [-HOUR, HOUR])
def test_calls_that_wait_are_executed_whatever_becomes_of_the_date(
    pair: Pair, date: Date, jump: float
) -> None:
    servant = CalculatorI()
    pair.adapter.add(servant, "Calculator")
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    busy = calculator.sleep.begin(FOREVER)
    assert servant.entered.wait(EVENT_LIMIT)
    waiting = calculator.count.begin()
    date.set_by = jump
    servant.leave.set()
    busy.result(CALL_LIMIT)
    assert waiting.result(EVENT_LIMIT) == 1
