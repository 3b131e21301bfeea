"""Incoming calls: those of strangers who wait for no answer, and the status of the receiving process."""

from __future__ import annotations

import itertools
import os
import threading
import time
from collections.abc import Callable
from contextlib import closing, suppress
from typing import Any

import msgspec
import psutil
import pytest
import zenoh

from tests.support.attachments import encode_call_attachment
from tests.support.carriers import is_used, over_both, over_one
from tests.support.gripper import GripperI, GripperPrx
from tests.support.limited import limited_pair
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.stranger import session_of
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import (
    BusyException,
    Communicator,
    ConnectionLostException,
    MarshalException,
    ServantStatus,
    UnknownException,
)
from zenoh_ice.data.keys import Target, servant_token
from zenoh_ice.threads.limits import Limits

FINGERPRINT = "c0ffee0000000010"


@pytest.fixture
def servant(pair: Pair) -> GripperI:
    servant = GripperI()
    pair.adapter.add(servant, "Gripper")
    GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
    return servant


numbers = itertools.count(1000)


def attachment(number: int | None = None, fingerprint: str = FINGERPRINT, timeout: float = FOREVER) -> bytes:
    return encode_call_attachment(fingerprint, next(numbers) if number is None else number, "c0ffee", timeout)


def _ignore(_: zenoh.Reply) -> None:
    pass


def send(pair: Pair, position: object, key: str = "nao/Gripper/move", about: bytes | None = None) -> None:
    """Call without a limit, and without waiting for the answer."""
    session_of(pair.client).get(
        key,
        _ignore,
        payload=msgspec.msgpack.encode({"position": position}),
        attachment=attachment(timeout=0.0) if about is None else about,
        congestion_control=zenoh.CongestionControl.BLOCK,
        timeout=CALL_LIMIT,
    )


def ask(pair: Pair, number: int, operation: str, **arguments: object) -> zenoh.Reply:
    reply: zenoh.Reply
    (reply,) = session_of(pair.client).get(
        f"nao/Gripper/{operation}",
        payload=msgspec.msgpack.encode(arguments),
        attachment=attachment(number),
        timeout=CALL_LIMIT,
    )
    return reply


def status(pair: Pair) -> ServantStatus:
    return pair.client.processStatus(pair.server.client_id).servants["Gripper@nao"]


class TestUnlimitedCalls:
    def test_calls_are_executed_in_their_order(self, pair: Pair, servant: GripperI) -> None:
        for position in range(200):
            send(pair, float(position))
        until(lambda: len(servant.moved) == 200)
        assert servant.moved == list(range(200))
        assert servant.currents[0].client == "c0ffee"

    @over_both
    def test_those_with_and_without_a_limit_run_one_at_a_time(self, pair: Pair, servant: GripperI) -> None:
        servant.leave.clear()
        send(pair, 1.0)
        assert servant.entered.acquire(timeout=EVENT_LIMIT)
        call = threading.Thread(
            target=GripperPrx.checkedCast(pair.client.stringToProxy("Gripper")).move, args=(2.0,)
        )
        call.start()
        assert not servant.entered.acquire(timeout=0.2)
        servant.leave.set()
        call.join(EVENT_LIMIT)
        assert servant.moved == [1.0, 2.0]

    @pytest.mark.parametrize(
        "call",
        [
            pytest.param(("far",), id="wrong type"),
            pytest.param(
                (1.0, "nao/Gripper/move", attachment(fingerprint="f00", timeout=0.0)), id="other IDL"
            ),
            pytest.param((1.0, "nao/Gripper/fly"), id="no operation"),
        ],
    )
    def test_bad_call_is_counted_and_not_executed(
        self, pair: Pair, servant: GripperI, call: tuple[Any, ...]
    ) -> None:
        send(pair, *call)
        send(pair, 7.0)
        until(lambda: servant.moved)
        assert servant.moved == [7.0]
        assert status(pair).refused == 1

    def test_stop_that_never_changes_waits_behind_a_flood_of_others(self, pair: Pair) -> None:
        class Frozen(GripperI):
            ice_frozen = frozenset({"stop"})

        servant = Frozen()
        servant.leave.clear()
        pair.adapter.add(servant, "Gripper")
        gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        for position in range(64 + 50):
            send(pair, float(position))
        until(lambda: status(pair).refused == 49)
        stop = gripper.ice_invocationTimeout(FOREVER * 1000).stop.begin()
        until(lambda: status(pair).waiting == 65)
        servant.leave.set()
        stop.result(CALL_LIMIT)
        assert servant.stopped == 1
        assert servant.moved == list(range(65))

    def test_bytes_of_calls_that_wait_are_bounded_too(
        self,
        endpoint: str,
        make_communicator: Callable[..., Communicator],
    ) -> None:
        pair = limited_pair(endpoint, make_communicator, Limits(waiting_bytes=1 << 20))
        servant = GripperI()
        servant.leave.clear()
        pair.adapter.add(servant, "Gripper")
        GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        send(pair, 1.0)
        assert servant.entered.acquire(timeout=EVENT_LIMIT)
        for _ in range(4):
            send(pair, bytes(400_000))
        until(lambda: status(pair).refused == 2)
        assert status(pair).waiting == 2
        servant.leave.set()
        until(lambda: status(pair).refused == 4)

    def test_calls_that_came_before_the_removal_are_executed(self, pair: Pair, servant: GripperI) -> None:
        servant.leave.clear()
        for position in range(10):
            send(pair, float(position))
        assert servant.entered.acquire(timeout=EVENT_LIMIT)
        threading.Timer(0.1, servant.leave.set).start()
        pair.adapter.removeAll(["Gripper"])
        assert servant.moved == list(range(len(servant.moved)))
        assert len(servant.moved) >= 1


