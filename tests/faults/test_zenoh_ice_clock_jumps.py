"""Jumps of a clock: of the machine's date, and of the robot's time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from interfaces.nao import Clock, ClockReading
from tests.conftest import Pair
from tests.support.calculator import CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.waiting import listened, until
from zenoh_ice import Communicator, Current

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


class ClockI(Clock):
    """A robot's time, that a test sets."""

    def getTime(self, current: Current) -> ClockReading:
        return ClockReading(100.0, 0.0, True)


@pytest.mark.parametrize("time_after", [5.0, 1000.0], ids=["back", "ahead"])
def test_a_jump_of_the_robots_time_wakes_sleepers(
    endpoint: str, make_communicator: Callable[..., Communicator], time_after: float
) -> None:
    servant = ClockI()
    adapter = make_communicator(listen=[endpoint]).createObjectAdapter("Robot")
    adapter.add(servant, "Clock")
    adapter.activate()
    clock = make_communicator(connect=[endpoint], clock="sim").clock
    assert listened(servant.getTimePublisher, EVENT_LIMIT)
    assert clock.now() == 100.0  # the robot's time stands still
    asleep, awake = threading.Event(), threading.Event()

    def sleep() -> None:
        asleep.set()
        clock.sleep(800.0)
        awake.set()

    sleeper = threading.Thread(target=sleep)
    sleeper.start()
    assert asleep.wait(EVENT_LIMIT)
    assert not awake.is_set()

    def woken() -> bool:
        servant.getTimePublisher.publish(ClockReading(time_after, 0.0, True))
        return awake.wait(0.01)

    until(woken)
    sleeper.join(EVENT_LIMIT)
    assert clock.now() == time_after


def test_the_robots_time_goes_on_while_nothing_is_heard_of_it(
    endpoint: str, make_communicator: Callable[..., Communicator], caplog: pytest.LogCaptureFixture
) -> None:
    servant = ClockI()
    adapter = make_communicator(listen=[endpoint]).createObjectAdapter("Robot")
    adapter.add(servant, "Clock")
    adapter.activate()
    clock = make_communicator(connect=[endpoint], clock="sim").clock
    assert listened(servant.getTimePublisher, EVENT_LIMIT)
    servant.getTimePublisher.publish(ClockReading(200.0, 50.0, True))
    until(lambda: clock.rate == 50.0)
    until(lambda: clock.now() > 260.0)  # more than a second of silence
    assert "no sample of the robot's clock" in caplog.text
    servant.getTimePublisher.publish(ClockReading(5.0, 1.0, True))
    until(lambda: clock.rate == 1.0)
    assert clock.now() < 200.0
