"""Servers that do nothing as they should: their clients get an error or call over Zenoh, and lose nothing."""

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

from tests.support.calculator import CALCULATOR, CalculatorPrx
from tests.support.hostile_bytes import HostileBytes, bombs
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.local_strangers import SERVER, answer, fake_server, greet, next_request
from tests.support.open_files import open_files
from tests.support.soak import cases, repeated
from tests.support.stranger import stranger
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import MarshalException, SystemException
from zenoh_ice.carriers._local.channels import Channels, NotSent, Outgoing
from zenoh_ice.carriers._local.memory import Arena, Extent
from zenoh_ice.carriers._local.messages import (
    HELLO,
    LARGEST_INLINE,
    LARGEST_MESSAGE,
    PART,
    REQUEST,
    SAMPLE,
    SUBSCRIBED,
    VERSION,
    encode,
)
from zenoh_ice.carriers._local.server import local_space
from zenoh_ice.data.keys import Target
from zenoh_ice.routes._calls import Routes
from zenoh_ice.threads.limits import Limits
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import NoAnswer, Outcome, Registration

TARGET = Target("nao", "Calculator")
LIMIT = 1 << 20
SOUND = [
    answer(b"payload"),
    answer(b"rest", (0,), Extent(0, (1,))),
    encode((PART, bytes(LARGEST_INLINE))),
    encode((SUBSCRIBED,)),
    encode((SAMPLE, b"a", b"payload")),
]

pytestmark = pytest.mark.skipif(not local_space(), reason="no process reaches another one's socket here")

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


@pytest.fixture
def call() -> Callable[..., Outcome]:
    """Call once at an address."""

    def call(address: str, timeout: float = EVENT_LIMIT, hello: float = EVENT_LIMIT) -> Outcome:
        limits = Limits(hello=hello, hello_share=math.inf)
        with closing(Channels(address, SERVER, limits)) as channels:
            return channels.call(Outgoing("t", "o", timeout, LIMIT, "it"), b"arguments", b"")

    return call


Call = Callable[..., Outcome]


def replying(*messages: bytes, file: int | None = None) -> Behavior:
    """Greet, and answer a call with some messages."""

    def behave(connection: socket.socket) -> None:
        greet(connection, file)
        next_request(connection)
        for message in messages:
            connection.send(message)
        connection.recv(1)  # until the client ends it

    return behave


