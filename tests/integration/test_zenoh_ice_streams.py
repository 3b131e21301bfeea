"""Streams between two sessions over loopback."""

from __future__ import annotations

import gc
import logging
import math
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from queue import SimpleQueue

import msgspec
import pytest

from tests.support.calculator import CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limited import limited, limited_pair
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.stranger import session_of
from tests.support.suite import Pair
from tests.support.waiting import at_once, listened, until
from zenoh_ice import (
    Communicator,
    CommunicatorDestroyedException,
    ConfigurationException,
    MarshalException,
    ObjectNotExistException,
    Sample,
    TimeoutException,
)
from zenoh_ice.threads.limits import LIMITS, Limits


@pytest.fixture
def limits() -> Limits:
    """The limits of the pair: those of every day, unless a test is marked otherwise."""
    return LIMITS


@pytest.fixture
def pair(endpoint: str, make_communicator: Callable[..., Communicator], limits: Limits) -> Pair:
    return limited_pair(endpoint, make_communicator, limits)


@pytest.fixture(params=["remote", "collocated"])
def calculator(request: pytest.FixtureRequest, pair: Pair, servant: CalculatorI) -> CalculatorPrx:
    communicator = pair.client if request.param == "remote" else pair.server
    return CalculatorPrx.checkedCast(communicator.stringToProxy("Calculator"))


def listen(calculator: CalculatorPrx, servant: CalculatorI) -> None:
    """Subscribe and wait until the servant knows."""

    def known() -> bool:
        assert calculator.getReading.latest() is None  # again: a stream that nobody asks for is released
        return servant.getReadingPublisher.listening

    until(known)


def latest(calculator: CalculatorPrx, count: int) -> Sample[Reading]:
    """Wait for a sample by `latest` alone."""
    found: list[Sample[Reading] | None] = []

    def arrived() -> bool:
        found[:] = [calculator.getReading.latest()]
        return found[0] is not None and found[0].value.count == count

    until(arrived)
    assert found[0] is not None
    return found[0]


def publish_until_heard(calculator: CalculatorPrx, servant: CalculatorI, count: int) -> None:
    """Publish repeatedly: on a busy machine an unused stream may be released in between."""

    def heard() -> bool:
        servant.getReadingPublisher.publish(Reading(count, []))
        sample = calculator.getReading.latest()
        return sample is not None and sample.value.count == count

    until(heard)


def test_call_and_stream_share_a_name(calculator: CalculatorPrx, servant: CalculatorI) -> None:
    servant.counted = 3
    assert calculator.getReading() == Reading(3, [3.0])
    assert calculator.getReading.__doc__ == "Return the newest reading."


def test_latest_is_the_newest_with_its_age_and_times(calculator: CalculatorPrx, servant: CalculatorI) -> None:
    listen(calculator, servant)
    before = time.time()
    servant.getReadingPublisher.publish(Reading(1, []), time=12.5)
    assert latest(calculator, 1).time == 12.5
    servant.getReadingPublisher.publish(Reading(2, [0.5]))
    sample = latest(calculator, 2)
    assert sample.value == Reading(2, [0.5])
    assert sample.sequence == 2
    assert math.isnan(sample.time)
    assert before <= sample.wall_time <= time.time()
    assert 0.0 <= sample.age <= time.time() - before
    assert calculator.getReading.latest() is sample  # decoded once


