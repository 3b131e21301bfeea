"""The transport within a process: without threads everything happens at once, and nothing is copied."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from tests.support.calculator import CALCULATOR, CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER, LONGEST_CALL
from tests.support.receivers import Taken, Taker
from tests.support.serving import serve
from tests.support.waiting import at_once
from zenoh_ice import (
    Communicator,
    CommunicatorDestroyedException,
    Current,
    ObjectNotExistException,
    Settings,
    TimeoutException,
)
from zenoh_ice.data.codec import LARGE, Parted
from zenoh_ice.data.keys import Target
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.limits import Limits
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Reply

TARGET = Target("nao", "Calculator")
ECHO = CALCULATOR.all_operations["echo"]


class Servant(Taker):
    """Answers with what it gets, or with something else, and notes the threads of its calls."""

    def __init__(self, answer: Any = b"") -> None:
        self.threads: list[threading.Thread] = []
        self._answer = answer

    def take(self, call: Taken, reply: Reply) -> Callable[[], object]:
        def execute() -> None:
            self.threads.append(threading.current_thread())
            reply(True, self._answer)

        return execute


@pytest.fixture
def transport() -> InProcessTransport:
    return InProcessTransport(Pool(0, "test"))


def test_without_threads_a_call_is_executed_by_who_calls(transport: InProcessTransport) -> None:
    servant = Servant(b"x")
    transport.serve(TARGET, servant)
    caller = transport.caller(TARGET, ECHO, timeout=1.0)
    outcomes: list[object] = []
    outcomes.append(caller.call(b""))
    caller.begin(b"", outcomes.append)
    assert outcomes == [(True, b"x")] * 2
    assert servant.threads == [threading.current_thread()] * 2


def test_without_threads_a_sample_is_delivered_by_who_publishes(transport: InProcessTransport) -> None:
    outlet = transport.publish(TARGET, ECHO)
    inlet = transport.subscribe(TARGET, ECHO)
    delivered: list[object] = []
    inlet.deliver(lambda sample: delivered.append((inlet.open(sample).payload, threading.current_thread())))
    outlet.put(b"x", b"")
    assert delivered == [(b"x", threading.current_thread())]


def test_samples_that_wait_are_delivered_first(transport: InProcessTransport) -> None:
    outlet = transport.publish(TARGET, ECHO)
    inlet = transport.subscribe(TARGET, ECHO, 2)
    for payload in (b"a", b"b"):
        outlet.put(payload, b"")
    delivered: list[object] = []
    inlet.deliver(lambda sample: delivered.append(sample.payload))
    outlet.put(b"c", b"")
    assert delivered == [b"a", b"b", b"c"]


@at_once
def test_a_sample_wakes_who_waits(transport: InProcessTransport) -> None:
    outlet = transport.publish(TARGET, ECHO)
    inlet = transport.subscribe(TARGET, ECHO)
    changed = threading.Condition()
    publishing = threading.Thread(target=outlet.put, args=(b"x", b""))

    def arrived() -> bool:
        if inlet.poll() is not None:
            return True
        publishing.start()  # the first time; there is no second one without a sample
        return False

    with changed:
        assert inlet.wait(changed, arrived, FOREVER)
    publishing.join(EVENT_LIMIT)


def test_a_callback_may_publish_in_turn(transport: InProcessTransport) -> None:
    outlet = transport.publish(TARGET, ECHO)
    inlet = transport.subscribe(TARGET, ECHO)
    delivered: list[bytes] = []

    def take(sample: Any) -> None:
        delivered.append(sample.payload)
        if len(delivered) < 3:
            outlet.put(sample.payload + b"!", b"")

    inlet.deliver(take)
    outlet.put(b"x", b"")
    assert delivered == [b"x", b"x!", b"x!!"]


def test_large_byte_sequences_are_not_copied(transport: InProcessTransport) -> None:
    data = bytes(2 * LARGE)
    transport.serve(TARGET, Servant(ECHO.result.gather_result(data, "it")))
    _, payload = transport.caller(TARGET, ECHO, timeout=1.0).call(b"")
    assert isinstance(payload, Parted)
    assert payload.large[0] is data


@pytest.fixture
def communicator() -> Communicator:
    return Communicator(
        Settings(clock="wall", timeout=LONGEST_CALL),
        pool=Pool(2, "test"),
        transport=InProcessTransport,
        limits=Limits(drain=0.1),
    )


def calculator(communicator: Communicator, servant: CalculatorI) -> CalculatorPrx:
    serve(communicator, servant, "Calculator")
    return CalculatorPrx.checkedCast(communicator.stringToProxy("Calculator"))


def test_a_communicator_stands_on_it_alone(communicator: Communicator) -> None:
    with communicator:
        servant = CalculatorI()
        proxy = calculator(communicator, servant)
        assert proxy.add(1.0, 2.0) == 3.0
        assert proxy.add.begin(1.0, 2.0).result(CALL_LIMIT) == 3.0
        assert proxy.getReading.latest() is None
        servant.getReadingPublisher.publish(Reading(7, []))
        assert proxy.getReading.wait(timeout=EVENT_LIMIT).value == Reading(7, [])
        with pytest.raises(ObjectNotExistException, match="there is Calculator"):
            communicator.stringToProxy("Absent").ice_ping()
        with pytest.raises(TimeoutException, match=r"Calculator\.sleep did not answer within 0\.05 s"):
            proxy.ice_invocationTimeout(50).sleep(FOREVER)
        servant.leave.set()


@pytest.mark.parametrize("waited", [0.04, 0.94, 0.97])
def test_a_call_has_no_more_time_than_its_wait_for_the_servant_left(
    communicator: Communicator, monkeypatch: pytest.MonkeyPatch, waited: float
) -> None:
    limits: list[float] = []

    class Timed(CalculatorI):
        def count(self, current: Current) -> int:
            limits.append(current.timeout)
            return 1

    with communicator:
        late = calculator(communicator, Timed()).ice_invocationTimeout(1000 * LONGEST_CALL)
        # A clock that goes on whenever it is read.
        clock = itertools.count(0.0, waited * LONGEST_CALL)
        monkeypatch.setattr("zenoh_ice.objects.proxy.time", SimpleNamespace(monotonic=lambda: next(clock)))
        assert late.count() == 1
    assert limits[0] <= (1.0 - waited) * LONGEST_CALL


def test_a_timeout_names_the_whole_limit_also_after_a_wait_for_the_servant(
    communicator: Communicator, monkeypatch: pytest.MonkeyPatch
) -> None:
    with communicator:
        servant = CalculatorI()
        late = calculator(communicator, servant).ice_invocationTimeout(500)
        clock = itertools.count(0.0, 0.45)
        monkeypatch.setattr("zenoh_ice.objects.proxy.time", SimpleNamespace(monotonic=lambda: next(clock)))
        with pytest.raises(TimeoutException, match=r"did not answer within 0\.5 s"):
            late.sleep(FOREVER)
        servant.leave.set()


@pytest.mark.slow
def test_the_end_of_its_communicator_ends_a_call_that_runs(communicator: Communicator) -> None:
    servant = CalculatorI()
    proxy = calculator(communicator, servant)
    outcomes: list[object] = []

    def call() -> None:
        try:
            proxy.sleep(FOREVER)
        except CommunicatorDestroyedException as error:
            outcomes.append(error)

    calling = threading.Thread(target=call)
    calling.start()
    assert servant.entered.wait(EVENT_LIMIT)
    ending = threading.Thread(target=communicator.destroy)
    ending.start()
    calling.join(EVENT_LIMIT)
    assert len(outcomes) == 1
    servant.leave.set()
    ending.join(EVENT_LIMIT)
