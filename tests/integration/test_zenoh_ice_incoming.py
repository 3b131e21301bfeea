"""What servants see of the wire: oneway calls, calls that are sent again, and what the process tells of them."""

from __future__ import annotations

import itertools
import logging
import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import msgspec
import pytest
import zenoh

from tests.conftest import Pair
from tests.support.gripper import GripperI, GripperPrx
from tests.support.limits import LIMIT
from tests.support.waiting import until
from zenoh_ice import BusyException, Communicator, ConnectionLostException, MarshalException, ServantStatus
from zenoh_ice.serving import oneway_inbox
from zenoh_ice.wire.attachment import encode_call_attachment
from zenoh_ice.wire.errors import decode_error

FINGERPRINT = "c0ffee0000000010"


@pytest.fixture
def servant(pair: Pair) -> GripperI:
    servant = GripperI()
    pair.adapter.add(servant, "Gripper")
    GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
    return servant


numbers = itertools.count(1000)


def attachment(number: int | None = None, fingerprint: str = FINGERPRINT, timeout: float = LIMIT) -> bytes:
    return encode_call_attachment(fingerprint, next(numbers) if number is None else number, "c0ffee", timeout)


def put(pair: Pair, position: object, key: str = "nao/Gripper/move", about: bytes | None = None) -> None:
    pair.client.session.put(
        key,
        msgspec.msgpack.encode({"position": position}),
        attachment=attachment() if about is None else about,
        congestion_control=zenoh.CongestionControl.BLOCK,
    )


def ask(pair: Pair, number: int, operation: str, **arguments: object) -> zenoh.Reply:
    (reply,) = pair.client.session.get(
        f"nao/Gripper/{operation}",
        payload=msgspec.msgpack.encode(arguments),
        attachment=attachment(number),
        timeout=LIMIT,
    )
    return reply


def status(pair: Pair) -> ServantStatus:
    return pair.client.processStatus(pair.server.client_id).servants["Gripper@nao"]