class TestProcessStatus:
    def test_process_reports_what_it_is(self, pair: Pair, servant: GripperI) -> None:
        reported = pair.client.processStatus(pair.server.client_id)
        assert reported.pid == os.getpid()
        assert reported.servants.keys() == {"Gripper@nao"}
        assert reported.servants["Gripper@nao"].type_id == "::test::Gripper"
        assert reported.zenoh
        assert psutil.Process().create_time() <= reported.since <= time.time()

    def test_calls_are_counted(self, pair: Pair, servant: GripperI) -> None:
        for _ in range(3):
            ask(pair, 1, "who")
        ask(pair, 2, "text", size="three")
        ask(pair, 3, "fly")
        until(lambda: status(pair).running == 0)  # the answer comes before the turn ends
        counted = status(pair)
        assert (counted.calls, counted.failed, counted.refused) == (3, 0, 2)

    @over_both
    def test_status_says_what_runs_and_how_many_calls_wait(
        self, carrier: str, pair: Pair, servant: GripperI
    ) -> None:
        servant.leave.clear()
        proxy = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        calls = [proxy.move.begin(float(number)) for number in range(80)]
        assert servant.entered.acquire(timeout=EVENT_LIMIT)
        until(lambda: status(pair).refused == 15)  # one runs, 64 wait
        busy = status(pair)
        assert not any(call.done() for call in calls[:65])
        assert (busy.running, busy.waiting, busy.calls) == (1, 64, 1)
        servant.leave.set()
        for call in calls[65:]:
            with pytest.raises(
                BusyException, match="64 calls are already waiting; this one was not executed"
            ):
                call.result(CALL_LIMIT)
        assert [call.result(CALL_LIMIT) for call in calls[:65]] == [None] * 65
        assert servant.moved == list(range(65))
        until(lambda: status(pair).running == 0)
        assert (status(pair).waiting, status(pair).calls) == (0, 65)
        proxy.who()
        assert is_used(carrier)

    def test_process_that_is_not_there_reports_nothing(self, pair: Pair) -> None:
        with pytest.raises(ConnectionLostException, match=r"c0ffee.*: it is gone, or not known here yet"):
            pair.client.processStatus("c0ffee")

    def test_process_that_hangs_reports_nothing_within_the_limit(self, pair: Pair) -> None:
        asked: list[zenoh.Query] = []

        def ask() -> bool:
            with pytest.raises(ConnectionLostException) as failure:
                pair.client.processStatus("c0ffee", timeout=0.1)
            return "c0ffee of realm nao did not report its status: there was no answer" in str(failure.value)

        with session_of(pair.server).declare_queryable("@process/nao/c0ffee/status", asked.append):
            until(ask)
            until(lambda: asked)  # perhaps after the limit

    @pytest.mark.parametrize(
        ("answer", "reason"),
        [
            (b"\xc1", "malformed"),
            (msgspec.msgpack.encode({"program": 1}), "program is str, not int"),
            (bytes((1 << 20) + 1), "1048577 bytes; at most 1048576 are accepted"),
            (msgspec.msgpack.encode({"version": "0.9.0"}), r"has VisualHFSM 0\.9\.0, this is .*: install"),
        ],
        ids=["no MessagePack", "no status", "too large", "of another version"],
    )
    def test_status_that_is_none_is_refused(self, pair: Pair, answer: bytes, reason: str) -> None:
        def pretend(query: zenoh.Query) -> None:
            query.reply(query.key_expr, answer)

        key = "@process/nao/c0ffee/status"
        with (
            session_of(pair.server).declare_queryable(key, pretend),
            pytest.raises(MarshalException, match=f"^(status of|the process) c0ffee.*{reason}"),
        ):
            _ask_until_answered(pair)

    def test_process_without_servants_reports_nothing(self, pair: Pair) -> None:
        with pytest.raises(ConnectionLostException):
            pair.server.processStatus(pair.client.client_id)


