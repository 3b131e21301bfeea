"""What holds for every transport: over Zenoh between two sessions, and within one process."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any

import pytest

from tests.support.calculator import CALCULATOR
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.receivers import Taken, Taker
from tests.support.waiting import at_once, until
from zenoh_ice import ConnectionLostException, Settings, SystemException, UnknownException
from zenoh_ice.data.codec import LARGE
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import decode_attachment, decode_error, encode_error, encode_sample_attachment
from zenoh_ice.routes._transport import RoutedTransport
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Arrived, Caller, Inlet, NoAnswer, Outcome, Reply, Transport

pytestmark = pytest.mark.slow

TARGET = Target("nao", "Calculator")
ADD = CALCULATOR.all_operations["add"]
ECHO = CALCULATOR.all_operations["echo"]
READING = CALCULATOR.all_operations["getReading"]
FINGERPRINT = "c0ffee"
TOKEN = "@servant/nao/Calculator/::test::Calculator/c0ffee/abc/1"

Act = Callable[[str, bytes, Reply], object]


@dataclass(frozen=True)
class Ends:
    """The transports of the server and of the caller, which may be the same."""

    server: Transport
    client: Transport


@pytest.fixture(params=["zenoh", "in process"])
def ends(request: pytest.FixtureRequest, endpoint: str) -> Iterator[Ends]:
    pools = [Pool(2, "server"), Pool(2, "client")]
    if request.param == "zenoh":
        common: dict[str, Any] = {"realm": "nao", "local_sockets": False, "lease": CALL_LIMIT}
        server: Transport = RoutedTransport(Settings(listen=(endpoint,), connect=(), **common), pools[0])
        client: Transport = RoutedTransport(Settings(connect=(endpoint,), **common), pools[1])
    else:
        server = client = InProcessTransport(pools[0])
    yield Ends(server, client)
    for transport in (client, server):
        transport.close()
    for pool in pools:
        assert pool.close(EVENT_LIMIT)


def echo(_: str, payload: bytes, reply: Reply) -> None:
    reply(True, payload)


@dataclass
class Servant(Taker):
    """Takes calls, and does with each what a test wants."""

    act: Act = echo
    calls: list[Taken] = field(default_factory=list)
    threads: list[threading.Thread] = field(default_factory=list)
    fails: bool = False
    """It admits no call any more."""

    def take(self, call: Taken, reply: Reply) -> Callable[[], object]:
        if self.fails:
            raise RuntimeError("inside")

        def execute() -> None:
            self.calls.append(call)
            self.threads.append(threading.current_thread())
            self.act(call.name, call.payload or b"", reply)

        return execute


def whole(outcome: Outcome) -> tuple[bool, bytes]:
    """Return an outcome whose payload is one."""
    ok, payload = outcome
    assert isinstance(payload, bytes)
    return ok, payload


def caller(ends: Ends, timeout: float = CALL_LIMIT, target: Target = TARGET) -> Caller:
    """Return what calls `add`, once the servant is reached."""
    return ends.client.caller(target, ADD, timeout=timeout, fingerprint=FINGERPRINT)


def serve(ends: Ends, servant: Servant, target: Target = TARGET) -> Caller:
    """Serve, and return what calls `add` once the client can reach the servant."""
    act, servant.act = servant.act, echo
    ends.server.serve(target, servant)
    calls = caller(ends, target=target)

    def reached() -> bool:
        try:
            return calls.call(b"\x80")[0]
        except NoAnswer:
            return False

    until(reached)
    servant.calls.clear()
    servant.threads.clear()
    servant.act = act
    return calls


class TestCalls:
    def test_a_call_arrives_as_it_was_sent_and_so_does_its_answer(self, ends: Ends) -> None:
        servant = Servant(lambda _, payload, reply: reply(True, payload + b"!"))
        calls = serve(ends, servant)
        assert whole(calls.call(b"abc")) == (True, b"abc!")
        (call,) = servant.calls
        assert (call.name, call.payload) == ("add", b"abc")
        assert call.attachment is not None
        about = decode_attachment(call.attachment)
        assert (about.fingerprint, about.timeout) == (FINGERPRINT, CALL_LIMIT)
        assert about.call_id == f"{ends.client.id}/{about.sequence}"

    def test_calls_are_taken_by_threads_of_the_pool(self, ends: Ends) -> None:
        servant = Servant()
        calls = serve(ends, servant)
        calls.call(b"")
        assert servant.threads[0].name.startswith("server-")

    def test_an_error_is_distinguished_from_a_result(self, ends: Ends) -> None:
        error = encode_error(ConnectionLostException("why"))
        calls = serve(ends, Servant(lambda _n, _p, reply: reply(False, error)))
        assert whole(calls.call(b"")) == (False, error)

    def test_an_answer_may_come_later_from_another_thread(self, ends: Ends) -> None:
        replies: SimpleQueue[Reply] = SimpleQueue()
        calls = serve(ends, Servant(lambda _n, _p, reply: replies.put(reply)))

        def answer() -> None:
            replies.get(timeout=EVENT_LIMIT)(True, b"later")

        thread = threading.Thread(target=answer)
        thread.start()
        assert whole(calls.call(b"")) == (True, b"later")
        thread.join()

    def test_a_large_byte_sequence_arrives_whole(self, ends: Ends) -> None:
        data = bytes(range(256)) * (LARGE // 128)
        result = ECHO.result.gather_result(data, "it")
        serve(ends, Servant(lambda _n, _p, reply: reply(True, result)))
        ok, payload = ends.client.caller(TARGET, ECHO, timeout=CALL_LIMIT, fingerprint=FINGERPRINT).call(b"")
        assert ok
        assert ECHO.result.unpack_result(payload, "it") == data

    def test_a_servant_that_fails_inside_answers_all_the_same(
        self, ends: Ends, caplog: pytest.LogCaptureFixture
    ) -> None:
        servant = Servant()
        calls = serve(ends, servant)
        servant.fails = True
        ok, payload = whole(calls.call(b""))
        assert not ok
        error = decode_error(payload, (), "add")
        assert isinstance(error, UnknownException)
        assert "inside" in str(error)
        assert "internal error" in caplog.text

    @at_once
    def test_where_nothing_is_served_there_is_no_answer_at_once(self, ends: Ends) -> None:
        with pytest.raises(NoAnswer) as caught:
            caller(ends, FOREVER).call(b"")
        assert not caught.value.timed_out

    def test_a_call_ends_at_its_limit(self, ends: Ends) -> None:
        kept: list[Reply] = []
        serve(ends, Servant(lambda _n, _p, reply: kept.append(reply)))
        with pytest.raises(NoAnswer) as caught:
            caller(ends, 0.1).call(b"")
        assert caught.value.timed_out

    def test_who_is_no_longer_served_gets_no_calls(self, ends: Ends) -> None:
        servant = Servant()
        served = ends.server.serve(TARGET, servant)
        served.close()
        with pytest.raises(NoAnswer):
            caller(ends).call(b"")
        assert servant.calls == []

    def test_a_busy_servant_holds_up_no_other(self, ends: Ends) -> None:
        entered, leave = threading.Event(), threading.Event()

        def stay(*_: object) -> None:
            entered.set()
            leave.wait(FOREVER)

        busy = serve(ends, Servant(stay))
        other = serve(ends, Servant(), Target("nao", "Other"))
        busy.begin(b"", lambda _: None)
        assert entered.wait(EVENT_LIMIT)
        assert whole(other.call(b"x")) == (True, b"x")
        leave.set()


class TestCallsWithoutWaiting:
    def test_the_outcome_comes_once_and_on_another_thread(self, ends: Ends) -> None:
        calls = serve(ends, Servant())
        outcomes: SimpleQueue[tuple[Outcome | SystemException, threading.Thread]] = SimpleQueue()
        calls.begin(b"abc", lambda outcome: outcomes.put((outcome, threading.current_thread())))
        outcome, thread = outcomes.get(timeout=EVENT_LIMIT)
        assert outcome == (True, b"abc")
        assert thread is not threading.current_thread()
        calls.call(b"")
        assert outcomes.empty()

    def test_an_error_is_an_outcome(self, ends: Ends) -> None:
        error = encode_error(ConnectionLostException("why"))
        calls = serve(ends, Servant(lambda _n, _p, reply: reply(False, error)))
        assert self.outcome(calls) == (False, error)

    def test_no_answer_is_an_outcome(self, ends: Ends) -> None:
        outcome = self.outcome(caller(ends))
        assert isinstance(outcome, NoAnswer)
        assert not outcome.timed_out

    def test_the_limit_is_an_outcome(self, ends: Ends) -> None:
        kept: list[Reply] = []
        serve(ends, Servant(lambda _n, _p, reply: kept.append(reply)))
        outcome = self.outcome(caller(ends, 0.1))
        assert isinstance(outcome, NoAnswer)
        assert outcome.timed_out

    def test_a_call_that_is_forgotten_disturbs_no_other(self, ends: Ends) -> None:
        replies: SimpleQueue[Reply] = SimpleQueue()
        servant = Servant(lambda _n, _p, reply: replies.put(reply))
        calls = serve(ends, servant)
        forget = calls.begin(b"", lambda _: None)
        reply = replies.get(timeout=EVENT_LIMIT)
        if forget is not None:
            forget()
        reply(True, b"too late")
        servant.act = echo
        assert whole(calls.call(b"next")) == (True, b"next")

    @staticmethod
    def outcome(calls: Caller) -> Outcome | SystemException:
        outcomes: SimpleQueue[Outcome | SystemException] = SimpleQueue()
        calls.begin(b"", outcomes.put)
        return outcomes.get(timeout=EVENT_LIMIT)


@dataclass
class Stream:
    """A publisher."""

    ends: Ends

    def __post_init__(self) -> None:
        self.outlet = self.ends.server.publish(TARGET, READING)

    def put(self, *numbers: int) -> None:
        for number in numbers:
            self.outlet.put(bytes([number]), encode_sample_attachment("c0ffee", number, float(number)))

    def subscribe(self, queue: int = 1) -> Inlet:
        """Return a listening end that is heard of."""
        inlet = self.ends.client.subscribe(TARGET, READING, queue)
        until(lambda: self.outlet.listening)
        return inlet


@pytest.fixture
def stream(ends: Ends) -> Iterator[Stream]:
    stream = Stream(ends)
    yield stream
    stream.outlet.close()


def polled(inlet: Inlet) -> Iterator[int]:
    """Yield the numbers of samples as they arrive."""
    deadline = time.monotonic() + EVENT_LIMIT
    while time.monotonic() < deadline:
        if (raw := inlet.poll()) is not None:
            yield number_of(inlet.open(raw))


def number_of(sample: Arrived) -> int:
    assert isinstance(sample.payload, bytes)
    return sample.payload[0]


class TestStreams:
    def test_a_publisher_knows_whether_anybody_listens(self, stream: Stream) -> None:
        assert not stream.outlet.listening
        inlet = stream.subscribe()
        inlet.close()
        until(lambda: not stream.outlet.listening)

    def test_a_sample_arrives_as_it_was_put(self, stream: Stream) -> None:
        inlet = stream.subscribe()
        about = encode_sample_attachment("c0ffee", 7, 0.5)
        stream.outlet.put(b"abc", about)
        until(lambda: (raw := inlet.poll()) is not None and inlet.open(raw) == Arrived(b"abc", about))
        inlet.close()

    def test_a_large_sample_arrives_whole(self, ends: Ends) -> None:
        data = bytes(range(256)) * (LARGE // 128)
        outlet = ends.server.publish(TARGET, ECHO)
        inlet = ends.client.subscribe(TARGET, ECHO)
        until(lambda: outlet.listening)
        polls: list[Any] = []

        def arrives() -> bool:
            outlet.put(ECHO.result.gather_result(data, "it"), b"")  # again: a busy machine may lose samples
            polls.append(inlet.poll())
            return polls[-1] is not None

        until(arrives)
        assert ECHO.result.unpack_result(inlet.open(polls[-1]).payload, "it") == data
        inlet.close()
        outlet.close()

    def test_the_oldest_samples_fall_out_of_a_full_queue(self, stream: Stream) -> None:
        inlet, all_of_them = stream.subscribe(2), stream.subscribe(9)
        stream.put(1, 2, 3, 4, 5, 6)
        seen = polled(all_of_them)
        assert [next(seen) for _ in range(6)] == [1, 2, 3, 4, 5, 6]
        # The last may have come to one of both before the other.
        numbers = []
        for number in polled(inlet):
            numbers.append(number)
            if number == 6:
                break
        assert numbers in ([5, 6], [4, 5, 6])
        inlet.close()
        all_of_them.close()

    def test_samples_are_delivered_one_after_the_other(self, stream: Stream) -> None:
        inlet = stream.subscribe(9)
        numbers: list[int] = []
        together = threading.Lock()

        def take(raw: Any) -> None:
            assert together.acquire(blocking=False)
            numbers.append(number_of(inlet.open(raw)))
            together.release()

        inlet.deliver(take)
        stream.put(1, 2, 3, 4, 5)
        until(lambda: len(numbers) == 5)
        assert numbers == [1, 2, 3, 4, 5]
        assert inlet.poll() is None
        assert inlet.close(EVENT_LIMIT)

    def test_each_listener_gets_each_sample(self, stream: Stream) -> None:
        inlets = [stream.subscribe(3) for _ in range(2)]
        stream.put(1, 2, 3)
        for inlet in inlets:
            numbers = polled(inlet)
            assert [next(numbers) for _ in range(3)] == [1, 2, 3]
            inlet.close()

    def test_nothing_is_delivered_after_the_end(self, stream: Stream) -> None:
        closed, other = stream.subscribe(), stream.subscribe(9)
        numbers: list[int] = []
        closed.deliver(lambda raw: numbers.append(number_of(closed.open(raw))))
        assert closed.close(EVENT_LIMIT)
        stream.put(1)
        assert next(polled(other)) == 1
        assert numbers == []
        other.close()

    def test_the_end_waits_for_a_callback_and_not_for_ever(self, stream: Stream) -> None:
        inlet = stream.subscribe()
        entered, leave = threading.Event(), threading.Event()

        def stay(_: object) -> None:
            entered.set()
            leave.wait(FOREVER)

        inlet.deliver(stay)
        publishing = threading.Thread(target=stream.put, args=(1,))
        publishing.start()
        assert entered.wait(EVENT_LIMIT)
        assert not inlet.close(0.01)
        leave.set()
        assert inlet.close(EVENT_LIMIT)
        publishing.join()

    def test_a_callback_may_end_its_own_delivery(self, stream: Stream) -> None:
        inlet = stream.subscribe()
        ended: SimpleQueue[bool] = SimpleQueue()
        inlet.deliver(lambda _: ended.put(inlet.close(EVENT_LIMIT)))
        stream.put(1)
        assert ended.get(timeout=EVENT_LIMIT)

    def test_who_publishes_no_longer_does_not(self, ends: Ends, stream: Stream) -> None:
        inlet = stream.subscribe()
        closed = ends.server.publish(TARGET, READING)
        closed.close()
        assert not closed.listening
        closed.put(b"\x01", b"")
        stream.put(2)
        assert next(polled(inlet)) == 2
        inlet.close()


class Watcher:
    """Records the tokens that appear and disappear."""

    def __init__(self) -> None:
        self.tokens: list[tuple[str, bool]] = []

    def __call__(self, token: str, came: bool) -> None:
        self.tokens.append((token, came))


class TestPresence:
    def test_who_watches_hears_of_what_comes_and_goes(self, ends: Ends) -> None:
        watcher = Watcher()
        ends.client.watch("@servant/nao/**", watcher)
        token = ends.server.announce(TOKEN)
        until(lambda: watcher.tokens == [(TOKEN, True)])
        token.close()
        until(lambda: watcher.tokens == [(TOKEN, True), (TOKEN, False)])

    def test_a_token_that_is_reported_twice_comes_once(self, ends: Ends) -> None:
        watcher, other = Watcher(), f"{TOKEN}1"
        ends.client.watch("@servant/nao/**", watcher)
        tokens = [ends.server.announce(token) for token in (TOKEN, TOKEN, other)]
        until(lambda: (other, True) in watcher.tokens)
        assert watcher.tokens.count((TOKEN, True)) == 1
        for token in tokens:
            token.close()

    def test_who_watches_late_hears_of_what_is_there(self, ends: Ends) -> None:
        first, late = Watcher(), Watcher()
        ends.client.watch("@servant/nao/**", first)
        token = ends.server.announce(TOKEN)
        until(lambda: first.tokens)
        ends.client.watch("@servant/nao/**", late)
        until(lambda: late.tokens == [(TOKEN, True)])
        token.close()

    def test_who_stops_watching_hears_no_more_and_others_do(self, ends: Ends) -> None:
        stopped, other = Watcher(), Watcher()
        watch = ends.client.watch("@servant/nao/**", stopped)
        ends.client.watch("@servant/nao/**", other)
        watch.close()
        token = ends.server.announce(TOKEN)
        until(lambda: other.tokens == [(TOKEN, True)])
        token.close()
        until(lambda: other.tokens == [(TOKEN, True), (TOKEN, False)])
        assert stopped.tokens == []

    def test_tokens_of_another_pattern_are_not_heard_of(self, ends: Ends) -> None:
        watcher = Watcher()
        ends.client.watch("@client/nao/*/*", watcher)
        tokens = [ends.server.announce(f"@client/{realm}/abc/-") for realm in ("other", "nao")]
        tokens.append(ends.server.announce(TOKEN))
        until(lambda: ("@client/nao/abc/-", True) in watcher.tokens)
        # A transport shows its own clients, too.
        assert all(token.startswith("@client/nao/") for token, _ in watcher.tokens)
        for token in tokens:
            token.close()
        until(lambda: ("@client/nao/abc/-", False) in watcher.tokens)


class TestStatus:
    def test_the_status_of_a_process_is_answered_by_its_id(self, ends: Ends) -> None:
        ends.server.serve_status("nao", lambda: b"well")

        def answered() -> bool:
            try:
                return bytes(ends.client.ask_status("nao", ends.server.id, 1.0)) == b"well"
            except ConnectionLostException:
                return False

        until(answered)

    def test_who_is_not_there_is_reported_as_lost(self, ends: Ends) -> None:
        ends.server.serve_status("nao", lambda: b"well")
        for realm, process in (("nao", "abc"), ("other", ends.server.id)):
            with pytest.raises(ConnectionLostException, match=process):
                ends.client.ask_status(realm, process, 0.1)

    def test_who_answers_no_longer_is_reported_as_lost(self, ends: Ends) -> None:
        ends.server.serve_status("nao", lambda: b"well").close()
        with pytest.raises(ConnectionLostException):
            ends.client.ask_status("nao", ends.server.id, 0.1)


class TestEnd:
    def test_calls_that_wait_have_no_answer(self, ends: Ends) -> None:
        kept: SimpleQueue[Reply] = SimpleQueue()
        calls = serve(ends, Servant(lambda _n, _p, reply: kept.put(reply)))
        outcomes: SimpleQueue[object] = SimpleQueue()

        def call() -> None:
            try:
                outcomes.put(calls.call(b""))
            except NoAnswer as error:
                outcomes.put(error)

        thread = threading.Thread(target=call)
        thread.start()
        calls.begin(b"", outcomes.put)
        replies = [kept.get(timeout=EVENT_LIMIT) for _ in range(2)]
        ends.client.close()
        for _ in range(2):
            outcome = outcomes.get(timeout=EVENT_LIMIT)
            assert isinstance(outcome, NoAnswer)
            assert not outcome.timed_out
        thread.join()
        for reply in replies:  # nobody takes them
            reply(True, b"")

    def test_a_call_afterwards_fails_at_once(self, ends: Ends) -> None:
        calls = serve(ends, Servant())
        ends.client.close()
        with pytest.raises(SystemException):
            calls.call(b"")

    def test_the_end_may_come_twice(self, ends: Ends) -> None:
        ends.client.close()
        ends.client.close()
