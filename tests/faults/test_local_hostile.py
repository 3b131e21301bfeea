"""Strangers at the socket of a server: a process of its user may do what it likes there, and harms itself alone."""

from __future__ import annotations

import logging
import os
import resource
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, suppress

import pytest

from tests.support.hostile_bytes import HostileBytes, bombs
from tests.support.limited import limited
from tests.support.limits import EVENT_LIMIT, FOREVER, RUN_LIMIT
from tests.support.local_strangers import SERVER, Echo, Visitor
from tests.support.open_files import open_files
from tests.support.waiting import until
from zenoh_ice.carriers._local.channels import Channels, NotSent, Outgoing
from zenoh_ice.carriers._local.messages import (
    LARGEST_INLINE,
    LARGEST_MESSAGE,
    PART,
    REQUEST,
    RETURN,
    SUBSCRIBE,
    Response,
    Subscribed,
    decode_to_client,
    encode,
)
from zenoh_ice.carriers._local.server import _ACCEPT_PERIOD, LocalServer, local_space
from zenoh_ice.data.exceptions import ObjectNotExistException
from zenoh_ice.data.wire import decode_error
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Receivers

TARGET = "nao/Echo"
LARGE = bytes(100_000)
THREADS = 8
SOUND = [
    encode((REQUEST, TARGET, "echo", b"", b"payload")),
    encode((PART, bytes(LARGEST_INLINE))),
    encode((RETURN, 0)),
    encode((SUBSCRIBE, TARGET, "stream")),
]

pytestmark = pytest.mark.skipif(not local_space(), reason="no process reaches another one's server here")


@pytest.fixture
def pool() -> Iterator[Pool]:
    pool = Pool(THREADS, "test")
    yield pool
    assert pool.close(EVENT_LIMIT)


@pytest.fixture
def echo() -> Echo:
    return Echo()


@pytest.fixture
def limits() -> Limits:
    """The limits of the server."""
    return LIMITS


@pytest.fixture
def server(pool: Pool, echo: Echo, limits: Limits) -> Iterator[LocalServer]:
    with closing(LocalServer(pool, Receivers({TARGET: echo}), SERVER, limits)) as server:
        yield server


@pytest.fixture
def call(pool: Pool, server: LocalServer) -> Iterator[Callable[..., bytes]]:
    """Call as another process does, with a connection that lasts."""
    with closing(Channels(server.address, SERVER)) as channels:

        def call(payload: bytes = b"", operation: str = "echo") -> bytes:
            outgoing = Outgoing(TARGET, operation, EVENT_LIMIT, 1 << 25, "it")
            ok, answer = channels.call(outgoing, payload, b"")
            assert ok
            assert isinstance(answer, bytes)
            return answer

        assert call(b"before") == b"before"
        yield call


Call = Callable[..., bytes]


def is_the_last(answer: Response) -> bool:
    """Return whether an answer has the end of the last payload, or is lent, as with a part before it."""
    return answer.extent is not None or answer.payload.endswith(b"the last one")


@pytest.fixture(autouse=True)
def undisturbed(call: Call) -> Iterator[None]:
    """Check that another client is served as before, over the same connection."""
    before = open_files()
    yield
    assert call(b"after") == b"after"
    assert call(LARGE) == LARGE
    until(lambda: open_files() <= before)


