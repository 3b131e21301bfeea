"""Messages between processes of one machine: their encoding, their limits, and payloads in parts or in memory."""

from __future__ import annotations

import os
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import pytest

from tests.support.limits import EVENT_LIMIT
from tests.support.open_files import open_files
from zenoh_ice import MarshalException
from zenoh_ice.carriers._local.memory import Arena, ArenaView, Extent
from zenoh_ice.carriers._local.messages import (
    HELLO,
    LARGEST_INLINE,
    LARGEST_MESSAGE,
    PART,
    REQUEST,
    RESPONSE,
    RETURN,
    SAMPLE,
    SUBSCRIBE,
    SUBSCRIBED,
    VERSION,
    Hello,
    Part,
    Parts,
    Request,
    Response,
    Return,
    Sample,
    Subscribe,
    Subscribed,
    collect,
    decode_hello,
    decode_to_client,
    decode_to_server,
    encode,
    lend,
    limit_sending,
    owner_of,
    receive_with_file,
    send_parts,
)
from zenoh_ice.data.codec import DECODE_ERRORS, LARGE, LARGEST_BULK, Parted, Pieces
from zenoh_ice.data.wire import ATTACHMENT_LIMIT

FULL = bytes(LARGEST_INLINE)
READER = object()


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Both ends of a connection."""
    one, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with one, other:
        yield one, other


class TestEncoding:
    @pytest.mark.parametrize(
        ("message", "expected"),
        [
            ((PART, FULL), Part(FULL)),
            ((REQUEST, "nao/Head", "getPose", b"a", b"p"), Request("nao/Head", "getPose", b"a", b"p")),
            ((RETURN, 4096), Return(4096)),
            ((SUBSCRIBE, "nao/Camera", "getImageData"), Subscribe("nao/Camera", "getImageData")),
        ],
    )
    def test_what_a_client_sends_is_what_its_server_gets(
        self, message: tuple[object, ...], expected: object
    ) -> None:
        assert decode_to_server(encode(message)) == expected

    @pytest.mark.parametrize(
        ("message", "expected"),
        [
            ((PART, FULL), Part(FULL)),
            ((RESPONSE, True, b"p"), Response(True, b"p")),
            (
                (RESPONSE, True, b"p", (0, 2), Extent(4096, (9, 8))),
                Response(True, b"p", (0, 2), Extent(4096, (9, 8))),
            ),
            ((SUBSCRIBED,), Subscribed()),
            ((SAMPLE, b"a", b"p"), Sample(b"a", b"p")),
            ((SAMPLE, b"a", b"", (), Extent(0, (9,))), Sample(b"a", b"", (), Extent(0, (9,)))),
        ],
    )
    def test_what_a_server_sends_is_what_its_client_gets(
        self, message: tuple[object, ...], expected: object
    ) -> None:
        assert decode_to_client(encode(message)) == expected

    def test_a_server_says_who_it_is(self) -> None:
        assert decode_hello(encode((HELLO, VERSION, "c0ffee"))) == Hello(VERSION, "c0ffee")

    @pytest.mark.parametrize(
        "message",
        [
            (),
            (PART, b""),
            (PART, b"x"),
            (PART, FULL[1:]),
            (PART, FULL + b"x"),
            (REQUEST, 1, "t", "o", b"", b""),
            (REQUEST, "t" * 513, "o", b"", b""),
            (REQUEST, "t", "o" * 513, b"", b""),
            (REQUEST, "t", "o", b"a" * (ATTACHMENT_LIMIT + 1), b""),
            (REQUEST, "t", "o", b"", "text"),
            (REQUEST, "t", "o", b""),
            (RETURN, -4096),
            (RETURN, (1 << 64) - 1),
            (RETURN, "1"),
            (SUBSCRIBE, "t" * 513, "o"),
            (HELLO, VERSION, "c0ffee"),
            (RESPONSE, True, b""),
            (99, 1),
            ("REQUEST", 1),
        ],
    )
    def test_what_no_client_of_ours_sends_is_refused(self, message: tuple[object, ...]) -> None:
        with pytest.raises(DECODE_ERRORS):
            decode_to_server(encode(message))

    @pytest.mark.parametrize(
        "message",
        [
            (RESPONSE, 1, True, b""),
            (RESPONSE, 1, b""),
            (RESPONSE, True, None),
            (RESPONSE, True, b"", (-1,), Extent(0, (1,))),
            (RESPONSE, True, b"", (0,) * 257, Extent(0, (1,))),
            (RESPONSE, True, b"", (0,), (-1, (1,))),
            (RESPONSE, True, b"", (0,), (0, (-1,))),
            (RESPONSE, True, b"", (0,), (1 << 40, (1,))),
            (RESPONSE, True, b"", (0,), (0, (1 << 40,))),
            (RESPONSE, True, b"", (0,), (0, (1,) * 257)),
            (RESPONSE, True, b"", (0,), (0,)),
            (SAMPLE, b"a" * (ATTACHMENT_LIMIT + 1), b""),
            (REQUEST, 1, "t", "o", b"", b""),
        ],
    )
    def test_what_no_server_of_ours_sends_is_refused(self, message: tuple[object, ...]) -> None:
        with pytest.raises(DECODE_ERRORS):
            decode_to_client(encode(message))

    def test_the_largest_messages_are_whole(self, ends: tuple[socket.socket, socket.socket]) -> None:
        where = Extent(1 << 28, (1 << 25,) * 256)
        largest: list[tuple[object, ...]] = [
            (PART, FULL),
            (REQUEST, "é" * 256, "é" * 256, bytes(512), FULL),
            (RESPONSE, True, FULL, tuple(range(256)), where),
            (SAMPLE, bytes(512), FULL, tuple(range(256)), where),
        ]
        for message in largest:
            encoded = encode(message)
            assert len(encoded) <= LARGEST_MESSAGE
            ends[0].send(encoded)
            assert ends[1].recv(LARGEST_MESSAGE) == encoded


class TestParts:
    @pytest.mark.parametrize(
        "size", [0, 1, LARGEST_INLINE, LARGEST_INLINE + 1, 2 * LARGEST_INLINE, 1_000_000]
    )
    def test_a_payload_in_parts_is_whole_at_its_end(
        self, ends: tuple[socket.socket, socket.socket], size: int
    ) -> None:
        payload = os.urandom(size)
        last: list[bytes] = []

        def send() -> None:
            last.append(send_parts(ends[0].send, payload))
            ends[0].shutdown(socket.SHUT_WR)

        sender = threading.Thread(target=send)
        sender.start()
        parts = Parts()
        while message := ends[1].recv(LARGEST_MESSAGE):
            parts.append(decode_to_server(message).payload)
        sender.join(EVENT_LIMIT)
        assert len(last[0]) <= LARGEST_INLINE
        assert parts.complete(last[0]) == payload
        assert parts.complete(b"next") == b"next"

    def test_parts_without_end_are_refused(self) -> None:
        parts = Parts()
        for _ in range(LARGEST_BULK // LARGEST_INLINE):
            parts.append(FULL)
        with pytest.raises(MarshalException, match="at most"):
            parts.append(FULL)

    def test_who_receives_no_more_is_noticed(self, ends: tuple[socket.socket, socket.socket]) -> None:
        ends[1].close()
        with pytest.raises(BrokenPipeError):
            send_parts(ends[0].send, bytes(1 << 20))


class TestLending:
    def test_a_small_payload_travels_whole(self, arena: Arena) -> None:
        assert lend(b"small", arena, READER) == (b"small", (), None)
        assert lend(Pieces((b"a", b"b"), (b"c",), (0,)), arena, READER)[2] is None

    def test_a_large_payload_travels_in_memory(self, arena: Arena, view: ArenaView) -> None:
        payload = os.urandom(LARGEST_INLINE + 1)
        rest, places, extent = lend(payload, arena, READER)
        assert (rest, places) == (b"", ())
        assert collect(Response(True, rest, places, extent), view, 1 << 20, "it") == payload

    def test_large_byte_sequences_travel_in_memory(self, arena: Arena, view: ArenaView) -> None:
        large = [os.urandom(LARGE), os.urandom(2 * LARGE)]
        payload = Pieces((b"a", b"b", b"c"), large, (0, 3))
        rest, places, extent = lend(payload, arena, READER)
        collected = collect(Sample(b"", rest, places, extent), view, 1 << 20, "it")
        assert collected == Parted(payload.without_large(), (0, 3), large)

    def test_without_memory_a_payload_travels_whole(self, arena: Arena) -> None:
        payload = Pieces((b"a", b"b"), (bytes(LARGE),), (0,))
        arena.close()
        assert lend(payload, arena, READER) == (bytes(payload), (), None)
        assert lend(payload, None, READER) == (bytes(payload), (), None)

    @pytest.mark.parametrize(
        "members",
        [
            {"places": (0, 1)},
            {"places": (), "extent": Extent(0, (1, 2))},
            {"extent": Extent(0, ())},
            {"extent": Extent((256 << 20) - 1, (2,))},
            {"extent": Extent(0, (101,))},
            {"payload": bytes(101)},
            {"payload": bytes(60)},
        ],
    )
    def test_a_reference_that_makes_no_sense_is_refused(
        self, view: ArenaView, members: dict[str, Any]
    ) -> None:
        sound = Response(True, b"rest", (0,), Extent(0, (50,)))
        assert collect(sound, view, 100, "it") == Parted(b"rest", (0,), [bytes(50)])
        with pytest.raises(MarshalException):
            collect(msgspec.structs.replace(sound, **members), view, 100, "it")

    def test_a_reference_without_memory_is_refused(self) -> None:
        with pytest.raises(MarshalException, match="no memory"):
            collect(Response(True, b"", (), Extent(0, (1,))), None, 100, "it")


class TestSockets:
    def test_a_file_travels_with_a_message(self, ends: tuple[socket.socket, socket.socket]) -> None:
        with Path(__file__).open("rb") as file:
            socket.send_fds(ends[0], [b"one"], [file.fileno()])
            socket.send_fds(ends[0], [b"two"], [])
        message, received = receive_with_file(ends[1])
        assert message == b"one"
        assert received is not None
        assert not os.get_inheritable(received)
        os.close(received)
        assert receive_with_file(ends[1]) == (b"two", None)

    def test_more_files_than_one_are_refused_and_closed(
        self, ends: tuple[socket.socket, socket.socket]
    ) -> None:
        with Path(__file__).open("rb") as file:
            socket.send_fds(ends[0], [b"one"], [file.fileno()] * 5)
        before = open_files()
        with pytest.raises(OSError, match="could not be opened"):
            receive_with_file(ends[1])
        assert open_files() == before

    @pytest.mark.parametrize("seconds", [0.05, 1e-3, 1e-9, 0.0])
    def test_waits_end_at_their_limit(
        self, ends: tuple[socket.socket, socket.socket], seconds: float
    ) -> None:
        with suppress(BlockingIOError):
            while True:
                ends[0].send(FULL, socket.MSG_DONTWAIT)
        limit_sending(ends[0], seconds)
        began = time.monotonic()
        with pytest.raises(BlockingIOError):
            ends[0].send(FULL)
        assert time.monotonic() - began >= seconds * 0.9

    def test_waits_may_last_more_than_seconds(self, ends: tuple[socket.socket, socket.socket]) -> None:
        limit_sending(ends[0], 60.25)
        set_to = ends[0].getsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.calcsize("@ll"))
        seconds, microseconds = struct.unpack("@ll", set_to)
        assert seconds + microseconds * 1e-6 == pytest.approx(60.25, abs=0.01)

    def test_the_user_at_the_other_end_is_known(self, ends: tuple[socket.socket, socket.socket]) -> None:
        assert owner_of(ends[0]) == os.geteuid()