def test_wait_takes_what_is_there_and_after_a_sample_a_newer_one(
    calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    listen(calculator, servant)
    servant.getReadingPublisher.publish(Reading(1, []))
    first = latest(calculator, 1)
    assert calculator.getReading.wait(timeout=EVENT_LIMIT) is first
    with pytest.raises(TimeoutException, match=r"no new sample of Calculator.getReading within 0.05 s"):
        calculator.getReading.wait(after=first, timeout=0.05)
    servant.getReadingPublisher.publish(Reading(2, []))
    assert calculator.getReading.wait(after=first, timeout=EVENT_LIMIT).value.count == 2
    assert calculator.getReading.latest().value.count == 2  # type: ignore[union-attr]


def test_wait_after_a_sample_of_a_subscription_takes_a_newer_one(
    calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    listen(calculator, servant)
    seen: SimpleQueue[Sample[Reading]] = SimpleQueue()
    with calculator.getReading.subscribe(seen.put):
        servant.getReadingPublisher.publish(Reading(1, []))
        first = seen.get(timeout=EVENT_LIMIT)
        with pytest.raises(TimeoutException):
            calculator.getReading.wait(after=first, timeout=0.05)
        servant.getReadingPublisher.publish(Reading(2, []))
        assert calculator.getReading.wait(after=first, timeout=EVENT_LIMIT).value.count == 2
        with pytest.raises(TimeoutException):
            calculator.getReading.wait(after=seen.get(timeout=EVENT_LIMIT), timeout=0.05)


@pytest.mark.parametrize("timeout", [-1.0, math.nan])
def test_wait_of_no_length_is_refused(calculator: CalculatorPrx, timeout: float) -> None:
    with pytest.raises(ConfigurationException, match="0 s or more"):
        calculator.getReading.wait(timeout=timeout)
    with pytest.raises(ConfigurationException, match="0 s or more"):
        calculator.getReading.samples(timeout)


def test_wait_may_be_without_an_end(calculator: CalculatorPrx, servant: CalculatorI) -> None:
    listen(calculator, servant)
    publishing = threading.Timer(0.05, servant.getReadingPublisher.publish, [Reading(1, [])])
    publishing.start()
    assert calculator.getReading.wait(timeout=math.inf).value.count == 1
    publishing.join(EVENT_LIMIT)


def test_samples_yields_the_newest_to_a_slow_reader(calculator: CalculatorPrx, servant: CalculatorI) -> None:
    listen(calculator, servant)
    samples = calculator.getReading.samples(timeout=EVENT_LIMIT)
    servant.getReadingPublisher.publish(Reading(0, []))
    assert next(samples).value.count == 0
    for count in range(1, 500):
        servant.getReadingPublisher.publish(Reading(count, []))
    latest(calculator, 499)
    servant.getReadingPublisher.publish(Reading(500, []))
    assert next(samples).value.count >= 499


def test_callback_may_close_its_subscription_and_call(
    calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    done = threading.Event()
    sums: list[float] = []

    def callback(_: Sample[Reading]) -> None:
        sums.append(calculator.add(1.0, 2.0))
        followed.close()
        done.set()

    followed = calculator.getReading.subscribe(callback)
    assert listened(servant.getReadingPublisher, EVENT_LIMIT)
    servant.getReadingPublisher.publish(Reading(1, []))
    assert done.wait(EVENT_LIMIT)
    assert sums == [3.0]


def test_slow_callback_delays_no_call(calculator: CalculatorPrx, servant: CalculatorI) -> None:
    entered, leave = threading.Event(), threading.Event()

    def callback(_: Sample[Reading]) -> None:
        entered.set()
        leave.wait(FOREVER)

    with calculator.getReading.subscribe(callback):
        assert listened(servant.getReadingPublisher, EVENT_LIMIT)
        for count in range(600):  # more than any queue between holds
            servant.getReadingPublisher.publish(Reading(count, []))
        assert entered.wait(EVENT_LIMIT)
        assert calculator.add(1.0, 2.0) == 3.0
        assert not leave.is_set()
        leave.set()


def test_servant_publishes_only_while_somebody_listens(pair: Pair, servant: CalculatorI) -> None:
    publisher = servant.getReadingPublisher
    encoded = Reading(1, [object()])  # type: ignore[list-item]
    assert not publisher.listening
    publisher.publish(encoded)  # never looked at
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    listen(calculator, servant)
    with pytest.raises(MarshalException, match="sample of getReading"):
        publisher.publish(encoded)
    pair.client.destroy()
    until(lambda: not publisher.listening)
    publisher.publish(encoded)


def wait_until_unheard(servant: CalculatorI) -> None:
    until(lambda: not servant.getReadingPublisher.listening)


def test_servant_stops_publishing_after_the_last_subscription(
    calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    publisher = servant.getReadingPublisher
    seen = threading.Event()
    first, last = (calculator.getReading.subscribe(lambda _: seen.set()) for _ in range(2))
    assert listened(publisher, EVENT_LIMIT)
    first.close()
    first.close()  # counts once
    publisher.publish(Reading(1, []))
    assert seen.wait(EVENT_LIMIT)
    last.close()
    wait_until_unheard(servant)
    seen.clear()
    with calculator.getReading.subscribe(lambda _: seen.set()):
        assert listened(publisher, EVENT_LIMIT)
        publisher.publish(Reading(2, []))
        assert seen.wait(EVENT_LIMIT)
    wait_until_unheard(servant)


@limited(linger=0.1)
def test_stream_that_nobody_asks_for_is_let_go_and_comes_back(
    calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    publisher = servant.getReadingPublisher
    for count in (1, 3):
        listen(calculator, servant)  # nothing stale is left of the last time
        publish_until_heard(calculator, servant, count)
        wait_until_unheard(servant)
        waiter = threading.Thread(target=calculator.getReading.wait, kwargs={"timeout": FOREVER})
        waiter.start()
        assert listened(publisher, EVENT_LIMIT)
        publisher.publish(Reading(count + 1, []))
        waiter.join(EVENT_LIMIT)
        assert not waiter.is_alive()
        wait_until_unheard(servant)


@limited(linger=0.02)
def test_streams_that_nobody_asks_for_are_forgotten(pair: Pair) -> None:
    """A program may follow a new stream every second."""
    for number in range(20):
        proxy = CalculatorPrx.uncheckedCast(pair.client.stringToProxy(f"Calculator{number}"))
        assert proxy.getReading.latest() is None
    del proxy

    until(lambda: not pair.client.streams.listening)
    gc.collect()
    assert not pair.client.streams._readers


def test_stream_is_shared_by_proxies_that_are_made_again(pair: Pair, servant: CalculatorI) -> None:
    def fresh() -> CalculatorPrx:
        return CalculatorPrx.uncheckedCast(pair.client.stringToProxy("Calculator"))

    assert fresh().getReading.latest() is None
    assert listened(servant.getReadingPublisher, EVENT_LIMIT)
    servant.getReadingPublisher.publish(Reading(1, []))
    until(lambda: fresh().getReading.latest() is not None)


@limited(linger=0.02)
def test_stream_that_somebody_waits_for_is_not_let_go(
    calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    with pytest.raises(TimeoutException):
        calculator.getReading.wait(timeout=0.15)
    seen = threading.Event()
    with calculator.getReading.subscribe(lambda _: seen.set()):
        assert listened(servant.getReadingPublisher, EVENT_LIMIT)
        assert calculator.getReading.latest() is None
        with pytest.raises(TimeoutException):
            calculator.getReading.wait(timeout=0.15)
        assert servant.getReadingPublisher.listening
        servant.getReadingPublisher.publish(Reading(1, []))
        assert seen.wait(EVENT_LIMIT)


@limited(linger=0.02)
def test_who_waits_long_gets_the_sample_that_comes_at_last(
    calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    got: list[Sample[Reading]] = []
    waiter = threading.Thread(target=lambda: got.append(calculator.getReading.wait(timeout=FOREVER)))
    waiter.start()
    assert listened(servant.getReadingPublisher, EVENT_LIMIT)
    waiter.join(0.15)
    servant.getReadingPublisher.publish(Reading(1, []))
    waiter.join(EVENT_LIMIT)
    assert [sample.value.count for sample in got] == [1]


@at_once
@limited(callback=FOREVER)
@pytest.mark.parametrize("identity", ["Calculator", "Absent"])
def test_subscription_closes_at_once_when_no_sample_arrives(
    pair: Pair, servant: CalculatorI, identity: str
) -> None:
    prx = CalculatorPrx.uncheckedCast(pair.client.stringToProxy(identity)).ice_invocationTimeout(
        FOREVER * 1000
    )
    with prx.getReading.subscribe(lambda _: None) as followed:
        followed.close()


def test_callback_is_called_until_closed_whatever_it_raises_which_is_logged_once(
    calculator: CalculatorPrx, servant: CalculatorI, caplog: pytest.LogCaptureFixture
) -> None:
    listen(calculator, servant)  # so that the stream goes on after the subscription
    seen: list[int] = []
    names: set[str] = set()
    arrived = threading.Condition()

    def callback(sample: Sample[Reading]) -> None:
        with arrived:
            seen.append(sample.value.count)
            names.add(threading.current_thread().name)
            arrived.notify_all()
        if sample.value.count != 3:
            raise SystemExit if sample.value.count < 5 else ValueError("the callback's own fault")

    with calculator.getReading.subscribe(callback):
        assert listened(servant.getReadingPublisher, EVENT_LIMIT)
        for count in range(1, 6):
            servant.getReadingPublisher.publish(Reading(count, []))
            with arrived:
                assert arrived.wait_for(partial(seen.__contains__, count), EVENT_LIMIT)
    raised = [each.exc_info[0] for each in caplog.records if each.exc_info]
    assert raised == [SystemExit, SystemExit, ValueError]  # at 1, 4 and 5: 3 worked
    assert "the callback's own fault" in caplog.text
    assert names == {"stream nao/Calculator/getReading"}
    servant.getReadingPublisher.publish(Reading(6, []))
    latest(calculator, 6)
    assert 6 not in seen


def test_publisher_may_be_had_before_the_servant_is_served(pair: Pair) -> None:
    servant = CalculatorI()
    publisher = servant.getReadingPublisher
    assert not publisher.listening
    pair.adapter.add(servant, "Calculator")
    listen(CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator")), servant)
    assert publisher.listening


def test_servant_of_two_identities_publishes_on_both(pair: Pair, servant: CalculatorI) -> None:
    pair.adapter.add(servant, "Twin")
    twin = CalculatorPrx.checkedCast(pair.client.stringToProxy("Twin"))
    listen(twin, servant)
    servant.getReadingPublisher.publish(Reading(7, []))
    assert latest(twin, 7)


def test_sample_that_does_not_fit_is_reported_once(
    pair: Pair, calculator: CalculatorPrx, servant: CalculatorI
) -> None:
    listen(calculator, servant)
    servant.getReadingPublisher.publish(Reading(1, []))
    good = latest(calculator, 1)
    payload = msgspec.msgpack.encode({"returnValue": {"count": "one", "values": []}})
    session_of(pair.server).put("nao/Calculator/getReading", payload)
    with pytest.raises(MarshalException) as caught:  # noqa: PT012
        for _ in range(10_000):
            calculator.getReading.latest()
            time.sleep(0.005)
    assert caught.value.path == "$.returnValue.count"
    assert calculator.getReading.latest() is good


def test_subscription_logs_bad_samples_once_until_a_good_one(
    pair: Pair, calculator: CalculatorPrx, servant: CalculatorI, caplog: pytest.LogCaptureFixture
) -> None:
    bad = msgspec.msgpack.encode({"returnValue": {"count": "one", "values": []}})
    seen: list[int] = []
    arrived = threading.Condition()

    def callback(sample: Sample[Reading]) -> None:
        with arrived:
            seen.append(sample.value.count)
            arrived.notify_all()

    with caplog.at_level(logging.WARNING, "zenoh_ice"), calculator.getReading.subscribe(callback):
        assert listened(servant.getReadingPublisher, EVENT_LIMIT)

        def reported(times: int) -> bool:
            """Send a bad sample; return whether so many were logged. A newer sample may take its place."""
            session_of(pair.server).put("nao/Calculator/getReading", bad)
            return len(caplog.records) == times

        for count in (1, 2):
            until(partial(reported, count))
            for _ in range(10):
                assert reported(count)
                time.sleep(0.005)  # so that not all of them are skipped
            servant.getReadingPublisher.publish(Reading(count, []))
            with arrived:
                assert arrived.wait_for(partial(seen.__contains__, count), EVENT_LIMIT)
    assert len(caplog.records) == 2
    assert "sample of Calculator.getReading" in caplog.text


def test_oversized_sample_is_reported(pair: Pair, calculator: CalculatorPrx, servant: CalculatorI) -> None:
    listen(calculator, servant)
    with pytest.raises(MarshalException, match="1048577 bytes; at most"):  # noqa: PT012
        for moment in range(10_000):
            if moment % 200 == 0:  # a busy link drops a sample
                session_of(pair.server).put("nao/Calculator/getReading", bytes((1 << 20) + 1))
            calculator.getReading.latest()
            time.sleep(0.005)


def test_wait_on_an_absent_servant_says_so(pair: Pair) -> None:
    absent = CalculatorPrx.uncheckedCast(pair.client.stringToProxy("Absent"))
    with pytest.raises(ObjectNotExistException):
        absent.getReading.wait(timeout=0.1)


def _switches(thread: threading.Thread) -> int:
    """Return how often a thread has gone to sleep."""
    status = Path(f"/proc/self/task/{thread.native_id}/status").read_text()
    return int(status.partition("\nvoluntary_ctxt_switches:")[2].split()[0])


def test_ctrl_c_at_the_start_of_a_wait_is_all_that_is_raised(
    pair: Pair, servant: CalculatorI, monkeypatch: pytest.MonkeyPatch
) -> None:
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))

    start = threading.Thread.start

    def interrupted(thread: threading.Thread) -> None:
        if thread.name.startswith("stream "):
            raise KeyboardInterrupt
        start(thread)

    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", interrupted)
        with pytest.raises(KeyboardInterrupt):
            calculator.getReading.wait(timeout=EVENT_LIMIT)
    pair.client.destroy()


def test_subscription_waits_for_an_absent_servant_in_silence(
    pair: Pair, caplog: pytest.LogCaptureFixture
) -> None:
    absent = CalculatorPrx.uncheckedCast(pair.client.stringToProxy("Calculator")).ice_invocationTimeout(10)
    seen = threading.Event()
    with (
        caplog.at_level(logging.WARNING, "zenoh_ice"),
        absent.getReading.subscribe(lambda _: seen.set()),
    ):
        (thread,) = (thread for thread in threading.enumerate() if thread.name.startswith("stream "))
        before = _switches(thread)
        assert not seen.wait(0.5)
        assert _switches(thread) - before < 25  # it sleeps: asking every 20 ms would take more
        servant = CalculatorI()
        pair.adapter.add(servant, "Calculator")
        assert listened(servant.getReadingPublisher, EVENT_LIMIT)
        servant.getReadingPublisher.publish(Reading(1, []))
        assert seen.wait(EVENT_LIMIT)
    assert not caplog.records


def test_stream_may_be_followed_before_its_servant_is_there(pair: Pair) -> None:
    early = CalculatorPrx.uncheckedCast(pair.client.stringToProxy("Calculator"))
    assert early.getReading.latest() is None
    servant = CalculatorI()
    pair.adapter.add(servant, "Calculator")
    assert listened(servant.getReadingPublisher, EVENT_LIMIT)
    servant.getReadingPublisher.publish(Reading(1, []))
    assert early.getReading.wait(timeout=EVENT_LIMIT).value.count == 1


@pytest.mark.parametrize("rests", [False, True], ids=["before a sample", "between those of a slow loop"])
def test_destroy_ends_a_wait(pair: Pair, servant: CalculatorI, rests: bool) -> None:
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    first = threading.Event()
    outcome: list[BaseException] = []

    def follow() -> None:
        try:
            if not rests:
                calculator.getReading.wait(timeout=FOREVER)
            for _ in calculator.getReading.samples(FOREVER, rate=0.001):
                first.set()
        except CommunicatorDestroyedException as error:
            outcome.append(error)

    follower = threading.Thread(target=follow)
    follower.start()
    assert listened(servant.getReadingPublisher, EVENT_LIMIT)
    if rests:
        servant.getReadingPublisher.publish(Reading(1, []))
        assert first.wait(EVENT_LIMIT)
    pair.client.destroy()
    follower.join(EVENT_LIMIT)
    assert len(outcome) == 1


class TestSampleAsText:
    def test_short_value_is_shown(self) -> None:
        sample = Sample(Reading(3, [0.5]), 7, 1.25, 0.0)
        assert repr(sample) == "<sample 7 at 1.250 s: Reading(count=3, values=[0.5])>"

    def test_large_value_is_cut_before_it_is_formatted(self) -> None:
        class Large(bytes):
            def __repr__(self) -> str:
                raise AssertionError("all of it was formatted")

        text = repr(Sample({"pixels": Large(1 << 20), "more": [0.0] * (1 << 20)}, 1, 0.0, 0.0))
        assert len(text) < 300
        assert text.startswith("<sample 1 at 0.000 s: {'pixels': b'\\x00")
