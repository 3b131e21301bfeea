"""Calls that change their carrier, and local sockets that break, are out of reach, or turned off."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from types import FrameType
from typing import Any

import pytest

from tests.support.carriers import (
    calls_over_network,
    cut_local_connections,
    is_used,
    local_connections,
    two_servers,
)
from tests.support.gripper import GripperI, GripperPrx
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.serving import serve
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import Communicator, ConnectionLostException, Current, TimeoutException
from zenoh_ice.carriers._local.server import local_space
from zenoh_ice.data.keys import Target
from zenoh_ice.routes._transport import RoutedTransport

MakeCommunicator = Callable[..., Communicator]

GRIPPER = Target("nao", "Gripper")
TYPE_ID = "::test::Gripper"


class Noting(GripperI):
    """Notes the calls of two operations in one list."""

    def close(self, force: float, current: Current) -> float:
        self.moved.append(force)
        return force


@pytest.fixture
def servant(pair: Pair) -> GripperI:
    servant = Noting()
    pair.adapter.add(servant, "Gripper")
    return servant


@pytest.fixture
def gripper(pair: Pair, servant: GripperI) -> GripperPrx:
    return GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))


class TestChange:
    def test_no_call_is_lost_doubled_or_overtaken(
        self, pair: Pair, servant: GripperI, gripper: GripperPrx
    ) -> None:
        """While the carrier changes again and again, a client mixes calls that wait with futures."""
        over_network = calls_over_network(pair.server)
        calls: list[Future[Any]] = []
        ended = threading.Event()
        changes = 0

        def call_all() -> None:
            number = 0
            while changes < 30:
                for _ in range(7):
                    calls.append(gripper.move.begin(float(number)))
                    calls.append(gripper.close.begin(float(number + 1)))
                    number += 2
                gripper.move(float(number))
                gripper.close(float(number + 1))
                number += 2
            ended.set()

        caller = threading.Thread(target=call_all)
        caller.start()
        try:
            while changes < 30:
                with two_servers(pair, GRIPPER, TYPE_ID):
                    changes += 1
        finally:
            changes = 30
            caller.join(CALL_LIMIT)
        assert ended.is_set()
        for call in calls:
            call.result(CALL_LIMIT)
        assert servant.moved == [float(number) for number in range(len(servant.moved))]
        assert 0 < len(over_network) < len(servant.moved)

    def test_those_that_were_begun_are_answered_before_one_goes_through_the_socket(
        self, pair: Pair, servant: GripperI, gripper: GripperPrx
    ) -> None:
        over_network = calls_over_network(pair.server)
        gripper.move(0.0)
        assert over_network == []
        servant.leave.clear()
        begun = [gripper.move.begin(float(number)) for number in range(1, 11)]
        with ThreadPoolExecutor(1) as threads:
            waits = threads.submit(gripper.move, 11.0)
            until(lambda: waiting(pair) == 10)
            servant.leave.set()
            assert waits.result(CALL_LIMIT) is None
        assert [call.result(CALL_LIMIT) for call in begun] == [None] * 10
        gripper.move(12.0)
        assert servant.moved == list(range(13))
        assert over_network == ["nao/Gripper/move"] * 11


class TestBreak:
    def test_call_is_lost_and_an_idempotent_one_is_made_again(
        self, pair: Pair, servant: GripperI, gripper: GripperPrx
    ) -> None:
        gripper.who()
        servant.leave.clear()
        with ThreadPoolExecutor(2) as threads:
            lost = threads.submit(gripper.move, 1.0)
            assert servant.entered.acquire(timeout=EVENT_LIMIT)
            again = threads.submit(gripper.positions)
            until(lambda: waiting(pair) == 1)
            cut_local_connections()
            error = lost.exception(EVENT_LIMIT)
            assert type(error) is ConnectionLostException
            assert str(error) == "Gripper.move: the connection was lost during the call"
            until(lambda: waiting(pair) == 2)  # the servant is still busy, and so both wait for it
            servant.leave.set()
            assert again.result(EVENT_LIMIT) == servant.moved
        assert len(servant.moved) == 1  # though nobody heard of it
        assert is_used("local")

    def test_whatever_breaks_whenever_nothing_is_executed_twice(
        self, servant: GripperI, gripper: GripperPrx
    ) -> None:
        numbers = iter(range(1_000_000))
        succeeded: list[float] = []
        surprises: list[BaseException] = []
        ended = threading.Event()

        def note(number: float, call: Callable[[], object]) -> None:
            try:
                call()
            except ConnectionLostException:
                return
            except BaseException as error:  # noqa: BLE001
                surprises.append(error)
            else:
                succeeded.append(number)

        def call_all() -> None:
            while not ended.is_set():
                waits, begun = float(next(numbers)), float(next(numbers))
                future = gripper.move.begin(begun)
                note(waits, lambda number=waits: gripper.move(number))  # type: ignore[misc]
                note(begun, lambda future=future: future.result(CALL_LIMIT))  # type: ignore[misc]

        callers = [threading.Thread(target=call_all) for _ in range(3)]
        for caller in callers:
            caller.start()
        for _ in range(30):
            before = len(succeeded)
            until(lambda before=before: len(succeeded) > before)  # type: ignore[misc]
            cut_local_connections()
        ended.set()
        for caller in callers:
            caller.join(CALL_LIMIT)
        gripper.move(-1.0)
        assert surprises == []
        assert len(set(servant.moved)) == len(servant.moved)
        assert set(succeeded) <= set(servant.moved)

    def test_end_of_a_client_with_a_broken_connection_takes_no_time(
        self, pair: Pair, servant: GripperI, gripper: GripperPrx, caplog: pytest.LogCaptureFixture
    ) -> None:
        gripper.move(1.0)
        cut_local_connections()
        gripper.move(2.0)
        pair.client.destroy()
        assert "still busy" not in caplog.text


class TestOutOfReach:
    """The server says where its socket is, but it is not there, or not its own."""

    @contextmanager
    def said(self, monkeypatch: pytest.MonkeyPatch, address: str) -> Iterator[None]:
        with monkeypatch.context() as patch:
            patch.setattr(RoutedTransport, "local_address", property(lambda _: address))
            yield

    @pytest.fixture
    def over_network(self, pair: Pair) -> list[str]:
        return calls_over_network(pair.server)

    def call(self, pair: Pair, servant: GripperI, over_network: list[str]) -> None:
        gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        gripper.move(1.0)
        gripper.move.begin(2.0).result(CALL_LIMIT)
        gripper.move(3.0)
        assert servant.moved == [1.0, 2.0, 3.0]
        assert over_network == ["nao/Gripper/move"] * 3

    @pytest.mark.parametrize(
        "place",
        [
            pytest.param("{space}.1.0", id="other"),
            pytest.param("{space}.{pid}.9999", id="file"),
            pytest.param("{space}.999999999.5", id="process"),
            # As in a container with its own processes, or as another user or group.
            pytest.param("0123456789abcdef.1.1", id="space"),
        ],
    )
    def test_the_network_carries_all(
        self, pair: Pair, over_network: list[str], monkeypatch: pytest.MonkeyPatch, place: str
    ) -> None:
        servant = GripperI()
        with self.said(monkeypatch, place.format(space=local_space(), pid=os.getpid())):
            pair.adapter.add(servant, "Gripper")
        self.call(pair, servant, over_network)
        assert local_connections() == 0

    def test_the_socket_of_another_server_is_not_used(
        self,
        pair: Pair,
        over_network: list[str],
        make_communicator: MakeCommunicator,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        """The number of a process that ended may be that of another one by now."""
        other = make_communicator(connect=[pair.endpoint]).createObjectAdapter("Other")
        other.add(GripperI(), "Other")
        other.activate()
        servant = GripperI()
        with self.said(monkeypatch, other.getCommunicator().transport.local_address):
            pair.adapter.add(servant, "Gripper")
        self.call(pair, servant, over_network)


def test_client_that_turned_the_sockets_off_calls_beside_one_that_did_not(
    pair: Pair, servant: GripperI, gripper: GripperPrx, make_communicator: MakeCommunicator
) -> None:
    over_network = calls_over_network(pair.server)
    without = make_communicator(connect=[pair.endpoint], local_sockets=False)
    other = GripperPrx.checkedCast(without.stringToProxy("Gripper"))
    for number in range(10):
        gripper.move(2.0 * number)
        other.move(2.0 * number + 1.0)
    assert servant.moved == list(range(20))
    assert over_network == ["nao/Gripper/move"] * 10


@pytest.mark.parametrize("off", [{"local_sockets": False}, {"security": {"user": "Ann", "password": "p"}}])
def test_server_without_a_socket_serves_over_the_network(
    endpoint: str, make_communicator: MakeCommunicator, off: dict[str, object]
) -> None:
    server = make_communicator(listen=[endpoint], **off)
    assert server.transport.local_address == ""
    serve(server, GripperI("plain"), "Gripper")
    assert server.transport.local_address == ""


def test_signals_do_not_prolong_a_call(servant: GripperI, gripper: GripperPrx) -> None:
    """As those of a profiler, or of a timer in a user's program."""

    def ignore(_number: int, _frame: FrameType | None) -> None:
        pass

    servant.leave.clear()
    before = signal.signal(signal.SIGALRM, ignore)
    signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)
    end = threading.Timer(EVENT_LIMIT, signal.setitimer, (signal.ITIMER_REAL, 0.0))
    end.start()
    try:
        with pytest.raises(TimeoutException):
            gripper.ice_invocationTimeout(300).move(1.0)
        assert end.is_alive()
    finally:
        end.cancel()
        end.join()
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        servant.leave.set()


def waiting(pair: Pair) -> int:
    """Return how many calls wait for the gripper."""
    return pair.client.processStatus(pair.server.client_id).servants["Gripper@nao"].waiting
