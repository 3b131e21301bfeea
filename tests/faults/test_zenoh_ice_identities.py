"""Two processes that serve one identity, and a restarted server with another version."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from typing import ClassVar

import pytest

from tests.support.calculator import NEWER_CALCULATOR, CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import EVENT_LIMIT
from tests.support.processes import free_endpoint
from tests.support.serving import serve
from tests.support.waiting import listened, until
from zenoh_ice import Communicator, Current, InterfaceMismatchException, Object, Publisher, generated
from zenoh_ice.data.interface import Interface, Operation

MakeCommunicator = Callable[..., Communicator]


class TestTwoServers:
    @pytest.fixture
    def servers(self, make_communicator: MakeCommunicator) -> tuple[Communicator, Communicator]:
        """Two that serve a calculator, and do not know of each other."""
        first, second = (make_communicator(listen=[free_endpoint()]) for _ in range(2))
        for server in (first, second):
            serve(server, CalculatorI(), "Calculator")
        return first, second

    def test_those_that_meet_late_each_log_an_error_that_names_the_other(
        self,
        servers: tuple[Communicator, Communicator],
        make_communicator: MakeCommunicator,
        caplog: pytest.LogCaptureFixture,
    ) -> None:
        endpoints = [server.settings.listen[0] for server in servers]
        make_communicator(connect=endpoints)  # gossip makes them known to each other

        def reported() -> list[str]:
            errors = [record for record in caplog.records if record.levelno == logging.ERROR]
            return [record.getMessage() for record in errors]

        until(lambda: len(reported()) >= 2)
        assert len(reported()) == 2
        for server in servers:
            (message,) = (text for text in reported() if server.client_id in text)
            assert message.startswith("realm nao has two servers of Calculator: this process, and ")
            assert "(process " in message  # with its number, and the host
            assert "stop one" in message

    def test_of_many_identities_few_errors_are_logged(
        self, make_communicator: MakeCommunicator, caplog: pytest.LogCaptureFixture
    ) -> None:
        servers = [make_communicator(listen=[free_endpoint()]) for _ in range(2)]
        for server in servers:
            adapter = server.createObjectAdapter("Test")
            for number in range(40):
                adapter.add(CalculatorI(), f"Calculator{number}")
            adapter.activate()
        make_communicator(connect=[server.settings.listen[0] for server in servers])

        def reported() -> int:
            """Return how many identities the errors speak of."""
            errors = [
                re.fullmatch(r"realm nao has two servers of (.+?)(?: and (\d+) more)?: .*", text)
                for text in messages()
            ]
            return sum(len(match[1].split(", ")) + int(match[2] or 0) for match in errors if match)

        def messages() -> list[str]:
            return [record.getMessage() for record in caplog.records if record.levelno == logging.ERROR]

        until(lambda: reported() == 80)
        assert len(messages()) <= 2 * 16

    def test_once_one_is_stopped_the_other_says_so_and_serves_on(
        self,
        servers: tuple[Communicator, Communicator],
        make_communicator: MakeCommunicator,
        caplog: pytest.LogCaptureFixture,
    ) -> None:
        first, second = servers
        client = make_communicator(connect=[server.settings.listen[0] for server in servers])
        until(lambda: "has two servers of Calculator" in caplog.text)
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        first.destroy()
        until(lambda: f"session {first.client_id} no longer serves" in caplog.text)
        until(lambda: [info.server for info in client.servants()] == [second.client_id])
        assert calculator.add(1.0, 2.0) == 3.0


class NewerReading(generated.Struct):
    count: generated.Int


class _Result(generated.Struct):
    returnValue: NewerReading


class _Nothing(generated.Struct):
    pass


_get_reading: Operation[[], NewerReading] = Operation(
    "getReading", arguments=_Nothing, result=_Result, streamed=True, idempotent=True
)


class NewerCalculatorI(Object):
    """Of a newer version: its sums are of integers, its readings have fewer members."""

    ice_interface: ClassVar[Interface] = Interface(
        "::test::Calculator",
        operations=(*NEWER_CALCULATOR.operations, _get_reading),
        fingerprint=NEWER_CALCULATOR.fingerprint,
        module=NEWER_CALCULATOR.module,
    )

    def add(self, a: float, b: float, current: Current) -> float:
        return int(a) + b

    def getReading(self, current: Current) -> NewerReading:
        return NewerReading(1)

    @property
    def publisher(self) -> Publisher[NewerReading]:
        return self.ice_publisher(_get_reading)


def test_a_server_that_comes_back_with_another_version_is_refused_by_calls_and_streams(
    endpoint: str, make_communicator: MakeCommunicator, caplog: pytest.LogCaptureFixture
) -> None:
    client = make_communicator(connect=[endpoint])
    first, older = make_communicator(listen=[endpoint]), CalculatorI()
    serve(first, older, "Calculator")
    calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    received: list[int] = []
    calculator.getReading.subscribe(lambda sample: received.append(sample.value.count))
    assert listened(older.getReadingPublisher, EVENT_LIMIT)
    older.getReadingPublisher.publish(Reading(7, []))
    until(lambda: received)
    sample = calculator.getReading.latest()
    first.destroy()

    newer = NewerCalculatorI()
    serve(make_communicator(listen=[endpoint]), newer, "Calculator")
    until(lambda: client.identities() == ["Calculator"])
    with pytest.raises(InterfaceMismatchException, match="add"):
        calculator.add(1.5, 2.0)
    with pytest.raises(InterfaceMismatchException):
        CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    assert listened(newer.publisher, EVENT_LIMIT)

    def is_reported() -> bool:
        newer.publisher.publish(NewerReading(8))
        return "generate both from the same IDL" in caplog.text

    until(is_reported)  # by the subscription, in the log
    newer.publisher.publish(NewerReading(8))
    with pytest.raises(InterfaceMismatchException, match="the servant's ::test::Calculator from"):
        calculator.getReading.wait(after=sample, timeout=EVENT_LIMIT)
    assert set(received) == {7}
