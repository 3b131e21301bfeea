"""The delivery of samples to subscribers: rates, queues, and losses."""

from __future__ import annotations

import asyncio
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import pytest

from tests.support.calculator import CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.suite import Pair
from tests.support.waiting import listened, until
from zenoh_ice import (
    CommunicatorDestroyedException,
    ConfigurationException,
    ObjectNotExistException,
    Sample,
    TimeoutException,
)


class Collector:
    """A callback that keeps its samples, and blocks its caller until it is released."""

    def __init__(self) -> None:
        self.samples: list[Sample[Reading]] = []
        self.free = threading.Event()
        self.free.set()
        self._changed = threading.Condition()

    def __call__(self, sample: Sample[Reading]) -> None:
        with self._changed:
            self.samples.append(sample)
            self._changed.notify_all()
        self.free.wait(FOREVER)

    @property
    def counts(self) -> list[int]:
        return [sample.value.count for sample in self.samples]

    def wait(self, happened: Callable[[], bool]) -> None:
        with self._changed:
            assert self._changed.wait_for(happened, EVENT_LIMIT)

    def wait_for(self, count: int) -> None:
        self.wait(partial(self._has, count))

    def wait_until_there_are(self, number: int) -> None:
        self.wait(lambda: len(self.samples) >= number)

    def _has(self, count: int) -> bool:
        return count in self.counts


def publish(servant: CalculatorI, *counts: int) -> None:
    for count in counts:
        servant.getReadingPublisher.publish(Reading(count, []))


class TestQueue:
    @pytest.mark.parametrize("queue", [1, 10])
    def test_busy_callback_gets_as_many_of_the_newest_as_its_queue_is_long(
        self, calculator: CalculatorPrx, servant: CalculatorI, queue: int
    ) -> None:
        collector = Collector()
        collector.free.clear()
        options = {} if queue == 1 else {"queue": queue}
        with calculator.getReading.subscribe(collector, **options) as subscription:
            assert listened(servant.getReadingPublisher, EVENT_LIMIT)
            publish(servant, 0)
            collector.wait_for(0)
            calculator.getReading.latest()  # listens from now on
            publish(servant, *range(1, 100))
            wait_until_latest_is(calculator, 99)
            collector.free.set()
            collector.wait_for(99)
            assert collector.counts == [0, *range(100 - queue, 100)]
            assert [sample.lost for sample in collector.samples] == [0, 99 - queue, *[0] * (queue - 1)]
            assert subscription.lost == 99 - queue
            assert subscription.received == queue + 1

    def test_a_new_stream_has_lost_nothing(
        self, pair: Pair, calculator: CalculatorPrx, servant: CalculatorI
    ) -> None:
        collector = Collector()
        with calculator.getReading.subscribe(collector) as subscription:
            assert listened(servant.getReadingPublisher, EVENT_LIMIT)
            publish(servant, 1)
            collector.wait_for(1)
            pair.adapter.removeAll(["Calculator"])
            again = CalculatorI()
            for count in range(2, 5):  # nobody listens: these are not sent
                publish(again, count)
            pair.adapter.add(again, "Calculator")
            assert listened(again.getReadingPublisher, EVENT_LIMIT)
            publish(again, 5)
            collector.wait_for(5)
            assert subscription.lost == 0


def test_threads_that_publish_at_once_lose_nothing(calculator: CalculatorPrx, servant: CalculatorI) -> None:
    publisher = servant.getReadingPublisher
    collector = Collector()
    with calculator.getReading.subscribe(collector, queue=10_000) as subscription:
        assert listened(publisher, EVENT_LIMIT)
        switch_interval = sys.getswitchinterval()
        sys.setswitchinterval(1e-5)
        try:
            for sent in range(200, 2001, 200):  # a link that is behind by more may drop some
                threads = [threading.Thread(target=publish, args=(servant, *range(50))) for _ in range(4)]
                for thread in threads:
                    thread.start()
                for thread in threads:
                    thread.join(EVENT_LIMIT)
                collector.wait_until_there_are(sent)
        finally:
            sys.setswitchinterval(switch_interval)
        assert [sample.sequence for sample in collector.samples] == list(range(1, 2001))
        assert subscription.lost == 0


def wait_until_latest_is(calculator: CalculatorPrx, count: int) -> None:
    """Wait until the newest sample has reached all subscriptions of this process."""
    until(lambda: (sample := calculator.getReading.latest()) is not None and sample.value.count == count)
    # Its answer comes after that sample, which goes to one subscription after the other.
    calculator.add(1.0, 2.0)


