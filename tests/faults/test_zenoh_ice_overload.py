"""An overloaded server, and what its callers see."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import wait

import psutil
import pytest

from tests.support.calculator import CalculatorPrx
from tests.support.carriers import is_used, over_one
from tests.support.limits import CALL_LIMIT, FOREVER, LONGEST_CALL
from tests.support.processes import ComponentProcess, module
from zenoh_ice import BusyException, Communicator

MakeCommunicator = Callable[..., Communicator]

SERVER = "tests.support.calculator_server"
WAITING = 64  # calls of a servant
MEGABYTE = 1 << 20


@over_one
def test_too_many_calls_are_refused_and_take_no_memory(
    carrier: str, endpoint: str, make_communicator: MakeCommunicator
) -> None:
    with ComponentProcess(module(SERVER, "--listen", endpoint)) as server:
        server.wait_for("^ready")
        client = make_communicator(connect=[endpoint], timeout=LONGEST_CALL)
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        data = bytes(MEGABYTE)
        assert calculator.echo(data) == data
        before = own_memory(server)
        calculator.sleep.begin(FOREVER)
        waiting = [calculator.echo.begin(data) for _ in range(WAITING)]
        for _ in range(5):
            refused = [calculator.echo.begin(data) for _ in range(30)]
            for call in refused:
                with pytest.raises(BusyException, match="not executed"):
                    call.result(CALL_LIMIT)
        assert own_memory(server) - before < 150 * MEGABYTE  # of 214: those that wait, and 30 on their way
        assert is_used(carrier)
        server.process.kill()
        wait(waiting, CALL_LIMIT)


def own_memory(process: ComponentProcess) -> int:
    """Return how many bytes a process has for itself."""
    memory = psutil.Process(process.process.pid).memory_info()
    return int(memory.rss - memory.shared)