def test_collocated_calls_beyond_those_that_may_wait_are_refused(pair: Pair, servant: GripperI) -> None:
    servant.leave.clear()
    proxy = GripperPrx.checkedCast(pair.server.stringToProxy("Gripper"))
    refused: list[BusyException] = []

    def call() -> None:
        try:
            proxy.move(1.0)
        except BusyException as error:
            refused.append(error)

    threads = [threading.Thread(target=call) for _ in range(70)]
    for thread in threads:
        thread.start()
    until(lambda: len(refused) == 5)  # one runs, 64 wait
    servant.leave.set()
    for thread in threads:
        thread.join(EVENT_LIMIT)
    assert len(servant.moved) == 65


def _ask_until_answered(pair: Pair) -> None:
    """Ask until the queryable, of which word may be on the way, was reached."""
    deadline = time.monotonic() + EVENT_LIMIT
    while time.monotonic() < deadline:
        with suppress(ConnectionLostException):
            pair.client.processStatus("c0ffee")


class TestServersThatFail:
    """Whatever happens in a server, its caller gets an answer, and no guess."""

    @pytest.mark.parametrize("remote", [True, False])
    def test_error_while_a_call_is_taken_is_answered(
        self, pair: Pair, caplog: pytest.LogCaptureFixture, remote: bool
    ) -> None:
        target = Target("nao", "Broken")
        token = servant_token(target, "::test::Gripper", FINGERPRINT, pair.server.client_id, 1.0)

        class Broken:
            runs_here = False

            def admit(self, *_: object, **__: object) -> None:
                raise RuntimeError("out of order")

        with (
            closing(pair.server.transport.serve(target, Broken())),
            closing(pair.server.transport.announce(token)),
        ):
            caller = pair.client if remote else pair.server
            gripper = GripperPrx.checkedCast(caller.stringToProxy("Broken"))
            with pytest.raises(UnknownException, match="RuntimeError: out of order"):
                gripper.who()
            with pytest.raises(UnknownException, match="RuntimeError: out of order"):
                gripper.close.begin(1.0).result(EVENT_LIMIT)
        assert "internal error" in caplog.text

    @over_one
    def test_error_while_a_call_is_executed_costs_the_servant_no_turn(
        self, pair: Pair, servant: GripperI, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Not one of the servant's: one of ours, with another call in the line behind it."""
        servant.leave.clear()
        gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        calls = [gripper.move.begin(float(number)) for number in range(3)]
        assert servant.entered.acquire(timeout=EVENT_LIMIT)
        until(lambda: status(pair).waiting == 2)
        with monkeypatch.context() as patch:
            patch.setattr("zenoh_ice.objects._servant.Current", None)  # of the two that wait
            servant.leave.set()
            assert [type(call.exception(CALL_LIMIT)) for call in calls] == [
                type(None),
                UnknownException,
                UnknownException,
            ]
        assert gripper.who() == ":Gripper"
        until(lambda: status(pair).running == 0)
