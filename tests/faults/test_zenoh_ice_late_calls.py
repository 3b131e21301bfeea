"""No command begins after a later call of its client was answered, whatever breaks between the two.

A call of which its client has heard nothing may lie unread in a socket, or be on its way over the network.
"""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import closing
from functools import partial
from typing import Any

import pytest

from tests.support.attachments import encode_call_attachment
from tests.support.carriers import NETWORK, anywhere, cut_local_connections, over_both, over_one
from tests.support.gripper import GRIPPER as INTERFACE
from tests.support.gripper import GripperI, GripperPrx
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER, START_LIMIT
from tests.support.receivers import Taken, Taker
from tests.support.relay import Relay
from tests.support.soak import repeated
from tests.support.stranger import Stranger, stranger
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import (
    BusyException,
    Communicator,
    ConnectionLostException,
    Current,
    SystemException,
    TimeoutException,
)
from zenoh_ice.data.keys import Target, servant_token
from zenoh_ice.data.wire import ERROR_ENCODING, Attachment, decode_attachment, decode_error, encode_error
from zenoh_ice.routes._transport import RoutedTransport
from zenoh_ice.transport import Reply

MakeCommunicator = Callable[..., Communicator]

GRIPPER = Target("nao", "Gripper")
NO_ANSWER = (TimeoutException, ConnectionLostException)
NOTHING = b"\x80"


class Recorder(Taker):
    """Takes calls, answers them only while it is told to, and keeps what they say of themselves."""

    def __init__(self) -> None:
        self.calls: list[Attachment] = []
        self.answers = True
        self.refuses = False

    def take(self, call: Taken, reply: Reply) -> Callable[[], object]:
        assert call.attachment is not None
        self.calls.append(decode_attachment(call.attachment))
        if self.refuses:
            return partial(reply, False, encode_error(BusyException("not read")))
        return partial(reply, True, NOTHING) if self.answers else lambda: None


@pytest.fixture
def recorder(pair: Pair) -> Iterator[Recorder]:
    recorder, transport = Recorder(), pair.server.transport
    token = servant_token(
        GRIPPER,
        INTERFACE.type_id,
        INTERFACE.fingerprint,
        pair.server.client_id,
        1.0,
        address=transport.local_address,
    )
    with closing(transport.serve(GRIPPER, recorder)), closing(transport.announce(token)):
        yield recorder


def give_up_by_limit(gripper: GripperPrx) -> None:
    with pytest.raises(NO_ANSWER):
        gripper.ice_invocationTimeout(100).move(1.0)


def give_up_a_begun_one_by_limit(gripper: GripperPrx) -> None:
    future = gripper.ice_invocationTimeout(100).move.begin(1.0)
    assert isinstance(future.exception(EVENT_LIMIT), NO_ANSWER)


def cancel(gripper: GripperPrx) -> None:
    assert gripper.ice_invocationTimeout(CALL_LIMIT * 1000).move.begin(1.0).cancel()


class TestClient:
    @over_both
    @pytest.mark.parametrize("give_up", [give_up_by_limit, give_up_a_begun_one_by_limit, cancel])
    def test_each_call_names_those_that_were_given_up_until_one_is_answered(
        self, pair: Pair, recorder: Recorder, give_up: Callable[[GripperPrx], None]
    ) -> None:
        gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        gripper.stop()
        recorder.answers = False
        recorder.calls.clear()
        give_up(gripper)
        until(lambda: recorder.calls)
        give_up_by_limit(gripper)
        recorder.answers = True
        gripper.stop()
        gripper.stop()
        first, second, third, fourth = recorder.calls
        assert second.given_up == (first.sequence,)
        assert third.given_up == (first.sequence, second.sequence)
        assert (first.given_up, fourth.given_up) == ((), ())

    @anywhere
    @pytest.mark.parametrize(
        "call", [GripperPrx.stop, lambda gripper: gripper.stop.begin().result(EVENT_LIMIT)]
    )
    def test_a_call_that_is_refused_may_not_have_been_read(
        self, pair: Pair, recorder: Recorder, call: Callable[[GripperPrx], None]
    ) -> None:
        gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        recorder.calls.clear()
        recorder.answers = False
        give_up_by_limit(gripper)
        until(lambda: recorder.calls)
        recorder.answers = recorder.refuses = True
        with pytest.raises(BusyException):
            call(gripper)
        recorder.refuses = False
        call(gripper)
        call(gripper)
        first, *named, last = recorder.calls
        assert {each.given_up for each in named} == {(first.sequence,)}
        assert last.given_up == ()

    @over_one
    def test_calls_of_another_target_name_none_of_them(self, pair: Pair, recorder: Recorder) -> None:
        servant = GripperI()
        pair.adapter.add(servant, "Other")
        gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        recorder.answers = False
        give_up_by_limit(gripper)
        until(lambda: len(recorder.calls) == 1)
        GripperPrx.checkedCast(pair.client.stringToProxy("Other")).move(1.0)
        give_up_by_limit(gripper)
        until(lambda: len(recorder.calls) == 2)
        assert recorder.calls[-1].given_up == (recorder.calls[-2].sequence,)