class TestOneway:
    def test_calls_are_executed_in_their_order(self, pair: Pair, servant: GripperI) -> None:
        for position in range(200):
            put(pair, float(position))
        until(lambda: len(servant.moved) == 200)
        assert servant.moved == list(range(200))
        assert servant.currents[0].client == "c0ffee"

    def test_twoway_and_oneway_calls_run_one_at_a_time(self, pair: Pair, servant: GripperI) -> None:
        servant.leave.clear()
        put(pair, 1.0)
        assert servant.entered.acquire(timeout=LIMIT)
        call = threading.Thread(
            target=GripperPrx.checkedCast(pair.client.stringToProxy("Gripper")).move, args=(2.0,)
        )
        call.start()
        assert not servant.entered.acquire(timeout=0.2)
        servant.leave.set()
        call.join(LIMIT)
        assert servant.moved == [1.0, 2.0]

    @pytest.mark.parametrize(
        ("call", "told"),
        [
            pytest.param(("far",), "Gripper.move", id="wrong type"),
            pytest.param((1.0, "nao/Gripper/move", b"\xc1"), "attachment", id="bad attachment"),
            pytest.param(
                (1.0, "nao/Gripper/move", attachment(fingerprint="f00")), "generated from f00", id="other IDL"
            ),
            pytest.param((bytes(2 << 20),), "bytes where at most", id="too large"),
            pytest.param((1.0, "nao/*/move"), "has no operation", id="to all"),
        ],
    )
    def test_bad_call_is_not_executed_and_is_logged(
        self,
        pair: Pair,
        servant: GripperI,
        caplog: pytest.LogCaptureFixture,
        call: tuple[Any, ...],
        told: str,
    ) -> None:
        with caplog.at_level(logging.WARNING, "zenoh_ice"):
            put(pair, *call)
            put(pair, 7.0)
            until(lambda: servant.moved)
        assert servant.moved == [7.0]
        assert told in caplog.text
        assert status(pair).refused == 1

    def test_what_returns_something_is_not_called_oneway(self, pair: Pair, servant: GripperI) -> None:
        pair.client.session.put(
            "nao/Gripper/text", msgspec.msgpack.encode({"size": 1}), attachment=attachment()
        )
        put(pair, 1.0)
        until(lambda: servant.moved)
        assert servant.texts == 0

    def test_calls_beyond_those_that_may_wait_are_dropped_counted_and_told(
        self, pair: Pair, servant: GripperI, caplog: pytest.LogCaptureFixture
    ) -> None:
        servant.leave.clear()
        most = oneway_inbox._MOST_WAITING
        with caplog.at_level(logging.WARNING, "zenoh_ice"):
            for position in range(most + 50):
                put(pair, float(position))
            until(lambda: status(pair).refused == 49)  # one runs
        servant.leave.set()
        until(lambda: len(servant.moved) == most + 1)
        assert servant.moved == list(range(most + 1))
        assert "oneway calls of Gripper were dropped" in caplog.text
        assert len(caplog.records) < 5

    def test_what_travels_beside_calls_that_wait_is_bounded_too(
        self, endpoint: str, make_communicator: Callable[..., Communicator]
    ) -> None:
        server = make_communicator(listen=[endpoint], max_bulk_size=1 << 20)
        client = make_communicator(connect=[endpoint])
        servant = GripperI()
        servant.leave.clear()
        adapter = server.createObjectAdapter("Test")
        adapter.add(servant, "Gripper")
        adapter.activate()
        pair = Pair(endpoint, server, client, adapter)
        GripperPrx.checkedCast(client.stringToProxy("Gripper"))
        put(pair, 1.0)
        assert servant.entered.acquire(timeout=LIMIT)
        for _ in range(4):
            put(pair, 2.0, about=bytes(400_000))
        until(lambda: status(pair).refused == 2)  # while two wait
        servant.leave.set()
        until(lambda: status(pair).refused == 4)

    def test_calls_that_came_before_the_removal_are_executed(self, pair: Pair, servant: GripperI) -> None:
        servant.leave.clear()
        for position in range(10):
            put(pair, float(position))
        assert servant.entered.acquire(timeout=LIMIT)
        threading.Timer(0.1, servant.leave.set).start()
        pair.adapter.remove("Gripper")
        assert servant.moved == list(range(len(servant.moved)))
        assert len(servant.moved) >= 1


class TestAtMostOnce:
    def test_call_that_is_sent_again_is_answered_and_not_executed(
        self, pair: Pair, servant: GripperI
    ) -> None:
        first, again, another = (ask(pair, number, "text", size=3) for number in (1, 1, 2))
        assert first.ok is not None
        assert again.ok is not None
        assert again.ok.payload.to_bytes() == first.ok.payload.to_bytes()
        assert another.ok is not None
        assert servant.texts == 2

    def test_call_that_is_sent_again_while_it_runs_gets_the_same_answer(
        self, pair: Pair, servant: GripperI
    ) -> None:
        servant.leave.clear()
        replies: list[zenoh.Reply] = []
        threads = [
            threading.Thread(target=lambda: replies.append(ask(pair, 1, "move", position=1.0)))
            for _ in range(3)
        ]
        for thread in threads:
            thread.start()
        assert servant.entered.acquire(timeout=LIMIT)
        servant.leave.set()
        for thread in threads:
            thread.join(LIMIT)
        assert [reply.ok is not None for reply in replies] == [True] * 3
        assert servant.moved == [1.0]

    def test_of_a_large_answer_it_is_only_known_that_there_was_one(
        self, pair: Pair, servant: GripperI
    ) -> None:
        assert ask(pair, 1, "text", size=100_000).ok is not None
        again = ask(pair, 1, "text", size=100_000)
        assert again.err is not None
        error = decode_error(again.err.payload, (), "call")
        assert isinstance(error, ConnectionLostException)
        assert "was executed" in str(error)
        assert servant.texts == 1

    def test_idempotent_call_is_executed_again(self, pair: Pair, servant: GripperI) -> None:
        for _ in range(2):
            assert ask(pair, 1, "who").ok is not None
        assert len(servant.currents) == 2

    def test_call_that_was_refused_may_be_sent_again(self, pair: Pair, servant: GripperI) -> None:
        assert ask(pair, 1, "text", size="three").err is not None
        assert ask(pair, 1, "text", size=3).ok is not None

    def test_memory_is_bounded(self, pair: Pair, servant: GripperI) -> None:
        for number in range(257):
            ask(pair, number, "text", size=1)
        ask(pair, 256, "text", size=1)
        assert servant.texts == 257
        ask(pair, 0, "text", size=1)  # forgotten, and long past any retry
        assert servant.texts == 258


