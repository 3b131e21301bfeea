"""Futures of calls over loopback: waited for, awaited, cancelled, called back, and what ends them."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import CancelledError, Future, as_completed, wait

import pytest

from tests.support.calculator import CalculatorPrx, DivisionByZero
from tests.support.calculator_servant import CalculatorI
from tests.support.carriers import anywhere, is_used, over_both
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import Communicator, CommunicatorDestroyedException, TimeoutException


@pytest.fixture
def calculator(carrier: str, caller: Communicator, servant: CalculatorI) -> CalculatorPrx:
    proxy = CalculatorPrx.checkedCast(caller.stringToProxy("Calculator"))
    proxy.add(0.0, 0.0)  # the first call waits until the servant was found
    assert is_used(carrier)
    return proxy


@anywhere
class TestWaiting:
    def test_results_come_in_any_order(self, calculator: CalculatorPrx) -> None:
        futures = [calculator.add.begin(float(number), 1.0) for number in range(40)]
        assert [future.result() for future in reversed(futures)] == [40.0 - number for number in range(40)]

    def test_known_outcome_stays(self, calculator: CalculatorPrx) -> None:
        """It can be asked for again, is told to callbacks, and is not cancelled any more."""
        future = calculator.add.begin(1.0, 2.0)
        until(future.done)  # though nobody waits for it
        assert future.result(0.0) == future.result() == 3.0
        assert future.exception() is None
        assert not future.running()
        reported: list[float] = []
        future.add_done_callback(lambda done: reported.append(done.result()))
        assert reported == [3.0]
        assert not future.cancel()
        assert future.result() == 3.0

    def test_short_wait_raises_and_a_longer_one_has_the_result(
        self, calculator: CalculatorPrx, servant: CalculatorI
    ) -> None:
        future = calculator.sleep.begin(FOREVER)
        with pytest.raises(TimeoutError):
            future.result(0.01)
        with pytest.raises(TimeoutError):
            future.exception(0.01)
        assert not future.done()
        servant.leave.set()
        assert future.result(CALL_LIMIT) is None

    def test_several_threads_have_the_same_result(
        self, calculator: CalculatorPrx, servant: CalculatorI
    ) -> None:
        future = calculator.sleep.begin(FOREVER)
        results: list[object] = []
        threads = [
            threading.Thread(target=lambda wait: results.append(future.result(wait)), args=(limit,))
            for limit in (None, None, EVENT_LIMIT, FOREVER)
        ]
        for thread in threads:
            thread.start()
        assert servant.entered.wait(EVENT_LIMIT)
        servant.leave.set()
        for thread in threads:
            thread.join(EVENT_LIMIT)
        assert results == [None] * 4

    def test_several_futures_can_be_waited_for(self, calculator: CalculatorPrx) -> None:
        futures = [calculator.add.begin(float(number), 0.0) for number in range(20)]
        done, missing = wait(futures, EVENT_LIMIT)
        assert (len(done), len(missing)) == (20, 0)
        more = [calculator.add.begin(float(number), 0.0) for number in range(20)]
        assert sorted(future.result() for future in as_completed(more, EVENT_LIMIT)) == sorted(
            map(float, range(20))
        )

    def test_slow_calls_hold_up_no_others(self, pair: Pair, caller: Communicator) -> None:
        """Many more than there are threads that wait for replies."""
        slow, quick = CalculatorI(), CalculatorI()
        slow.ice_concurrent = True
        pair.adapter.add(slow, "Slow")
        pair.adapter.add(quick, "Quick")
        proxies = [CalculatorPrx.checkedCast(caller.stringToProxy(name)) for name in ("Slow", "Quick")]
        ended: list[object] = []
        sleeping = [proxies[0].sleep.begin(FOREVER) for _ in range(12)]
        for future in sleeping:
            future.add_done_callback(ended.append)
        results = [proxies[1].add.begin(float(number), 0.0) for number in range(30)]
        assert not wait(results, EVENT_LIMIT).not_done
        assert ended == []
        slow.leave.set()
        assert not wait(sleeping, EVENT_LIMIT).not_done

    def test_exception_is_that_of_the_call(self, calculator: CalculatorPrx) -> None:
        future = calculator.divide.begin(1.0, 0.0)
        assert isinstance(future.exception(), DivisionByZero)
        with pytest.raises(DivisionByZero):
            future.result()

    @pytest.mark.parametrize("limit", [None, FOREVER])
    def test_limit_of_the_call_ends_it(
        self, calculator: CalculatorPrx, servant: CalculatorI, limit: float | None
    ) -> None:
        future = calculator.ice_invocationTimeout(100).sleep.begin(FOREVER)
        with pytest.raises(TimeoutException):
            future.result(limit)
        servant.leave.set()


@anywhere
class TestCancelling:
    def test_wait_ends_at_once(self, calculator: CalculatorPrx, servant: CalculatorI) -> None:
        future = calculator.sleep.begin(FOREVER)
        assert servant.entered.wait(EVENT_LIMIT)
        ended = threading.Event()

        def look() -> None:
            with pytest.raises(CancelledError):
                future.result()
            ended.set()

        waiting = threading.Thread(target=look)
        waiting.start()
        reported = threading.Event()
        future.add_done_callback(lambda _: reported.set())
        assert future.cancel()
        assert ended.wait(EVENT_LIMIT)
        assert reported.wait(EVENT_LIMIT)
        assert future.cancelled()
        assert future.cancel()
        assert not wait([future], EVENT_LIMIT).not_done
        waiting.join(EVENT_LIMIT)
        servant.leave.set()

    def test_call_that_has_not_been_sent_can_be_cancelled(self, caller: Communicator) -> None:
        """The servant is looked for first."""
        proxy = CalculatorPrx.uncheckedCast(caller.stringToProxy("Late"))
        future = proxy.add.begin(1.0, 2.0)
        assert future.cancel()
        with pytest.raises(CancelledError):
            future.result(CALL_LIMIT)


@anywhere
class TestAsyncio:
    def test_calls_are_awaited(self, calculator: CalculatorPrx) -> None:
        async def calls() -> list[float]:
            assert await asyncio.wrap_future(calculator.add.begin(1.0, 1.0)) == 2.0
            futures = [calculator.add.begin(float(number), 0.0) for number in range(20)]
            return await asyncio.gather(*map(asyncio.wrap_future, futures))

        assert asyncio.run(calls()) == [float(number) for number in range(20)]

    def test_exception_is_raised_where_it_is_awaited(self, calculator: CalculatorPrx) -> None:
        async def call() -> None:
            await asyncio.wrap_future(calculator.divide.begin(1.0, 0.0))

        with pytest.raises(DivisionByZero):
            asyncio.run(call())

    def test_timeout_of_asyncio_cancels_the_call(
        self, calculator: CalculatorPrx, servant: CalculatorI
    ) -> None:
        futures: list[Future[None]] = []

        async def call() -> None:
            futures.append(calculator.sleep.begin(FOREVER))
            await asyncio.wait_for(asyncio.wrap_future(futures[0]), 0.05)

        with pytest.raises(TimeoutError):
            asyncio.run(call())
        assert futures[0].cancelled()
        servant.leave.set()


class TestTheEnd:
    @over_both
    @pytest.mark.parametrize("watched", [True, False])
    def test_communicator_that_is_destroyed_ends_all_calls(
        self, pair: Pair, servant: CalculatorI, watched: bool
    ) -> None:
        proxy = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
        futures = [proxy.sleep.begin(FOREVER) for _ in range(8)]
        assert servant.entered.wait(EVENT_LIMIT)
        reported = threading.Semaphore(0)
        if watched:
            for future in futures:
                future.add_done_callback(lambda _: reported.release())
        pair.client.destroy()
        for future in futures:
            with pytest.raises(CommunicatorDestroyedException):
                future.result(CALL_LIMIT)
            if watched:
                assert reported.acquire(timeout=EVENT_LIMIT)
        servant.leave.set()

    @anywhere
    def test_calls_that_wait_cost_no_threads(self, calculator: CalculatorPrx, servant: CalculatorI) -> None:
        calculator.add(1.0, 2.0)
        before = threading.active_count()
        futures = [calculator.sleep.begin(FOREVER) for _ in range(50)]
        assert servant.entered.wait(EVENT_LIMIT)
        assert threading.active_count() <= before + 4
        servant.leave.set()
        assert not wait(futures, EVENT_LIMIT).not_done