class TestServer:
    """What arrives late is refused; a stop is not."""

    @pytest.fixture
    def servant(self, pair: Pair) -> GripperI:
        servant = GripperI()
        pair.adapter.add(servant, "Gripper")
        return servant

    @pytest.fixture
    def client(self, pair: Pair, servant: GripperI) -> Iterator[Stranger]:
        with stranger(pair.endpoint) as client:
            until(lambda: client.ask("nao/Gripper/ice_ping", NOTHING, None))
            yield client

    def ask(
        self,
        client: Stranger,
        operation: str,
        number: int,
        *given_up: int,
        who: str = "abc",
        payload: bytes = NOTHING,
    ) -> Any:
        """Call with a number, naming others; return the exception that was answered, None for a result."""
        attachment = encode_call_attachment(INTERFACE.fingerprint, number, who, 0.0, given_up)
        if operation == "move":
            payload = b"\x81\xa8position\xcb" + bytes(8)
        (reply,) = client.ask(f"nao/Gripper/{operation}", payload, attachment)
        if reply.ok is not None:
            return None
        assert reply.err is not None
        assert str(reply.err.encoding) == ERROR_ENCODING
        return decode_error(reply.err.payload.to_bytes(), (), operation)

    def test_a_call_that_comes_after_one_that_names_it_is_refused(
        self, client: Stranger, servant: GripperI
    ) -> None:
        assert self.ask(client, "who", 9, 7) is None
        late = self.ask(client, "move", 7)
        assert isinstance(late, TimeoutException)
        assert str(late) == "Gripper.move was not executed: its caller gave it up"
        assert self.ask(client, "move", 8) is None  # by another thread, say, which still waits for it
        assert self.ask(client, "move", 7, who="def") is None
        assert len(servant.moved) == 2

    @pytest.mark.parametrize(
        ("operation", "payload"), [("dance", NOTHING), ("who", bytes(2 << 20)), ("who", b"\xc1")]
    )
    def test_a_call_that_is_refused_names_it_all_the_same(
        self, client: Stranger, servant: GripperI, operation: str, payload: bytes
    ) -> None:
        assert isinstance(self.ask(client, operation, 9, 7, payload=payload), SystemException)
        assert isinstance(self.ask(client, "move", 7), TimeoutException)
        assert servant.moved == []

    def test_a_stop_is_executed_all_the_same(self, client: Stranger, servant: GripperI) -> None:
        assert self.ask(client, "who", 9, 7) is None
        assert self.ask(client, "stop", 7) is None
        assert servant.stopped == 1

    def test_it_remembers_the_newest(self, client: Stranger, servant: GripperI) -> None:
        for number in range(0, 20_000, 100):
            assert self.ask(client, "who", number + 200, *range(number, number + 100)) is None
        assert isinstance(self.ask(client, "move", 19_999), TimeoutException)
        assert self.ask(client, "move", 1) is None
        assert len(servant.moved) == 1


class Ordered(GripperI):
    """Notes when each movement begins; some take a moment, so that others wait for their turn."""

    def __init__(self) -> None:
        super().__init__()
        self.began: list[tuple[float, float]] = []
        self.busy = threading.Event()

    def move(self, position: float, current: Current) -> None:
        self.began.append((time.monotonic(), position))
        if position % 3 == 0:
            self.busy.set()
            time.sleep(0.002)
            self.busy.clear()


def late(began: list[tuple[float, float]], answered: list[tuple[float, float]]) -> list[float]:
    """Return the calls that began after a later one was answered; each with its moment and its number."""
    found, newest = [], -1.0
    for _, kind, number in sorted([(t, 0, n) for t, n in answered] + [(t, 1, n) for t, n in began]):
        if kind == 0:
            newest = max(newest, number)
        elif number < newest:
            found.append(number)
    return found


def answers(gripper: GripperPrx) -> bool:
    """Return whether a gripper answers again."""
    try:
        gripper.who()
    except SystemException:
        return False
    return True


