"""Doors behind which nothing is as it should be: their clients get an error or call over Zenoh, and lose nothing."""

from __future__ import annotations

import math
import os
import resource
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from queue import SimpleQueue

import msgpack
import pytest
import zenoh

from tests.conftest import Pair
from tests.support.calculator import CALCULATOR, CalculatorPrx
from tests.support.hostile_bytes import HostileBytes, bombs
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.local_doors import SERVER, answer, fake_door, greet, next_request
from tests.support.open_files import open_files
from tests.support.soak import repeated
from tests.support.stranger import stranger
from tests.support.waiting import until
from zenoh_ice import MarshalException, SystemException
from zenoh_ice._given_up import OwnCalls
from zenoh_ice._local import neighbors
from zenoh_ice._local.channel import NotSent, Outgoing
from zenoh_ice._local.door import door_space
from zenoh_ice._local.messages import (
    HELLO,
    LARGEST_INLINE,
    LARGEST_MESSAGE,
    PART,
    REQUEST,
    SAMPLE,
    SUBSCRIBED,
    VERSION,
    Return,
    decode_to_server,
    encode,
    send_with_file,
)
from zenoh_ice._local.neighbors import Neighbor
from zenoh_ice._local.routes import Neighborhood
from zenoh_ice._memory import Arena, Extent
from zenoh_ice._pool import Pool
from zenoh_ice.limits import Limits
from zenoh_ice.transport import NoAnswer, Outcome, Target

TARGET = Target("nao", "Calculator")
LIMIT = 1 << 20
SOUND = [
    answer(0, b"payload"),
    answer(1, b"rest", (0,), Extent(0, (1,))),
    encode((PART, bytes(LARGEST_INLINE))),
    encode((SUBSCRIBED, 1, True)),
    encode((SAMPLE, 1, b"a", b"payload")),
]

pytestmark = pytest.mark.skipif(not door_space(), reason="no process reaches another one's door here")

Behavior = Callable[[socket.socket], object]


@pytest.fixture
def pool() -> Iterator[Pool]:
    pool = Pool(8, "test")
    yield pool
    assert pool.close(EVENT_LIMIT)


@pytest.fixture
def no_file_stays_open(pool: Pool) -> Iterator[None]:
    pool.kind()  # begins to look after its threads
    before = open_files()
    yield
    until(lambda: open_files() <= before)


@pytest.fixture(params=["line", "channel"])
def call(request: pytest.FixtureRequest, pool: Pool) -> Callable[..., Outcome]:
    """Call once at an address, over a connection for one call at a time, or for those in flight."""

    def call(address: str, timeout: float = EVENT_LIMIT, hello: float = EVENT_LIMIT) -> Outcome:
        limits = Limits(hello=hello, hello_share=math.inf)
        with closing(Neighbor(pool, address, SERVER, limits)) as neighbor:
            outgoing = Outgoing("t", "o", timeout, LIMIT, "it")
            if request.param == "line":
                return neighbor.call(outgoing, b"arguments", b"")
            outcomes: SimpleQueue[Outcome | SystemException] = SimpleQueue()
            neighbor.channel().begin(outgoing, b"arguments", b"", outcomes.put)
            outcome = outcomes.get(timeout=timeout + EVENT_LIMIT)
            if isinstance(outcome, SystemException):
                raise outcome
            return outcome

    return call


Call = Callable[..., Outcome]


def replying(*messages: Callable[[int], bytes], file: int | None = None) -> Behavior:
    """Greet, and answer a call with some messages, of which each is made with the number of the call."""

    def behave(connection: socket.socket) -> None:
        greet(connection, file)
        number = next_request(connection).number
        for make in messages:
            connection.send(make(number))
        connection.recv(1)  # until the client ends it

    return behave


def test_a_door_that_answers_is_called(call: Call) -> None:
    with fake_door(replying(lambda number: answer(number, b"result"))) as address:
        assert call(address) == (True, b"result")