class TestProcessStatus:
    def test_process_tells_what_it_is(self, pair: Pair, servant: GripperI) -> None:
        told = pair.client.processStatus(pair.server.client_id)
        assert told.pid == os.getpid()
        assert told.servants.keys() == {"Gripper@nao"}
        assert told.servants["Gripper@nao"].type_id == "::test::Gripper"
        assert told.zenoh
        assert 0 <= time.time() - told.since < LIMIT

    def test_calls_are_counted(self, pair: Pair, servant: GripperI) -> None:
        for _ in range(3):
            ask(pair, 1, "who")
        ask(pair, 2, "text", size="three")
        ask(pair, 3, "fly")
        told = status(pair)
        assert (told.calls, told.failed, told.refused, told.running) == (3, 0, 2, 0)

    def test_busy_servant_is_told_for_how_long_while_it_is(self, pair: Pair, servant: GripperI) -> None:
        assert status(pair).busy_for == 0.0
        servant.leave.clear()
        began = time.monotonic()
        busy = threading.Thread(target=ask, args=(pair, 1, "move"), kwargs={"position": 1.0})
        busy.start()
        assert servant.entered.acquire(timeout=LIMIT)
        first, second = status(pair), status(pair)
        assert 0 < first.busy_for < second.busy_for <= time.monotonic() - began
        assert first.running == 1
        servant.leave.set()
        busy.join(LIMIT)
        until(lambda: status(pair).running == 0)

    def test_burst_that_did_not_fit_is_told_after_its_end(self, pair: Pair, servant: GripperI) -> None:
        servant.leave.clear()
        proxy = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        calls = [proxy.closeAsync(1.0) for _ in range(1)]
        threads = [threading.Thread(target=_move, args=(pair, number)) for number in range(80)]
        for thread in threads:
            thread.start()
        until(lambda: sum(thread.is_alive() for thread in threads) <= 65)  # the others fell out of the queue
        servant.leave.set()
        for thread in threads:
            thread.join(LIMIT)
        assert status(pair).busy_for > 0
        assert calls[0].result(LIMIT) == 2.0

    def test_process_that_is_not_there_tells_nothing(self, pair: Pair) -> None:
        with pytest.raises(ConnectionLostException, match="c0ffee"):
            pair.client.processStatus("c0ffee")

    @pytest.mark.parametrize(
        "answer", [b"\xc1", msgspec.msgpack.encode({"program": 1}), bytes((1 << 20) + 1)], ids=len
    )
    def test_status_that_is_none_is_refused(self, pair: Pair, answer: bytes) -> None:
        def pretend(query: zenoh.Query) -> None:
            query.reply(query.key_expr, answer)

        key = "@process/nao/c0ffee/status"
        with pair.server.session.declare_queryable(key, pretend), pytest.raises(MarshalException):
            _ask_until_answered(pair)

    def test_process_without_servants_tells_nothing(self, pair: Pair) -> None:
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
        thread.join(LIMIT)
    assert len(servant.moved) == 65


def _move(pair: Pair, number: int) -> None:
    for _ in pair.client.session.get(
        "nao/Gripper/move",
        payload=msgspec.msgpack.encode({"position": 1.0}),
        attachment=attachment(number),
        timeout=LIMIT,
    ):
        pass


def _ask_until_answered(pair: Pair) -> None:
    """Ask until the queryable, of which word may be on the way, was reached."""
    deadline = time.monotonic() + LIMIT
    while time.monotonic() < deadline:
        with suppress(ConnectionLostException):
            pair.client.processStatus("c0ffee")
