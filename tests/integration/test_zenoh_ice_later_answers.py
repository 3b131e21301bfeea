"""Servants that answer later: by a future, or as coroutines."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
import warnings
from concurrent.futures import Future, wait

import pytest

from tests.conftest import Pair
from tests.support.gripper import GripperI, GripperPrx, Slipped
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from zenoh_ice import (
    BusyException,
    Communicator,
    ConnectionLostException,
    Current,
    MarshalException,
    UnknownException,
)
from zenoh_ice.generated import Dispatched


class Later(GripperI):
    """Returns futures, which the test completes."""

    def __init__(self) -> None:
        super().__init__()
        self.futures: list[Future[float]] = []
        self.begun = threading.Semaphore(0)

    def close(self, force: float, current: Current) -> Dispatched[float]:
        future: Future[float] = Future()
        self.futures.append(future)
        self.begun.release()
        return future


class Coroutine(GripperI):
    """Is closed by a coroutine."""

    def __init__(self) -> None:
        super().__init__()
        self.begun = threading.Semaphore(0)
        self.cleaned_up = threading.Event()
        self.threads: set[str] = set()

    async def close(self, force: float, current: Current) -> float:
        self.threads.add(threading.current_thread().name)
        self.begun.release()
        try:
            await asyncio.sleep(FOREVER if force > 100 else 0.0)
        finally:
            self.cleaned_up.set()
        if force < 0:
            raise Slipped(force)
        if force == 13:
            raise RuntimeError("out of order")
        return 2 * force


@pytest.fixture(params=["client", "server"])
def caller(request: pytest.FixtureRequest, pair: Pair) -> Communicator:
    communicator: Communicator = getattr(pair, request.param)
    return communicator


def serve(pair: Pair, servant: GripperI, caller: Communicator) -> GripperPrx:
    pair.adapter.add(servant, "Gripper")
    return GripperPrx.checkedCast(caller.stringToProxy("Gripper"))


class TestFutures:
    def test_value_now_is_an_answer_too(self, pair: Pair, caller: Communicator) -> None:
        proxy = serve(pair, GripperI(), caller)
        assert proxy.close(2.0) == 4.0
        with pytest.raises(Slipped):
            proxy.close(-1.0)

    def test_answers_come_in_any_order_and_the_servant_is_free_meanwhile(
        self, pair: Pair, caller: Communicator
    ) -> None:
        servant = Later()
        proxy = serve(pair, servant, caller)
        calls = [proxy.close.begin(1.0) for _ in range(2)]
        for _ in calls:
            assert servant.begun.acquire(timeout=EVENT_LIMIT)
        assert proxy.who() == ":Gripper"
        servant.futures[1].set_result(1.0)
        servant.futures[0].set_exception(Slipped(3.0))
        outcomes = [call.exception(CALL_LIMIT) or call.result() for call in calls]
        assert sorted(map(type, outcomes), key=str) == sorted([float, Slipped], key=str)

    def test_future_that_is_done_answers_at_once(self, pair: Pair, caller: Communicator) -> None:
        class AtOnce(GripperI):
            def close(self, force: float, current: Current) -> Dispatched[float]:
                future: Future[float] = Future()
                future.set_result(force)
                return future

        assert serve(pair, AtOnce(), caller).close(3.0) == 3.0

    def test_cancelled_future_is_reported(self, pair: Pair, caller: Communicator) -> None:
        servant = Later()
        call = serve(pair, servant, caller).close.begin(1.0)
        assert servant.begun.acquire(timeout=EVENT_LIMIT)
        servant.futures[0].cancel()
        with pytest.raises(
            ConnectionLostException, match=r"Gripper\.close: its server dropped it without an answer"
        ):
            call.result(CALL_LIMIT)

    def test_result_that_does_not_fit_is_reported(self, pair: Pair, caller: Communicator) -> None:
        servant = Later()
        call = serve(pair, servant, caller).close.begin(1.0)
        assert servant.begun.acquire(timeout=EVENT_LIMIT)
        servant.futures[0].set_result("strong")  # type: ignore[arg-type]
        with pytest.raises(MarshalException):
            call.result(CALL_LIMIT)

    def test_too_many_that_are_not_answered_are_refused(
        self, pair: Pair, caller: Communicator, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("zenoh_ice.servant._MOST_UNANSWERED", 3)
        servant = Later()
        proxy = serve(pair, servant, caller)
        calls = [proxy.close.begin(1.0) for _ in range(3)]
        for _ in calls:
            assert servant.begun.acquire(timeout=EVENT_LIMIT)
        with pytest.raises(BusyException, match="3 calls are not answered yet"):
            proxy.close(1.0)
        servant.futures[0].set_result(1.0)
        wait(calls, EVENT_LIMIT, "FIRST_COMPLETED")
        again = proxy.close.begin(2.0)
        assert servant.begun.acquire(timeout=EVENT_LIMIT)
        for future in servant.futures[1:]:
            future.set_result(2.0)
        assert again.result(EVENT_LIMIT) == 2.0

    def test_removing_the_servant_waits_for_its_answers(self, pair: Pair) -> None:
        servant = Later()
        call = serve(pair, servant, pair.client).close.begin(1.0)
        assert servant.begun.acquire(timeout=EVENT_LIMIT)
        threading.Timer(0.2, servant.futures[0].set_result, (5.0,)).start()
        pair.adapter.removeAll(["Gripper"])
        assert servant.futures[0].done()
        assert call.result(CALL_LIMIT) == 5.0

    def test_answers_after_the_removal_still_arrive(self, pair: Pair) -> None:
        servant = Later()
        gripper = serve(pair, servant, pair.client)
        calls = [gripper.close.begin(1.0) for _ in range(2)]
        for _ in calls:
            assert servant.begun.acquire(timeout=EVENT_LIMIT)
        pair.adapter.removeAll(["Gripper"])
        for call, future in zip(calls, servant.futures, strict=True):
            assert not call.done()
            future.set_result(5.0)
            assert call.result(CALL_LIMIT) == 5.0


class TestCoroutines:
    def test_coroutine_answers_on_a_thread_of_the_communicator(
        self, pair: Pair, caller: Communicator
    ) -> None:
        servant = Coroutine()
        proxy = serve(pair, servant, caller)
        assert proxy.close(2.0) == 4.0
        with pytest.raises(Slipped) as caught:
            proxy.close(-2.0)
        assert caught.value.force == -2.0
        assert servant.threads == {"zenoh_ice nao coroutines"}

    def test_failure_is_reported_and_logged(
        self, pair: Pair, caller: Communicator, caplog: pytest.LogCaptureFixture
    ) -> None:
        proxy = serve(pair, Coroutine(), caller)
        with caplog.at_level(logging.ERROR, "zenoh_ice"), pytest.raises(UnknownException) as caught:
            proxy.close(13.0)
        assert str(caught.value) == "RuntimeError: out of order"
        assert "Traceback" in caplog.text

    def test_coroutines_overlap(self, pair: Pair, caller: Communicator) -> None:
        class Meeting(GripperI):
            """Wait until all calls have arrived."""

            async def close(self, force: float, current: Current) -> float:
                self.texts += 1
                while self.texts < 5:
                    await asyncio.sleep(0.001)
                return force

        proxy = serve(pair, Meeting(), caller)
        calls = [proxy.close.begin(float(number)) for number in range(5)]
        assert [call.result(CALL_LIMIT) for call in calls] == [0.0, 1.0, 2.0, 3.0, 4.0]

    def test_coroutine_may_await_other_calls(self, pair: Pair) -> None:
        class Delegating(GripperI):
            async def close(self, force: float, current: Current) -> float:
                other = GripperPrx.uncheckedCast(current.communicator.stringToProxy("Other"))
                return await asyncio.wrap_future(other.close.begin(force))

        pair.adapter.add(Coroutine(), "Other")
        assert serve(pair, Delegating(), pair.client).close(4.0) == 8.0

    def test_the_end_of_the_communicator_cancels_it(self, pair: Pair) -> None:
        servant = Coroutine()
        call = serve(pair, servant, pair.client).close.begin(1000.0)
        assert servant.begun.acquire(timeout=EVENT_LIMIT)
        started = time.monotonic()
        pair.server.destroy()
        assert time.monotonic() - started < EVENT_LIMIT
        assert servant.cleaned_up.is_set()
        with pytest.raises(ConnectionLostException):
            call.result(CALL_LIMIT)

    def test_coroutine_that_exits_ends_no_others(self, pair: Pair, caller: Communicator) -> None:
        class Exiting(GripperI):
            async def close(self, force: float, current: Current) -> float:
                if force < 0:
                    raise SystemExit(3)
                return force

        proxy = serve(pair, Exiting(), caller)
        with pytest.raises(UnknownException, match="SystemExit"):
            proxy.close(-1.0)
        assert proxy.close(2.0) == 2.0

    def test_operation_that_is_not_marked_may_not_be_a_coroutine(self, pair: Pair) -> None:
        class Careless(GripperI):
            async def who(self, current: Current) -> str:  # type: ignore[override]
                return "nobody"

        proxy = serve(pair, Careless(), pair.client)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(MarshalException, match=r'only an operation marked \["amd"\]'):
                proxy.who()
