"""A communicator over a transport that relays, and calls and samples whose payloads are passed on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from typing import Any

import msgspec
import pytest

from tests.support.calculator import CalculatorPrx, DivisionByZero, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.serving import serve
from zenoh_ice import Communicator, MarshalException, ObjectNotExistException, Settings
from zenoh_ice.data.exceptions import SystemException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.objects.proxy import Call
from zenoh_ice.objects.streams import Subscription
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Caller, Outcome

SUM = msgspec.msgpack.encode({"returnValue": 3.0})


class Relay(InProcessTransport):
    """Knows the calculator, and answers when it is waited for."""

    def __init__(self) -> None:
        super().__init__(Pool(0, "test"))
        self.relay = self
        self.asked: list[str] = []
        self.waiting: list[Callable[[], object]] = []

    def find(self, target: Target, type_id: str, timeout: float) -> Mapping[str, str]:
        self.asked.append(f"find {target}")
        if target.identity == "Absent":
            raise ObjectNotExistException("nobody of that name")
        return {type_id: CalculatorPrx.ice_interface.fingerprint}

    def wait(self, future: Future[Any], timeout: float | None) -> None:
        self.asked.append(f"wait {timeout}")
        while self.waiting:
            self.waiting.pop()()

    def caller(
        self,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,
    ) -> Caller:
        return RelayedCaller(self, timeout)


class RelayedCaller:
    def __init__(self, relay: Relay, timeout: float) -> None:
        self.relay = relay
        self.timeout = timeout

    def call(self, payload: bytes) -> Outcome:
        return True, SUM

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        self.relay.waiting.append(lambda: done((True, SUM)))
        return lambda: None


def over(transport: InProcessTransport) -> Communicator:
    return Communicator(Settings(clock="wall"), pool=transport.pool, transport=lambda _: transport)


def test_a_relay_finds_servants_and_decides_how_long_results_are_waited_for() -> None:
    relay = Relay()
    with over(relay) as communicator:
        calculator = CalculatorPrx.checkedCast(communicator.stringToProxy("Calculator"))
        assert calculator.add(1.0, 2.0) == 3.0
        assert relay.asked == ["find Calculator@nao"]
        future = calculator.add.begin(1.0, 2.0)
        assert not future.done()
        assert future.result(4.0) == future.result() == 3.0
        assert calculator.add.begin(1.0, 2.0).exception() is None
        assert relay.asked[1:] == ["wait 4.0", "wait None"]
        with pytest.raises(ObjectNotExistException, match="nobody of that name"):
            CalculatorPrx.checkedCast(communicator.stringToProxy("Absent"))


def test_a_wait_that_a_relay_gives_up_ends_at_once() -> None:
    relay = Relay()
    with over(relay) as communicator:
        calculator = CalculatorPrx.uncheckedCast(communicator.stringToProxy("Calculator"))
        future = calculator.add.begin(1.0, 2.0)
        relay.waiting.clear()
        with pytest.raises(TimeoutError):
            future.result()


@pytest.fixture
def served() -> Iterator[tuple[CalculatorPrx, CalculatorI]]:
    with Communicator(Settings(clock="wall"), pool=Pool(2, "test"), transport=InProcessTransport) as here:
        servant = CalculatorI()
        serve(here, servant, "Calculator")
        yield CalculatorPrx.checkedCast(here.stringToProxy("Calculator")), servant


def call_of(proxy: CalculatorPrx, operation: str) -> Call[..., Any]:
    found: Call[..., Any] = getattr(proxy, operation)
    return found


def test_encoded_calls_pass_payloads_and_raise_what_calls_raise(
    served: tuple[CalculatorPrx, CalculatorI],
) -> None:
    calculator, _ = served
    arguments = msgspec.msgpack.encode({"a": 1.0, "b": 2.0})
    add, divide = call_of(calculator, "add"), call_of(calculator, "divide")
    assert add.call_encoded(arguments) == SUM
    assert add.begin_encoded(arguments).result(CALL_LIMIT) == SUM
    by_zero = msgspec.msgpack.encode({"a": 1.0, "b": 0.0})
    with pytest.raises(DivisionByZero):
        divide.call_encoded(by_zero)
    with pytest.raises(DivisionByZero):
        divide.begin_encoded(by_zero).result(CALL_LIMIT)
    with pytest.raises(MarshalException, match="at most 1048576 are sent"):
        add.call_encoded(bytes(1 << 21))
    with pytest.raises(ObjectNotExistException, match="there is Calculator"):
        call_of(
            CalculatorPrx.uncheckedCast(calculator.ice_getCommunicator().stringToProxy("Absent")), "add"
        ).call_encoded(arguments)


def test_encoded_samples_are_payloads_and_stand_beside_decoded_ones(
    served: tuple[CalculatorPrx, CalculatorI],
) -> None:
    calculator, servant = served
    streams = calculator.ice_getCommunicator().streams
    operation = CalculatorPrx.ice_interface.all_operations["getReading"]
    reader = streams.reader(Target("nao", "Calculator"), operation, encoded=True)
    assert calculator.getReading.latest() is reader.latest() is None
    seen: list[object] = []
    with Subscription(reader, lambda sample: seen.append(sample.value)):
        servant.getReadingPublisher.publish(Reading(7, []))
        decoded = calculator.getReading.wait(timeout=EVENT_LIMIT)
        encoded = reader.wait(None, EVENT_LIMIT)
    assert decoded.value == Reading(7, [])
    assert msgspec.msgpack.decode(encoded.value) == {"returnValue": {"count": 7, "values": []}}
    assert (encoded.sequence, encoded.stream) == (decoded.sequence, decoded.stream)
    assert seen == [encoded.value]
