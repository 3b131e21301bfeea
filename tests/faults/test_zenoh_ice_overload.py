"""What callers see when a server is asked for more than it can do, and what that costs it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import wait

import psutil
import pytest

from tests.conftest import Pair
from tests.support.calculator import CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import CALL_LIMIT, LIMIT
from tests.support.processes import ComponentProcess, module
from tests.support.relay import Relay
from tests.support.waiting import until
from zenoh_ice import BusyException, Communicator

MakeCommunicator = Callable[..., Communicator]

SERVER = "tests.support.calculator_server"
WAITING = 64  # calls of a servant
MEGABYTE = 1 << 20


def test_too_many_calls_are_refused_and_take_no_memory(
    endpoint: str, make_communicator: MakeCommunicator
) -> None:
    with ComponentProcess(module(SERVER, "--listen", endpoint)) as server:
        server.wait_for("^ready")
        client = make_communicator(connect=[endpoint], timeout=LIMIT, lease=CALL_LIMIT)
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        data = bytes(MEGABYTE)
        assert calculator.echo(data) == data
        before = own_memory(server)
        calculator.sleepAsync(LIMIT)
        calls = [calculator.echoAsync(data) for _ in range(300)]
        for call in (*calls[:5], calls[-WAITING - 8]):  # the oldest give way to the newest
            with pytest.raises(BusyException, match="not executed"):
                call.result(LIMIT)
        assert own_memory(server) - before < 150 * MEGABYTE  # of 300: those that wait, and what is on its way
        server.process.kill()
        wait(calls, LIMIT)


def own_memory(process: ComponentProcess) -> int:
    """Return how many bytes a process has for itself."""
    memory = psutil.Process(process.process.pid).memory_info()
    return int(memory.rss - memory.shared)


def test_oneway_calls_beyond_the_queue_are_dropped_and_counted(
    pair: Pair, caplog: pytest.LogCaptureFixture
) -> None:
    servant = CalculatorI()
    pair.adapter.add(servant, "Calculator")
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    busy = calculator.sleepAsync(LIMIT)
    assert servant.entered.wait(LIMIT)
    oneway = CalculatorPrx.uncheckedCast(calculator.ice_oneway())
    for _ in range(1100):
        oneway.sleep(0.0)

    def status() -> tuple[int, int]:
        shown = pair.client.processStatus(pair.server.client_id).servants["Calculator@nao"]
        return shown.calls, shown.refused

    until(lambda: status()[1] >= 1100 - 1024 - 1)
    assert "oneway calls of Calculator were dropped" in caplog.text
    servant.leave.set()
    busy.result(LIMIT)
    until(lambda: sum(status()) == 1101)  # each was executed, or counted as dropped


def test_calls_that_cannot_be_sent_are_bounded(pair: Pair, make_communicator: MakeCommunicator) -> None:
    pair.adapter.add(CalculatorI(), "Calculator")
    with Relay(pair.endpoint) as relay:
        client = make_communicator(
            connect=[relay.endpoint], listen=[], shared_memory=False, lease=CALL_LIMIT, timeout=LIMIT
        )
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        hurried = calculator.ice_invocationTimeout(CALL_LIMIT * 1000)
        relay.hold()
        large = hurried.echoAsync(bytes(8 * MEGABYTE))  # more than all buffers between hold
        calls = [hurried.countAsync() for _ in range(1100)]
        with pytest.raises(BusyException, match="1024 calls wait already"):
            calls[-1].result(LIMIT)
        assert not large.done()
        relay.resume()
        wait([large], LIMIT)  # or what is sent then would hold up the end
        client.destroy()


@pytest.mark.skipif(sys.platform != "linux", reason="shared memory as on Linux")
class TestSharedMemory:
    def test_without_room_for_it_everything_travels_over_the_network(
        self, endpoint: str, make_communicator: MakeCommunicator
    ) -> None:
        # No file of this process may be larger than 4 MB, as if /dev/shm were full.
        limited = ["sh", "-c", 'ulimit -f 4096; exec "$@"', "sh", *module(SERVER, "--listen", endpoint)]
        with ComponentProcess(limited) as server:
            server.wait_for("^ready")
            client = make_communicator(connect=[endpoint])
            calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
            data = bytes(MEGABYTE)
            for _ in range(3):
                assert calculator.echo(data) == data
            assert server.output.count("large payloads go over the network") == 1
            assert ".rs:" not in server.output  # no place in Zenoh's sources

    def test_what_finds_no_room_in_the_pool_travels_over_the_network(self, pair: Pair) -> None:
        servant = CalculatorI()
        pair.adapter.add(servant, "Calculator")
        calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
        data = bytes(9 * MEGABYTE)
        calls = [calculator.echoAsync(data) for _ in range(6)]  # 54 MB at once, and again as answers
        assert all(call.result(LIMIT) == data for call in calls)
