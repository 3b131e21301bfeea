"""Callers when the network to a server is cut, silent, slow or corrupts data, or a router ends."""

from __future__ import annotations

import random
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass

import pytest

from tests.support.calculator import CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import CALL_LIMIT, END_LIMIT, EVENT_LIMIT, FOREVER, LONGEST_CALL
from tests.support.processes import ComponentProcess, module
from tests.support.relay import Relay
from tests.support.serving import serve
from tests.support.soak import cases
from tests.support.waiting import call_until_it_works, links, listened, until
from zenoh_ice import (
    Communicator,
    ConnectFailedException,
    ConnectionLostException,
    SystemException,
    TimeoutException,
)

MakeCommunicator = Callable[..., Communicator]

LEASE = 1.0  # s, so that silence is noticed soon


@dataclass(frozen=True)
class Line:
    """A client and a server with a relay between them."""

    relay: Relay
    server: Communicator
    client: Communicator
    servant: CalculatorI
    calculator: CalculatorPrx


@pytest.fixture
def line(
    endpoint: str, make_communicator: MakeCommunicator, request: pytest.FixtureRequest
) -> Iterator[Line]:
    """A line whose ends notice silence after the lease that the test is marked with."""
    lease = getattr(request, "param", CALL_LIMIT)
    server = make_communicator(listen=[endpoint], lease=lease)
    servant = serve(server, CalculatorI(), "Calculator")
    with Relay(endpoint) as relay:
        # It listens on nothing: gossip would lead the server around the relay, as a local socket would.
        client = make_communicator(connect=[relay.endpoint], listen=[], lease=lease, local_sockets=False)
        calculator = CalculatorPrx.uncheckedCast(client.stringToProxy("Calculator"))
        call_until_it_works(calculator)  # on a busy machine, a short lease may end as soon as it begins
        yield Line(relay, server, client, servant, calculator)
        servant.leave.set()
        client.destroy()


def patient(calculator: CalculatorPrx) -> CalculatorPrx:
    """Return a proxy whose calls end for another reason than their limit."""
    return calculator.ice_invocationTimeout(FOREVER * 1000)


def test_a_cut_is_reported_at_once_and_calls_go_on_after_it(line: Line) -> None:
    pending = patient(line.calculator).sleep.begin(FOREVER)
    assert line.servant.entered.wait(EVENT_LIMIT)
    line.relay.cut()
    with pytest.raises(ConnectionLostException, match="is offline"):
        pending.result(CALL_LIMIT)
    with pytest.raises(ConnectionLostException, match="calls continue when it is back"):
        patient(line.calculator).count()
    line.servant.leave.set()
    line.relay.resume()
    call_until_it_works(line.calculator)
    assert line.servant.counted == 0  # nothing that failed is sent again


def test_a_stream_goes_on_after_a_cut(line: Line) -> None:
    publisher = line.servant.getReadingPublisher
    assert line.calculator.getReading.latest() is None
    assert listened(publisher, EVENT_LIMIT)
    publisher.publish(Reading(1, []))
    sample = line.calculator.getReading.wait(timeout=EVENT_LIMIT)
    line.relay.cut()
    with pytest.raises(ConnectionLostException):  # noqa: PT012
        for _ in range(round(CALL_LIMIT / 0.1)):
            with suppress(
                TimeoutException
            ):  # before the loss is noticed; after it, it waits for the next server
                line.calculator.getReading.wait(after=sample, timeout=0.1)
    assert line.calculator.getReading.latest() is sample  # its age shows that it is old
    line.relay.resume()

    def goes_on() -> bool:
        publisher.publish(Reading(2, []))
        newest = line.calculator.getReading.latest()
        return newest is not None and newest.value.count == 2

    until(goes_on)


@pytest.mark.parametrize("line", [LEASE], indirect=True)
def test_silence_is_a_loss_after_the_lease_at_both_ends(line: Line) -> None:
    lost: list[str] = []
    line.server.onClientLost(lost.append)
    line.relay.hold()
    with pytest.raises(ConnectionLostException, match="is offline"):
        patient(line.calculator).count()
    until(lambda: line.client.client_id in lost)
    line.relay.resume()
    call_until_it_works(line.calculator)


def test_a_slow_line_delays_calls_and_only_those_that_may_not_take_so_long_fail(line: Line) -> None:
    line.relay.delay(0.1)
    began = time.monotonic()
    assert line.calculator.add(1.0, 2.0) == 3.0
    assert time.monotonic() - began >= 0.2  # there and back
    # In tenths of it, less where a busy machine has taken long to begin.
    with pytest.raises(TimeoutException, match=r"within 0\.(15|1[0-3]|0)\d* s"):
        line.calculator.ice_invocationTimeout(150).add(1.0, 2.0)