def note_pauses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return a list of the pauses after which a server tries again to take a connection."""
    pauses: list[float] = []
    sleep = time.sleep

    def noting(seconds: float) -> None:
        if seconds == _ACCEPT_PERIOD:
            pauses.append(seconds)
        sleep(seconds)

    monkeypatch.setattr(time, "sleep", noting)
    return pauses


class TestVisitors:
    def test_who_says_nothing_or_leaves_at_once_disturbs_nobody(
        self, server: LocalServer, call: Call
    ) -> None:
        with Visitor(server.address).enter(), Visitor(server.address):
            for _ in range(50):
                Visitor(server.address).socket.close()
            assert call(LARGE) == LARGE

    @pytest.mark.parametrize(
        "message",
        [
            b"",
            b"GET / HTTP/1.1\r\n\r\n",
            SOUND[0][:-1],
            SOUND[0] + b"x",
            encode((RETURN, -1)),
            *(bomb[:LARGEST_MESSAGE] for bomb in bombs()),
        ],
        ids=lambda message: message[:8].hex(),
    )
    def test_a_malformed_message_ends_its_connection_and_nothing_else(
        self, server: LocalServer, message: bytes
    ) -> None:
        with Visitor(server.address).enter() as visitor, Visitor(server.address).enter() as other:
            visitor.socket.send(message)
            assert visitor.is_out()
            other.ask(TARGET, "echo", b"other")
            assert other.answer().payload == b"other"

    def test_any_bytes_are_answered_or_end_the_connection(self, server: LocalServer) -> None:
        hostile = HostileBytes(0)
        ends = 0
        for _ in range(300):
            with Visitor(server.address).enter() as visitor:
                try:
                    visitor.socket.send(hostile.next_input(SOUND)[: 2 * LARGEST_MESSAGE])
                    visitor.ask(TARGET, "echo", b"the last one")
                    while not is_the_last(visitor.answer()):
                        pass
                except ConnectionError:
                    ends += 1
        assert 30 < ends < 300

    @pytest.mark.parametrize("target", ["", "nao/None", "x" * 512, "\x1b]0;owned\x07\n\u202e", "**"])
    def test_what_is_not_served_is_refused_with_a_reason(self, server: LocalServer, target: str) -> None:
        with Visitor(server.address).enter() as visitor:
            visitor.ask(target, "echo")
            answer = visitor.answer()
            assert not answer.ok
            error = decode_error(answer.payload, (), "it")
            assert isinstance(error, ObjectNotExistException)
            assert str(error).isprintable()

    def test_memory_that_was_not_lent_is_not_given_back(self, server: LocalServer, echo: Echo) -> None:
        with Visitor(server.address).enter() as victim, Visitor(server.address).enter() as visitor:
            victim.ask(TARGET, "big")
            lent = victim.answer().extent
            assert lent is not None
            visitor.socket.send(encode((RETURN, lent.start)))
            victim.socket.send(encode((RETURN, lent.start + 1)))
            visitor.ask(TARGET, "big")
            other = visitor.answer().extent
            assert other is not None
            assert other.start != lent.start

    def test_files_that_nobody_asked_for_are_not_kept(self, server: LocalServer) -> None:
        with Visitor(server.address).enter() as visitor, Visitor(server.address).enter() as other:
            other.ask(TARGET, "echo")
            other.answer()
            before = open_files()
            for number in range(10):
                socket.send_fds(visitor.socket, [SOUND[0]], [0, 1, 2])
                assert visitor.answer().ok, number
            until(lambda: open_files() <= before)

    def test_a_call_that_lay_in_its_socket_while_its_client_left_is_known_as_such(
        self, server: LocalServer, pool: Pool, echo: Echo
    ) -> None:
        busy, free = threading.Semaphore(0), threading.Event()

        def occupy() -> None:
            busy.release()
            free.wait(EVENT_LIMIT)

        with Visitor(server.address).enter() as visitor:
            for _ in range(THREADS + 1):  # one more, which waits for files
                pool.submit(occupy)
                assert busy.acquire(timeout=EVENT_LIMIT)
            visitor.ask(TARGET, "left")
        free.set()
        until(lambda: ("left", True) in echo.gone)
        assert ("left", False) not in echo.gone

    @limited(last_reads=0.0)
    def test_memory_of_a_call_whose_client_left_is_free_again(self, server: LocalServer, echo: Echo) -> None:
        assert server.arena is not None
        with Visitor(server.address).enter() as visitor:
            for _ in range(2):
                visitor.socket.send(encode((PART, bytes(LARGEST_INLINE))))
                visitor.ask(TARGET, "wait", b"x")
            assert echo.entered.wait(EVENT_LIMIT)
        until(lambda: len(server._channels) == 1)
        echo.leave.set()
        for _ in range(2):
            assert echo.left.acquire(timeout=EVENT_LIMIT)
        extent = server.arena.lend([b"x"], [object()])
        assert extent is not None
        assert extent.start == 0


class TestFloods:
    def test_more_connections_than_half_the_files_are_refused(
        self, pool: Pool, echo: Echo, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(resource, "getrlimit", lambda _: (40, 40))
        with closing(LocalServer(pool, Receivers({TARGET: echo}), SERVER)) as server, ExitStack() as stack:
            for _ in range(20):
                stack.enter_context(Visitor(server.address).enter())
            for _ in range(5):
                with Visitor(server.address) as visitor, pytest.raises(ConnectionError):
                    visitor.enter()
            with closing(Channels(server.address, SERVER)) as late, pytest.raises(NotSent):
                late.call(Outgoing(TARGET, "echo", EVENT_LIMIT, 100, "it"), b"", b"")
            stack.pop_all().close()
            until(lambda: not server._channels)
            with Visitor(server.address).enter() as visitor:
                visitor.ask(TARGET, "echo", b"x")
                assert visitor.answer().payload == b"x"

    def test_a_process_without_a_file_left_serves_on_and_says_so_once(
        self,
        server: LocalServer,
        call: Call,
        caplog: pytest.LogCaptureFixture,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        pauses = note_pauses(monkeypatch)
        most = resource.getrlimit(resource.RLIMIT_NOFILE)
        with Visitor(server.address).enter(), ExitStack() as stack:
            visitors = [socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(5)]
            for each in visitors:
                stack.callback(each.close)
            _, process, handle = server.address.split(".")
            resource.setrlimit(resource.RLIMIT_NOFILE, (3, most[1]))
            stack.callback(resource.setrlimit, resource.RLIMIT_NOFILE, most)
            for each in visitors:
                each.settimeout(EVENT_LIMIT)
                each.connect(f"/proc/{process}/fd/{handle}")
            until(lambda: "no further connection" in caplog.text)
            until(lambda: len(pauses) > 5)
            assert call(b"meanwhile") == b"meanwhile"
            assert caplog.text.count("no further connection") == 1
            resource.setrlimit(resource.RLIMIT_NOFILE, most)
            for each in visitors:
                assert each.recv(LARGEST_MESSAGE)

    @pytest.mark.parametrize(
        "message",
        [SOUND[1], encode((REQUEST, TARGET, "echo", b"", bytes(10_000)))],
        ids=["parts without an end", "calls whose answers are not read"],
    )
    def test_who_sends_without_end_is_cut_off(self, server: LocalServer, message: bytes) -> None:
        with Visitor(server.address).enter() as visitor, pytest.raises(OSError, match=r"Broken pipe|reset"):
            visitor.flood(message)

    @limited(sending=0.05)
    def test_who_reads_no_answer_for_a_while_is_sent_no_more(self, server: LocalServer) -> None:
        others = set(server._channels)
        with Visitor(server.address).enter() as visitor:
            (connection,) = server._channels - others
            with suppress(ConnectionError):  # it may be cut off while it still asks
                for _ in range(100):
                    visitor.ask(TARGET, "echo", bytes(10_000))
            until(lambda: connection._closed)
            answered = 0
            with suppress(ConnectionError):
                while visitor.answer():
                    answered += 1
            assert answered < 100
        until(lambda: len(server._channels) == 1)

    @limited(sending=FOREVER)
    def test_nobody_waits_for_those_who_read_late_and_they_get_all(
        self, server: LocalServer, call: Call
    ) -> None:
        with ExitStack() as stack:
            late = [stack.enter_context(Visitor(server.address).enter()) for _ in range(12)]  # of 8 threads
            for visitor in late:
                for number in range(100):
                    visitor.ask(TARGET, "echo", bytes([number]) * 10_000)
                assert call(b"meanwhile") == b"meanwhile"
            for visitor in late:
                for number in range(100):
                    assert visitor.answer().payload == bytes([number]) * 10_000

    def test_who_leaves_while_answers_wait_for_it_is_forgotten(self, server: LocalServer) -> None:
        with Visitor(server.address).enter() as visitor:
            for _ in range(100):
                visitor.ask(TARGET, "echo", bytes(10_000))
        until(lambda: len(server._channels) == 1)

    def test_no_more_than_some_listen_to_a_stream(self, server: LocalServer) -> None:
        listeners = server.publish(f"{TARGET}/stream")
        assert listeners is not None
        with Visitor(server.address).enter() as visitor:
            for _ in range(256):
                visitor.socket.send(encode((SUBSCRIBE, TARGET, "stream")))
                assert decode_to_client(visitor.socket.recv(LARGEST_MESSAGE)) == Subscribed()
            visitor.socket.send(encode((SUBSCRIBE, TARGET, "stream")))
            assert visitor.is_out()
        until(lambda: not listeners)

    def test_floods_of_messages_without_calls_leave_threads_to_others(
        self, server: LocalServer, call: Call
    ) -> None:
        program = """
