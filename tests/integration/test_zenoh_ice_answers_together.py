"""Answers to calls in flight that are sent in one message: none waits for a call that takes long."""

from __future__ import annotations

from concurrent.futures import Future
from queue import SimpleQueue
from typing import Any, Final

from tests.support.calculator import CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER

IN_FLIGHT: Final = 16
ROUNDS: Final = 20


def test_answers_do_not_wait_for_a_call_that_was_quick_before(
    calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    for _ in range(ROUNDS):
        servant.leave.clear()
        quick = [calculator.sleep.begin(0.0) for _ in range(IN_FLIGHT)]
        long = calculator.sleep.begin(FOREVER)
        assert [each.result(EVENT_LIMIT) for each in quick] == [None] * IN_FLIGHT
        assert not long.done()
        servant.leave.set()
        long.result(CALL_LIMIT)


def test_callback_of_a_future_may_wait_for_a_later_one(calculator: CalculatorPrx) -> None:
    for _ in range(ROUNDS):
        seen: SimpleQueue[float] = SimpleQueue()
        calls = [calculator.add.begin(1.0, float(number)) for number in range(IN_FLIGHT)]

        def wait_for_last(_: object, put: Any = seen.put, last: Future[float] = calls[-1]) -> None:
            put(last.result(CALL_LIMIT))

        calls[IN_FLIGHT // 2].add_done_callback(wait_for_last)
        assert seen.get(timeout=EVENT_LIMIT) == float(IN_FLIGHT)
        assert [each.result(CALL_LIMIT) for each in calls] == [1.0 + number for number in range(IN_FLIGHT)]
