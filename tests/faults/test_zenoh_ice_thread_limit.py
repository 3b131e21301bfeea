"""A server that is given no further thread: it does not end, calls are answered, and stops are executed."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, as_completed, wait
from contextlib import contextmanager
from typing import Any

import psutil
import pytest

from interfaces.nao import JointsPrx, SafetyPrx
from tests.support.calculator import CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.carriers import LOCAL, LOCAL_SOCKETS, is_used, over_one
from tests.support.limited import limited_pair
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER, LONGEST_CALL
from tests.support.processes import STEADY, ComponentProcess, module
from tests.support.suite import Pair
from tests.support.waiting import call_until_it_works, until
from zenoh_ice import BusyException, Communicator, Sample
from zenoh_ice.threads._starting import UserCodeThread
from zenoh_ice.threads.limits import Limits

MakeCommunicator = Callable[..., Communicator]

pytestmark = over_one

ROOM = 4 << 20  # bytes that the process may still allocate: the stack of a thread has 8 MB
TOGETHER = 20  # calls
MOST_THREADS = 16  # more than a pool has here


@contextmanager
def no_more_threads(server: ComponentProcess) -> Iterator[None]:
    """Let a process start no thread, since there is no memory for its stack."""
    process = psutil.Process(server.process.pid)
    process.rlimit(psutil.RLIMIT_AS, (process.memory_info().vms + ROOM, psutil.RLIM_INFINITY))
    try:
        yield
    finally:
        process.rlimit(psutil.RLIMIT_AS, (psutil.RLIM_INFINITY, psutil.RLIM_INFINITY))


def together(body: JointsPrx) -> list[Future[Any]]:
    """Make several calls at once, and wait until all have been answered."""
    calls = [body.getJointState.begin() for _ in range(TOGETHER)]
    answered, _ = wait(calls, CALL_LIMIT)
    assert len(answered) == TOGETHER
    return calls


def test_a_robot_server_that_can_start_no_thread_answers_every_call_and_stops(
    endpoint: str, make_communicator: MakeCommunicator, carrier: str
) -> None:
    # Without threads a lost link would not come back.
    environment = STEADY | {LOCAL_SOCKETS: str(carrier == LOCAL).lower()}
    with ComponentProcess(module("naoserver.fake", "--listen", endpoint), environment) as server:
        server.wait_for("ready")
        client = make_communicator(connect=[endpoint], timeout=LONGEST_CALL)
        safety = SafetyPrx.checkedCast(client.stringToProxy("Safety"))
        body = JointsPrx.checkedCast(client.stringToProxy("Body"))
        served = client.identities()
        with no_more_threads(server):
            for _ in range(20):
                errors = [call.exception() for call in together(body)]
                assert {type(error) for error in errors} <= {type(None), BusyException}
                safety.emergencyStop("no threads")
            assert client.identities() == served
        assert [call.exception() for call in together(body)] == [None] * TOGETHER
        assert safety.getSafetyState().stopped
        assert is_used(carrier, server.process.pid)


@pytest.fixture
def no_starts() -> Iterator[pytest.MonkeyPatch]:
    """Let no thread start that runs calls, until the patch is undone."""

    def fail(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(UserCodeThread, "start", fail)
        yield patch


def test_calls_for_which_there_is_no_thread_are_refused_and_later_ones_are_not(
    pair: Pair, request: pytest.FixtureRequest
) -> None:
    servants = [CalculatorI() for _ in range(MOST_THREADS)]
    for number, servant in enumerate(servants):
        pair.adapter.add(servant, f"Calculator{number}")
    proxies = [
        CalculatorPrx.checkedCast(pair.client.stringToProxy(f"Calculator{number}"))
        for number in range(MOST_THREADS)
    ]
    no_starts: pytest.MonkeyPatch = request.getfixturevalue("no_starts")
    calls = [proxy.sleep.begin(FOREVER) for proxy in proxies]
    refused = next(as_completed(calls, EVENT_LIMIT))
    with pytest.raises(BusyException, match=r"Calculator\d+.sleep was not executed: can't start new thread"):
        refused.result()
    again = calls.index(refused)
    proxies[again].ice_ping()  # nobody refuses what is quick
    no_starts.undo()
    call = proxies[again].sleep.begin(FOREVER)
    assert servants[again].entered.wait(EVENT_LIMIT)
    for servant in servants:
        servant.leave.set()
    call.result(CALL_LIMIT)


def test_a_call_that_comes_before_its_clients_token_needs_no_thread(
    endpoint: str, make_communicator: Callable[..., Communicator], monkeypatch: pytest.MonkeyPatch
) -> None:
    pair = limited_pair(endpoint, make_communicator, Limits(token_checks=10))
    pair.adapter.add(CalculatorI(), "Calculator")
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    monkeypatch.setattr("zenoh_ice.objects._presence.parse_client_token", lambda _: "")  # it never comes
    lost: list[str] = []
    pair.server.onClientLost(lost.append)

    def fail(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threading.Thread, "start", fail)
        calculator.ice_ping()  # nothing refuses it, as it does no stop
        assert calculator.who() == pair.client.client_id
    until(lambda: lost == [pair.client.client_id])


def test_a_server_that_executes_no_calls_is_not_announced_until_it_does(
    endpoint: str,
    make_communicator: Callable[..., Communicator],
    request: pytest.FixtureRequest,
    caplog: pytest.LogCaptureFixture,
) -> None:
    pair = limited_pair(endpoint, make_communicator, Limits(stalled_checks=5))
    pair.adapter.add(CalculatorI(), "Calculator")
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    leave = threading.Event()

    no_starts: pytest.MonkeyPatch = request.getfixturevalue("no_starts")
    for _ in range(MOST_THREADS):
        pair.server.pool.submit(lambda: leave.wait(FOREVER))
    until(lambda: "Calculator" not in pair.client.identities())
    assert "no thread takes calls any more" in caplog.text
    leave.set()
    until(lambda: "Calculator" in pair.client.identities())
    no_starts.undo()
    call_until_it_works(calculator)


def test_a_stream_without_a_thread_is_refused_and_later_works(
    pair: Pair, request: pytest.FixtureRequest
) -> None:
    servant = CalculatorI()
    pair.adapter.add(servant, "Calculator")
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    assert calculator.getReading.latest() is None
    no_starts: pytest.MonkeyPatch = request.getfixturevalue("no_starts")
    with pytest.raises(BusyException, match="can't start new thread"):
        calculator.getReading.subscribe(print)
    with pytest.raises(BusyException, match="can't start new thread"):
        calculator.getReading.wait()
    assert len(pair.client.streams.listening) == 1  # the reader alone
    no_starts.undo()
    until(lambda: servant.getReadingPublisher.listening)
    samples: list[Sample[Reading]] = []

    def wait_for_sample() -> None:
        samples.append(calculator.getReading.wait(timeout=CALL_LIMIT))

    def arrived() -> bool:
        servant.getReadingPublisher.publish(Reading(count=7))
        return bool(samples)

    waiting = threading.Thread(target=wait_for_sample)
    waiting.start()
    until(arrived)
    waiting.join(EVENT_LIMIT)
    assert samples[0].value.count == 7