import sys
from tests.support.local_strangers import Visitor
visitors = [Visitor(sys.argv[1]).enter() for _ in range(16)]
print("ready", flush=True)
message = bytes.fromhex(sys.argv[2])
while True:
    for visitor in visitors:
        visitor.socket.send(message)
"""
        command = [sys.executable, "-c", program, server.address, SOUND[2].hex()]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout is not None
                assert process.stdout.readline() == "ready\n"
                for _ in range(50):
                    assert call(b"meanwhile") == b"meanwhile"
            finally:
                process.kill()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_a_process_of_another_user_is_not_let_in(server: LocalServer) -> None:
    program = """
import os, sys
from tests.support.local_strangers import Visitor
os.setgroups([])
os.setgid(65534)
os.setuid(65534)
try:
    Visitor(sys.argv[1]).enter()
except OSError as error:
    print(type(error).__name__)
"""
    done = subprocess.run(
        [sys.executable, "-c", program, server.address],
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=True,
    )
    assert done.stdout.strip() in {"PermissionError", "FileNotFoundError"}


def test_a_process_of_another_user_that_found_the_socket_is_refused(
    server: LocalServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    own = os.geteuid()
    monkeypatch.setattr("zenoh_ice.carriers._local.messages.owner_of", lambda _: own + 1)
    with Visitor(server.address) as visitor, pytest.raises(ConnectionError):
        visitor.enter()
    assert "a process of another user" in caplog.text