def test_a_server_that_answers_is_called(call: Call) -> None:
    with fake_server(replying(answer(b"result"))) as address:
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
            lambda connection: socket.send_fds(connection, [encode((HELLO, VERSION, SERVER))], [0]),
            lambda connection: socket.send_fds(connection, [encode((HELLO, VERSION, SERVER))], [0] * 8),
        ],
        ids=["none", "garbage", "long", "version", "other", "name", "answer", "no memory", "files"],
    )
    def test_a_wrong_one_makes_no_channel(self, call: Call, behave: Behavior) -> None:
        with fake_server(behave) as address, pytest.raises(NotSent):
            call(address)

    def test_who_does_not_greet_is_not_waited_for_long(self, call: Call) -> None:
        with fake_server(lambda connection: connection.recv(1)) as address, pytest.raises(NotSent):
            call(address, hello=0.05)

    @pytest.mark.parametrize("kind", ["stream", "datagram", "pipe", "none"])
    def test_what_is_no_server_makes_no_channel(self, call: Call, kind: str) -> None:
        ends = socket.socketpair(
            socket.AF_UNIX, socket.SOCK_DGRAM if kind == "datagram" else socket.SOCK_STREAM
        )
        receiving, sending = os.pipe()
        try:
            file = {"pipe": receiving, "none": 99_999}.get(kind, ends[0].fileno())
            with pytest.raises(NotSent):
                call(f"{local_space()}.{os.getpid()}.{file}")
            with pytest.raises(NotSent):
                call(f"{local_space()}.4294967295.{file}")
        finally:
            for end in ends:
                end.close()
            os.close(receiving)
            os.close(sending)

    def test_a_process_of_another_user_makes_no_channel(
        self, call: Call, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        own = os.geteuid()
        monkeypatch.setattr("zenoh_ice.carriers._local.messages.owner_of", lambda _: own + 1)
        with (
            fake_server(replying(answer())) as address,
            pytest.raises(NotSent, match="user"),
        ):
            call(address)

    def test_the_memory_of_another_process_is_not_kept(self, pool: Pool) -> None:
        with closing(Arena()) as arena, closing(Arena()) as wrong:
            extent, other = (each.lend([text], [self]) for each, text in ((arena, b"own"), (wrong, b"bad")))
            assert extent == other
            greetings = [("abc", wrong.file), (SERVER, arena.file)]

            def behave(connection: socket.socket) -> None:
                server, file = greetings.pop(0)
                greet(connection, file, server)
                next_request(connection)
                connection.send(answer(b"", (), extent))

            with fake_server(behave) as address, closing(Channels(address, SERVER)) as channels:
                outgoing = Outgoing("t", "o", EVENT_LIMIT, LIMIT, "it")
                with pytest.raises(NotSent):
                    channels.call(outgoing, b"", b"")
                channels._absent_until = 0.0
                assert channels.call(outgoing, b"", b"") == (True, b"own")

    def test_a_client_that_may_open_no_file_calls_over_the_network(self, call: Call) -> None:
        most = resource.getrlimit(resource.RLIMIT_NOFILE)
        with closing(Arena()) as arena, fake_server(replying(answer(), file=arena.file)) as address:
            resource.setrlimit(resource.RLIMIT_NOFILE, (3, most[1]))
            try:
                with pytest.raises(NotSent):
                    call(address)
            finally:
                resource.setrlimit(resource.RLIMIT_NOFILE, most)


@pytest.mark.usefixtures("no_file_stays_open")
class TestAnswers:
    @pytest.mark.parametrize(
        "messages",
        [
            pytest.param([b"\xc1"], id="garbage"),
            pytest.param([bytes(LARGEST_MESSAGE + 1000)], id="long"),
            pytest.param([SOUND[0][:-1]], id="truncated"),
            pytest.param([b""], id="empty"),
            pytest.param([encode((REQUEST, "t", "o", b"", b""))], id="call"),
            pytest.param([SOUND[3]], id="subscribed"),
            pytest.param([SOUND[4]], id="sample"),
            pytest.param([*[SOUND[2]] * 20, answer()], id="more than the limit"),
            pytest.param([SOUND[2]] * 1000, id="parts without end"),
            pytest.param([answer(b"", (0,), Extent((256 << 20) - 1, (2,)))], id="beyond the memory"),
            pytest.param([answer(b"", (0, 1), Extent(0, (1,)))], id="more places than sizes"),
        ],
    )
    @pytest.mark.parametrize("lends", cases([True], [False]))
    def test_what_is_no_answer_ends_the_call(self, call: Call, messages: list[bytes], lends: bool) -> None:
        with closing(Arena()) as arena:
            behave = replying(*messages, file=arena.file if lends else None)
            with (
                fake_server(behave) as address,
                pytest.raises(NoAnswer if messages == [b""] else MarshalException),
            ):
                call(address)

    def test_an_end_in_the_middle_ends_the_call(self, call: Call) -> None:
        def behave(connection: socket.socket) -> None:
            greet(connection)
            next_request(connection)
            connection.send(SOUND[2])

        with fake_server(behave) as address, pytest.raises(NoAnswer) as raised:
            call(address)
        assert raised.value.broken

    def test_parts_that_dribble_do_not_extend_the_limit_of_a_call(self, call: Call) -> None:
        ended = threading.Event()

        def behave(connection: socket.socket) -> None:
            greet(connection)
            next_request(connection)
            while not ended.wait(0.02):
                connection.send(SOUND[2])

        with fake_server(behave) as address:
            with pytest.raises(NoAnswer) as raised:
                call(address, 0.2)
            ended.set()
            assert raised.value.timed_out

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
                    with fake_server(behave) as address:
                        assert call(address)[0]
                except SystemException:
                    refused += 1
        assert refused > calls / 2


def test_a_call_that_waits_ends_when_its_server_is_lost() -> None:
    outcomes: SimpleQueue[object] = SimpleQueue()
    called = threading.Event()

    def behave(connection: socket.socket) -> None:
        greet(connection)
        next_request(connection)
        called.set()
        connection.recv(1)  # nothing more: it is frozen

    def call() -> None:
        with pytest.raises(NoAnswer) as raised:
            known.call(Outgoing("t", "o", FOREVER, LIMIT, "it"), b"", b"")
        outcomes.put(raised.value.broken)

    with fake_server(behave) as address:
        routes = Routes(lambda pattern, changed: Registration(lambda: None))
        found = routes.channels(SERVER, address)
        assert found is not None
        known = found
        caller = threading.Thread(target=call)
        caller.start()
        assert called.wait(EVENT_LIMIT)
        routes.lost(SERVER)
        assert outcomes.get(timeout=EVENT_LIMIT) is True
        caller.join(EVENT_LIMIT)
        routes.close()


def test_a_server_that_lies_is_passed_by(pair: Pair) -> None:
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
                fake_server(lie) as address,
                server.impersonating(
                    TARGET, CALCULATOR.type_id, CALCULATOR.fingerprint, serve, address=address
                ),
            ):
                until(lambda: bool(pair.client.identities()))
                for _ in range(3):
                    assert calculator.add(1.0, 2.0) == 3.0
            until(lambda: not pair.client.identities())