@pytest.mark.usefixtures("no_file_stays_open")
class TestGreetings:
    @pytest.mark.parametrize(
        "behave",
        [
            lambda connection: None,
            lambda connection: connection.send(b"\xc1"),
            lambda connection: connection.send(bytes(LARGEST_MESSAGE + 1000)),
            lambda connection: connection.send(encode((HELLO, VERSION + 1, SERVER))),
            lambda connection: connection.send(encode((HELLO, VERSION, "abc"))),
            lambda connection: connection.send(encode((HELLO, VERSION, "c" * 10_000))),
            lambda connection: connection.send(SOUND[0]),
            lambda connection: send_with_file(connection, encode((HELLO, VERSION, SERVER)), 0),
            lambda connection: socket.send_fds(connection, [encode((HELLO, VERSION, SERVER))], [0] * 8),
        ],
        ids=["none", "garbage", "long", "version", "other", "name", "answer", "no memory", "files"],
    )
    def test_a_wrong_one_makes_no_neighbor(self, call: Call, behave: Behavior) -> None:
        with fake_door(behave) as address, pytest.raises(NotSent):
            call(address)

    def test_who_does_not_greet_is_not_waited_for_long(self, call: Call) -> None:
        with fake_door(lambda connection: connection.recv(1)) as address, pytest.raises(NotSent):
            call(address, hello=0.05)

    @pytest.mark.parametrize("kind", ["stream", "datagram", "pipe", "none"])
    def test_what_is_no_door_makes_no_neighbor(self, call: Call, kind: str) -> None:
        ends = socket.socketpair(
            socket.AF_UNIX, socket.SOCK_DGRAM if kind == "datagram" else socket.SOCK_STREAM
        )
        receiving, sending = os.pipe()
        try:
            file = {"pipe": receiving, "none": 99_999}.get(kind, ends[0].fileno())
            with pytest.raises(NotSent):
                call(f"{door_space()}.{os.getpid()}.{file}")
            with pytest.raises(NotSent):
                call(f"{door_space()}.4294967295.{file}")
        finally:
            for end in ends:
                end.close()
            os.close(receiving)
            os.close(sending)

    def test_a_process_of_another_user_makes_no_neighbor(
        self, call: Call, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        own = os.geteuid()
        monkeypatch.setattr(neighbors, "owner_of", lambda _: own + 1)
        with (
            fake_door(replying(lambda number: answer(number))) as address,
            pytest.raises(NotSent, match="user"),
        ):
            call(address)

    def test_the_memory_of_another_process_is_not_kept(self, pool: Pool) -> None:
        with closing(Arena()) as arena, closing(Arena()) as wrong:
            extent, other = (
                each.lend([text], [(pool, 1)]) for each, text in ((arena, b"own"), (wrong, b"bad"))
            )
            assert extent == other
            greetings = [("abc", wrong.file), (SERVER, arena.file)]

            def behave(connection: socket.socket) -> None:
                server, file = greetings.pop(0)
                greet(connection, file, server)
                connection.send(answer(next_request(connection).number, b"", (), extent))

            with fake_door(behave) as address, closing(Neighbor(pool, address, SERVER)) as neighbor:
                outgoing = Outgoing("t", "o", EVENT_LIMIT, LIMIT, "it")
                with pytest.raises(NotSent):
                    neighbor.call(outgoing, b"", b"")
                neighbor._absent_until = 0.0
                assert neighbor.call(outgoing, b"", b"") == (True, b"own")

    def test_a_client_that_may_open_no_file_calls_over_the_network(self, call: Call) -> None:
        most = resource.getrlimit(resource.RLIMIT_NOFILE)
        with closing(Arena()) as arena, fake_door(replying(lambda n: answer(n), file=arena.file)) as address:
            resource.setrlimit(resource.RLIMIT_NOFILE, (3, most[1]))
            try:
                with pytest.raises(NotSent):
                    call(address)
            finally:
                resource.setrlimit(resource.RLIMIT_NOFILE, most)


@pytest.mark.usefixtures("no_file_stays_open")
class TestAnswers:
    @pytest.mark.parametrize(
        "message",
        [
            b"\xc1",
            bytes(LARGEST_MESSAGE + 1000),
            SOUND[0][:-1],
            encode((REQUEST, 0, "t", "o", b"", b"")),
            b"",
        ],
        ids=["garbage", "long", "truncated", "call", "empty"],
    )
    def test_garbage_ends_the_call(self, call: Call, message: bytes) -> None:
        with fake_door(replying(lambda _: message)) as address, pytest.raises(SystemException):
            call(address)

    def test_an_end_in_the_middle_ends_the_call(self, call: Call) -> None:
        def behave(connection: socket.socket) -> None:
            greet(connection)
            next_request(connection)
            connection.send(SOUND[2])

        with fake_door(behave) as address, pytest.raises(NoAnswer) as raised:
            call(address)
        assert raised.value.broken

    def test_an_answer_to_another_call_is_none(self, call: Call) -> None:
        with (
            fake_door(replying(lambda number: answer(number + 1))) as address,
            pytest.raises(SystemException),
        ):
            call(address, 0.1)

    def test_more_than_the_limit_is_refused(self, call: Call) -> None:
        parts = [lambda _: SOUND[2]] * 20
        behave = replying(*parts, lambda number: answer(number))
        with fake_door(behave) as address, pytest.raises(MarshalException, match="at most"):
            call(address)

    def test_parts_without_end_end_the_call(self, call: Call) -> None:
        with fake_door(replying(*[lambda _: SOUND[2]] * 1000)) as address, pytest.raises(SystemException):
            call(address)

    def test_parts_that_dribble_do_not_extend_the_limit_of_a_call(self, call: Call) -> None:
        ended = threading.Event()

        def behave(connection: socket.socket) -> None:
            greet(connection)
            next_request(connection)
            while not ended.wait(0.02):
                connection.send(SOUND[2])

        with fake_door(behave) as address:
            with pytest.raises(NoAnswer) as raised:
                call(address, 0.2)
            ended.set()
            assert raised.value.timed_out

    @pytest.mark.parametrize("lends", [True, False])
    @pytest.mark.parametrize(
        ("places", "extent"),
        [
            ((0,), Extent((256 << 20) - 1, (2,))),
            ((0,), Extent(0, (LIMIT + 1,))),
            ((0, 1), Extent(0, (1,))),
            ((), Extent(0, (1, 1))),
            ((0,), Extent(0, ())),
            ((0,) * 257, Extent(0, (1,) * 257)),
            ((-1,), Extent(0, (1,))),
            ((0,), (0, (1 << 62,))),
        ],
    )
    def test_references_that_make_no_sense_are_refused(
        self, call: Call, places: tuple[int, ...], extent: object, lends: bool
    ) -> None:
        with closing(Arena()) as arena:
            behave = replying(
                lambda number: answer(number, b"", places, extent), file=arena.file if lends else None
            )
            with fake_door(behave) as address, pytest.raises(SystemException):
                call(address)

    def test_memory_of_an_answer_that_comes_too_late_is_given_back(self, pool: Pool) -> None:
        returned: SimpleQueue[object] = SimpleQueue()
        timed_out = threading.Event()

        def behave(connection: socket.socket) -> None:
            greet(connection)
            number = next_request(connection).number
            timed_out.wait(EVENT_LIMIT)
            connection.send(answer(number, b"", (), Extent(4096, (1,))))
            returned.put(decode_to_server(connection.recv(LARGEST_MESSAGE)))

        with fake_door(behave) as address, closing(Neighbor(pool, address, SERVER)) as neighbor:
            outcomes: SimpleQueue[Outcome | SystemException] = SimpleQueue()
            outgoing = Outgoing("t", "o", 0.05, LIMIT, "it")
            neighbor.channel().begin(outgoing, b"", b"", outcomes.put)
            assert isinstance(outcomes.get(timeout=EVENT_LIMIT), NoAnswer)
            timed_out.set()
            assert returned.get(timeout=EVENT_LIMIT) == Return(1, 4096)

    def test_calls_in_flight_end_when_their_server_is_lost_and_all_is_closed_at_once(
        self, pool: Pool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        outcomes: SimpleQueue[Outcome | SystemException] = SimpleQueue()
        submit = pool.submit
        late: list[Callable[[], object]] = []
        with fake_door(replying()) as address:
            neighborhood = Neighborhood(pool, lambda pattern, changed: None, OwnCalls("c0ffee"))
            neighbor = neighborhood.neighbor(SERVER, address)
            assert neighbor is not None
            outgoing = Outgoing("t", "o", FOREVER, LIMIT, "it")
            neighbor.channel().begin(outgoing, b"", b"", outcomes.put)
            pool.detach(neighbor.channel())  # and it does not notice the end by itself
            monkeypatch.setattr(pool, "submit", late.append)
            neighborhood.lost(SERVER)
            monkeypatch.setattr(pool, "submit", submit)
            neighborhood.close()
            for job in late:
                job()
            assert isinstance(outcomes.get(timeout=EVENT_LIMIT), NoAnswer)

    def test_any_answers_end_the_call_within_its_limit(self, call: Call) -> None:
        hostile = HostileBytes(0)
        refused = 0
        with closing(Arena()) as arena:
            calls = repeated(30, soak=300)
            for _ in range(calls):
                data = hostile.next_input([*SOUND, *bombs()])[: 2 * LARGEST_MESSAGE]

                def behave(connection: socket.socket, data: bytes = data) -> None:
                    greet(connection, arena.file)
                    next_request(connection)
                    connection.send(data)

                try:
                    with fake_door(behave) as address:
                        assert call(address)[0]
                except SystemException:
                    refused += 1
        assert refused > calls / 2


def test_a_door_that_lies_is_passed_by(pair: Pair) -> None:
    """Whatever is behind it, calls reach the servant over Zenoh, or end with an error."""
    lies: list[Behavior] = [
        lambda connection: None,
        lambda connection: connection.send(b"\xc1"),
        lambda connection: connection.send(encode((HELLO, VERSION, "abc"))),
    ]

    def serve(query: zenoh.Query) -> None:
        with query:
            query.reply(query.key_expr, msgpack.packb({"returnValue": 3.0}))

    with stranger(pair.endpoint) as server:
        for lie in lies:
            calculator = CalculatorPrx.uncheckedCast(pair.client.stringToProxy("Calculator"))
            with (
                fake_door(lie) as address,
                server.impersonating(TARGET, CALCULATOR.type_id, CALCULATOR.fingerprint, serve, door=address),
            ):
                until(lambda: bool(pair.client.identities()))
                for _ in range(3):
                    assert calculator.add(1.0, 2.0) == 3.0
            until(lambda: not pair.client.identities())