class TestRate:
    def test_callback_gets_no_more_than_its_rate_and_the_last(
        self, calculator: CalculatorPrx, servant: CalculatorI
    ) -> None:
        collector = Collector()
        with calculator.getReading.subscribe(collector, rate=20.0):
            assert listened(servant.getReadingPublisher, EVENT_LIMIT)
            began = time.monotonic()
            publish(servant, 0)
            collector.wait_for(0)
            for count in range(1, 200):
                publish(servant, count)
                time.sleep(0.002)
            collector.wait_for(199)  # though nothing comes after it
            assert len(collector.samples) <= 20.0 * (time.monotonic() - began) + 1

    def test_loop_gets_no_more_than_its_rate(self, calculator: CalculatorPrx, servant: CalculatorI) -> None:
        with publishing(servant):
            began = time.monotonic()
            samples = calculator.getReading.samples(EVENT_LIMIT, rate=50.0)
            for _ in range(10):
                next(samples)
            assert time.monotonic() - began >= 9 / 50.0

    @pytest.mark.parametrize("rate", [0.0, -1.0, 1e-300, float("nan"), float("inf")])
    def test_rate_that_is_none_is_refused(self, calculator: CalculatorPrx, rate: float) -> None:
        with pytest.raises(ConfigurationException, match="rate"):
            calculator.getReading.subscribe(print, rate=rate)
        with pytest.raises(ConfigurationException, match="rate"):
            calculator.getReading.samples(rate=rate)

    @pytest.mark.parametrize("options", [{"queue": 0}, {"queue": 1 << 20}, {"queue": 2.5}])
    def test_numbers_out_of_range_are_refused(
        self, calculator: CalculatorPrx, options: dict[str, Any]
    ) -> None:
        with pytest.raises(ConfigurationException, match=f"{next(iter(options))} is from"):
            calculator.getReading.subscribe(print, **options)


class publishing:
    """Publish one sample after the other, until the end of the block."""

    def __init__(self, servant: CalculatorI) -> None:
        self._servant = servant
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join(EVENT_LIMIT)

    def _run(self) -> None:
        count = 0
        while not self._ended.wait(0.001):
            publish(self._servant, count)
            count += 1


class TestAsyncio:
    def test_loop_over_a_stream(self, calculator: CalculatorPrx, servant: CalculatorI) -> None:
        async def read() -> list[Sample[Reading]]:
            samples = []
            async for sample in calculator.getReading.samples():
                samples.append(sample)
                if len(samples) == 5:
                    break
            return samples

        with publishing(servant):
            samples = asyncio.run(read())
        counts = [sample.value.count for sample in samples]
        assert counts == sorted(set(counts))
        for before, sample in pairwise(samples):
            assert sample.lost == sample.sequence - before.sequence - 1

    def test_other_tasks_go_on(self, calculator: CalculatorPrx, servant: CalculatorI) -> None:
        async def wait_for(calculator: CalculatorPrx) -> int:
            async for sample in calculator.getReading.samples(EVENT_LIMIT):
                return sample.value.count
            raise AssertionError

        async def both() -> list[int]:
            waiting = [asyncio.create_task(wait_for(calculator)) for _ in range(2)]
            while not servant.getReadingPublisher.listening:
                await asyncio.sleep(0.001)
            with publishing(servant):
                return await asyncio.wait_for(asyncio.gather(*waiting), EVENT_LIMIT)

        assert len(asyncio.run(both())) == 2

    def test_rate(self, calculator: CalculatorPrx, servant: CalculatorI) -> None:
        async def read() -> float:
            began = time.monotonic()
            count = 0
            async for _ in calculator.getReading.samples(EVENT_LIMIT, rate=50.0):
                count += 1
                if count == 10:
                    break
            return time.monotonic() - began

        with publishing(servant):
            assert asyncio.run(read()) >= 9 / 50.0

    def test_silence_is_reported(self, calculator: CalculatorPrx, servant: CalculatorI) -> None:
        with pytest.raises(TimeoutException, match=r"no new sample of Calculator.getReading within 0.05 s"):
            asyncio.run(first(calculator, 0.05))

    def test_absence_is_reported(self, pair: Pair) -> None:
        absent = CalculatorPrx.uncheckedCast(pair.client.stringToProxy("Absent"))
        with pytest.raises(ObjectNotExistException):
            asyncio.run(first(absent, 0.05))

    def test_destroy_ends_the_wait(self, pair: Pair, servant: CalculatorI) -> None:
        calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))

        async def destroyed() -> None:
            waiting = asyncio.create_task(first(calculator, FOREVER))
            while not servant.getReadingPublisher.listening:
                await asyncio.sleep(0.001)
            await asyncio.to_thread(pair.client.destroy)
            await waiting

        with pytest.raises(CommunicatorDestroyedException):
            asyncio.run(destroyed())

    def test_servant_may_stop_publishing_after_the_loop(
        self, calculator: CalculatorPrx, servant: CalculatorI
    ) -> None:
        with publishing(servant):
            asyncio.run(first(calculator, EVENT_LIMIT))
        until(lambda: not servant.getReadingPublisher.listening)


async def first(calculator: CalculatorPrx, timeout: float) -> Sample[Reading]:
    async for sample in calculator.getReading.samples(timeout):
        return sample
    raise AssertionError