class TestBreaks:
    """A client goes on while its connections break, one after the other."""

    def check(self, gripper: GripperPrx, servant: Ordered, cut: Callable[[], object], cuts: int) -> None:
        """Cut, each time after an answer or in a call; none is executed late, and none twice."""
        # A call that meets a cut link may end with its limit only.
        gripper = gripper.ice_invocationTimeout(2000)
        ended = threading.Event()
        answered: list[tuple[float, float]] = []
        failed: list[SystemException] = []

        def call() -> None:
            number = 0
            while not ended.is_set():
                for _ in range(random.choice((0, 0, 0, 1, 4))):  # what follows none takes a socket
                    number += 1
                    gripper.move.begin(float(number))
                number += 1
                try:
                    gripper.move(float(number))
                except SystemException as error:
                    failed.append(error)
                else:
                    answered.append((time.monotonic(), float(number)))

        caller = threading.Thread(target=call)
        caller.start()
        try:
            for _ in range(cuts):
                before = len(answered)
                until(lambda before=before: len(answered) > before, START_LIMIT)  # type: ignore[misc]
                if random.random() < 0.5:
                    assert servant.busy.wait(START_LIMIT)
                cut()
        finally:
            ended.set()
            caller.join(CALL_LIMIT)
        until(partial(answers, gripper), CALL_LIMIT)  # what is still on its way has arrived, or never will
        assert failed
        assert late(servant.began, answered) == []
        numbers = [number for _, number in servant.began]
        assert len(set(numbers)) == len(numbers)

    @pytest.fixture
    def servant(self, pair: Pair) -> Ordered:
        servant = Ordered()
        pair.adapter.add(servant, "Gripper")
        return servant

    def test_of_sockets(self, pair: Pair, servant: Ordered) -> None:
        gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        gripper.move(0.0)
        self.check(gripper, servant, cut_local_connections, repeated(40, 10_000))

    def test_of_links_with_the_sockets_beside_them(self, pair: Pair, servant: Ordered) -> None:
        gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
        gripper.move(0.0)
        transport = pair.client.transport
        assert isinstance(transport, RoutedTransport)
        assert transport.routes is not None
        cut = partial(transport.routes.lost, pair.server.client_id)
        self.check(gripper, servant, cut, repeated(40, 10_000))

    @pytest.mark.parametrize("carrier", [NETWORK])
    def test_of_links(self, pair: Pair, servant: Ordered, make_communicator: MakeCommunicator) -> None:
        with Relay(pair.endpoint) as relay:
            client = make_communicator(connect=[relay.endpoint], listen=[])
            gripper = GripperPrx.checkedCast(client.stringToProxy("Gripper"))
            gripper.move(0.0)

            def cut() -> None:
                relay.cut()
                relay.resume()

            self.check(gripper, servant, cut, repeated(5, 1000))


@over_both
def test_no_call_is_refused_while_all_is_whole(pair: Pair) -> None:
    """Many threads call at once, whose calls overtake one another on their way."""
    servant = GripperI()
    pair.adapter.add(servant, "Gripper")
    gripper = GripperPrx.checkedCast(pair.client.stringToProxy("Gripper"))
    failures: list[BaseException] = []

    def call() -> None:
        for number in range(repeated(100, 50_000)):
            begun: list[Future[Any]] = [gripper.positions.begin(), gripper.who.begin()]
            try:
                gripper.close(float(number))
                for future in begun:
                    future.result(FOREVER)
            except SystemException as error:
                failures.append(error)

    callers = [threading.Thread(target=call) for _ in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    assert failures == []


@pytest.mark.parametrize("carrier", [NETWORK])
def test_a_begun_call_is_not_made_again_after_later_ones(
    pair: Pair, make_communicator: MakeCommunicator
) -> None:
    """Even an idempotent one may command something; a stop may follow it at any time."""
    servant = GripperI()
    pair.adapter.add(servant, "Gripper")
    with Relay(pair.endpoint) as relay:
        client = make_communicator(connect=[relay.endpoint], listen=[])
        gripper = GripperPrx.checkedCast(client.stringToProxy("Gripper"))
        servant.leave.clear()
        gripper.move.begin(1.0)
        assert servant.entered.acquire(timeout=EVENT_LIMIT)
        read, stop = gripper.positions.begin(), gripper.stop.begin()
        until(lambda: pair.server.served[GRIPPER].status().waiting == 2)
        relay.cut()
        relay.resume()
        assert isinstance(read.exception(EVENT_LIMIT), ConnectionLostException)
        until(lambda: pair.server.served[GRIPPER].status().waiting == 3)
        servant.leave.set()
        assert stop.result(EVENT_LIMIT) is None
    assert servant.stopped == 2  # the first one, too, is executed: to stop twice does no harm