def test_a_sample_that_came_over_a_slow_line_is_as_old_as_it_is(line: Line) -> None:
    publisher = line.servant.getReadingPublisher
    line.calculator.getReading.latest()
    assert listened(publisher, EVENT_LIMIT)
    line.relay.delay(0.1)
    publisher.publish(Reading(1, []))
    assert line.calculator.getReading.wait(timeout=EVENT_LIMIT).age >= 0.1


@pytest.mark.parametrize("line", [LEASE], indirect=True)
@pytest.mark.parametrize("seed", cases([1], range(2, 12)))
def test_garbled_traffic_ends_calls_and_no_process(line: Line, seed: int) -> None:
    """Whatever the noise makes of it, a call ends, with an exception of ours or an answer."""
    noise = random.Random(seed)

    def garble(data: bytearray) -> None:
        for _ in range(max(1, len(data) // 200)):
            data[noise.randrange(len(data))] ^= noise.randrange(1, 256)

    line.calculator.getReading.subscribe(lambda _: None)
    line.relay.garble(garble)
    calculator = line.calculator.ice_invocationTimeout(1000 * LEASE)
    lost = 0
    while not lost:
        line.servant.getReadingPublisher.publish(Reading(1, [1.0]))
        try:
            calculator.divide(7.0, 2.0)
        except ConnectionLostException:
            lost += 1
        except SystemException:
            continue
    line.relay.resume()
    call_until_it_works(line.calculator)


class TestRouter:
    @pytest.fixture
    def router(self, endpoint: str) -> Iterator[ComponentProcess]:
        with ComponentProcess(module("nao_tools", "router", "--listen", endpoint)) as process:
            process.wait_for("the router listens")
            yield process

    def test_direct_links_outlive_the_router_that_made_them_known(
        self, endpoint: str, router: ComponentProcess, make_communicator: MakeCommunicator
    ) -> None:
        server = make_communicator(connect=[endpoint])
        serve(server, CalculatorI(), "Calculator")
        client = make_communicator(connect=[endpoint])
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        until(lambda: server.client_id in links(client))
        router.process.kill()
        router.process.wait(END_LIMIT)
        assert calculator.add(1.0, 2.0) == 3.0
        late = make_communicator(connect=[endpoint])
        proxy = late.stringToProxy("Calculator").ice_invocationTimeout(200)
        with pytest.raises(ConnectFailedException, match="nothing answers"):
            CalculatorPrx.checkedCast(proxy)
        with ComponentProcess(router.command) as second:
            second.wait_for("the router listens")
            assert CalculatorPrx.checkedCast(late.stringToProxy("Calculator")).add(1.0, 2.0) == 3.0

    def test_what_goes_through_a_router_is_lost_with_it_and_comes_back_with_it(
        self, endpoint: str, router: ComponentProcess, make_communicator: MakeCommunicator
    ) -> None:
        server, client = (
            make_communicator(connect=[endpoint], mode="client", timeout=CALL_LIMIT, local_sockets=False)
            for _ in range(2)
        )
        servant = serve(server, CalculatorI(), "Calculator")
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        pending = patient(calculator).sleep.begin(FOREVER)
        assert servant.entered.wait(EVENT_LIMIT)
        router.process.kill()
        with pytest.raises(ConnectionLostException):
            pending.result(CALL_LIMIT)
        with pytest.raises(ConnectionLostException):
            calculator.count()
        servant.leave.set()
        with ComponentProcess(router.command):
            call_until_it_works(calculator)


def test_silent_connections_keep_no_new_client_out(
    endpoint: str, make_communicator: MakeCommunicator
) -> None:
    server = make_communicator(listen=[endpoint], lease=LONGEST_CALL)  # for as long it waits for each of them
    serve(server, CalculatorI(), "Calculator")
    host, _, port = endpoint.partition("/")[2].rpartition(":")
    with ExitStack() as connections:
        silent = [
            connections.enter_context(socket.create_connection((host, int(port)), EVENT_LIMIT))
            for _ in range(200)
        ]
        client = make_communicator(connect=[endpoint], listen=[])
        calculator = CalculatorPrx.uncheckedCast(client.stringToProxy("Calculator"))
        call_until_it_works(calculator)
        silent[0].setblocking(False)
        with pytest.raises(BlockingIOError):  # it still stands: the client did not wait for its end
            silent[0].recv(1)
