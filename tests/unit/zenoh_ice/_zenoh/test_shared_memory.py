"""Large byte sequences through memory files: written and read as by two processes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zenoh

from tests.support.memory_files import NEAR, shared_maps, shared_memory
from tests.support.wire_values import pack
from zenoh_ice import ConnectionLostException, MarshalException
from zenoh_ice._codec import LARGE, Codec, Parted, Pieces
from zenoh_ice._values import Struct
from zenoh_ice._zenoh import shared_memory as module
from zenoh_ice._zenoh.shared_memory import (
    MemoryReference,
    Ring,
    SharedMemory,
    decode_reference,
    memory_space,
)

LIMIT = 64 << 20
SLOTS = 8

pytestmark = pytest.mark.skipif(not memory_space(), reason="no memory is shared here")


class Image(Struct):
    width: int
    pixels: bytes
    mask: bytes
    comment: str


CODEC = Codec(Image)


@pytest.fixture(autouse=True)
def no_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait neither at the end for subscribers that do not read, nor for tokens: all are known at once."""
    monkeypatch.setattr(module, "_LAST_READS", 0.0)
    monkeypatch.setattr(module, "_WORD_COMES", 0.0)


@pytest.fixture
def sender() -> Iterator[SharedMemory]:
    memory = shared_memory()
    yield memory
    memory.close()


@pytest.fixture
def reader() -> Iterator[SharedMemory]:
    memory = shared_memory()
    yield memory
    memory.close()


def image(fill: int, size: int = LARGE) -> tuple[int, bytes, bytes, str]:
    return fill, bytes([fill]) * size, b"small", f"image {fill}"


def pieces(fill: int, size: int = LARGE) -> Pieces:
    gathered = CODEC.gather_result(image(fill, size), "it")
    assert isinstance(gathered, Pieces)
    return gathered


def place(ring: Ring, fill: int, size: int = LARGE) -> bytes:
    reference = ring.place(pieces(fill, size))
    assert reference is not None
    return reference


def lend(sender: SharedMemory, fill: int, size: int = LARGE) -> bytes:
    reference = sender.lend(pieces(fill, size), NEAR)
    assert reference is not None
    return reference


def read(memory: SharedMemory, payload: bytes) -> Image:
    return CODEC.unpack(memory.read(zenoh.ZBytes(payload), LIMIT, "it"), "it")


def changed(reference: bytes, **members: Any) -> bytes:
    return msgspec.msgpack.encode(msgspec.structs.replace(decode_reference(reference, "it"), **members))


def test_what_is_lent_arrives_as_it_was(sender: SharedMemory, reader: SharedMemory) -> None:
    for fill in range(3 * SLOTS):  # each is given back
        assert read(reader, lend(sender, fill)) == Image(*image(fill))


def test_several_large_sequences_arrive_at_their_places(sender: SharedMemory, reader: SharedMemory) -> None:
    value = 3, b"p" * LARGE, b"m" * (2 * LARGE), "both"
    gathered = CODEC.gather_result(value, "it")
    assert isinstance(gathered, Pieces)
    reference = sender.lend(gathered, NEAR)
    assert reference is not None
    assert len(reference) < 400  # it is all that travels
    assert read(reader, reference) == Image(*value)


def test_what_travelled_whole_is_taken_as_it_is(reader: SharedMemory) -> None:
    assert read(reader, pack(CODEC, image(1), "it")) == Image(*image(1))


def test_lent_memory_is_used_again_when_it_was_given_back(sender: SharedMemory, reader: SharedMemory) -> None:
    references = [lend(sender, fill) for fill in range(SLOTS)]
    assert sender.lend(pieces(99), NEAR) is None  # all are lent
    assert read(reader, references[5]) == Image(*image(5))
    assert read(reader, lend(sender, 100)) == Image(*image(100))
    assert read(reader, references[6]) == Image(*image(6))


def test_lent_memory_is_used_again_after_a_while(
    sender: SharedMemory, reader: SharedMemory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LENT_FOR", -1.0)
    late = lend(sender, 1)
    assert read(reader, lend(sender, 2)) == Image(*image(2))
    with pytest.raises(ConnectionLostException, match="not read in time"):
        read(reader, late)


def test_who_reads_too_late_does_not_give_back_what_is_another_s(
    sender: SharedMemory, reader: SharedMemory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LENT_FOR", -1.0)
    late = lend(sender, 1)
    monkeypatch.setattr(module, "LENT_FOR", 60.0)
    references = [lend(sender, fill) for fill in range(SLOTS)]
    with pytest.raises(ConnectionLostException):
        read(reader, late)
    assert sender.lend(pieces(99), NEAR) is None
    assert [read(reader, reference).width for reference in references] == list(range(SLOTS))


def test_the_newest_of_a_stream_takes_the_place_of_the_oldest(
    sender: SharedMemory, reader: SharedMemory
) -> None:
    ring = Ring(sender)
    references = [place(ring, fill) for fill in range(SLOTS + 1)]
    with pytest.raises(ConnectionLostException, match="not read in time"):
        read(reader, references[0])
    for _ in range(2):  # a stream has many readers
        assert [read(reader, reference).width for reference in references[1:]] == list(range(1, SLOTS + 1))


def test_a_stream_whose_images_grow_gets_larger_memory(sender: SharedMemory, reader: SharedMemory) -> None:
    ring = Ring(sender)
    for size in (LARGE, 5 * LARGE, LARGE):
        assert read(reader, place(ring, 1, size)) == Image(*image(1, size))
    ring.close()
    assert read(reader, place(ring, 2)) == Image(*image(2))


def test_what_is_larger_than_all_memory_is_not_placed(
    sender: SharedMemory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_LARGEST_SLOT", LARGE)
    assert sender.lend(pieces(1, LARGE + 1), NEAR) is None
    assert Ring(sender).place(pieces(1, LARGE + 1)) is None
    assert Ring(sender).place(pieces(1)) is not None


def test_without_shared_memory_nothing_is_placed() -> None:
    memory = shared_memory(enabled=False)
    assert (memory.space, memory.lend(pieces(1), NEAR), Ring(memory).place(pieces(1))) == ("", None, None)


def test_who_is_closed_places_nothing(sender: SharedMemory) -> None:
    ring = Ring(sender)
    place(ring, 1)
    lend(sender, 1)
    sender.close()
    assert sender.lend(pieces(1), NEAR) is None
    assert ring.place(pieces(1)) is None


def test_who_is_closed_reads_nothing(sender: SharedMemory, reader: SharedMemory) -> None:
    reader.close()
    with pytest.raises(ConnectionLostException):
        read(reader, lend(sender, 1))
    assert shared_maps() == 1  # the sender's own


def test_a_system_without_room_is_reported_once(
    sender: SharedMemory, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(*_: object) -> int:
        raise OSError("no room")

    monkeypatch.setattr(os, "ftruncate", full)
    files = len(list(Path("/proc/self/fd").iterdir()))
    assert [sender.lend(pieces(1), NEAR) for _ in range(3)] == [None] * 3
    assert caplog.text.count("no shared memory") == 1
    assert len(list(Path("/proc/self/fd").iterdir())) == files


def test_what_was_mapped_is_let_go_when_its_maker_has_ended(reader: SharedMemory) -> None:
    for fill in range(5):
        sender = shared_memory()
        before = lend(sender, fill)
        assert read(reader, before) == Image(*image(fill))
        unread = place(Ring(sender), fill)
        sender.close()
        with pytest.raises(ConnectionLostException, match="its sender ended"):
            read(reader, unread)
    assert shared_maps() == 0
    sender = shared_memory()
    assert read(reader, lend(sender, 1)).width == 1
    assert shared_maps() == 2  # the sender's own, too
    sender.close()
    reader.close()
    assert shared_maps() == 0


def test_a_process_that_ended_is_named_as_the_reason(sender: SharedMemory, reader: SharedMemory) -> None:
    ended = (1 << 31) - 1
    with pytest.raises(ConnectionLostException, match="its sender ended"):
        read(reader, changed(lend(sender, 1), process=ended))


class TestForgedReferences:
    @pytest.mark.parametrize(
        "members",
        [
            {"token": "0" * 32},
            {"file": 0},
            {"file": (1 << 31) - 1},
            {"process": 1},
            {"generation": 2},
            {"slot": 1},
        ],
    )
    def test_to_something_else_is_lost(
        self, sender: SharedMemory, reader: SharedMemory, members: dict[str, Any]
    ) -> None:
        with pytest.raises(ConnectionLostException):
            read(reader, changed(place(Ring(sender), 1), **members))

    @pytest.mark.parametrize(
        "members",
        [
            {"slot": SLOTS},
            {"slot": -1},
            {"generation": 0},
            {"slot": SLOTS - 1, "sizes": (LARGE + 4096,)},
            {"sizes": (LARGE * 32,)},
            {"sizes": (1 << 60,)},
            {"sizes": (1, 2), "places": (0,)},
            {"sizes": ()},
            {"places": (2,)},
            {"places": (1 << 40,)},
            {"rest": b"\x80"},
            {"rest": b"\xc1"},
        ],
    )
    def test_that_makes_no_sense_is_refused(
        self, sender: SharedMemory, reader: SharedMemory, members: dict[str, Any]
    ) -> None:
        with pytest.raises(MarshalException):
            read(reader, changed(place(Ring(sender), 1), **members))

    def test_to_a_pipe_does_not_open_it(self, sender: SharedMemory, reader: SharedMemory) -> None:
        receiving, sending = os.pipe()
        try:
            with pytest.raises(ConnectionLostException):
                read(reader, changed(place(Ring(sender), 1), file=receiving))
        finally:
            os.close(receiving)
            os.close(sending)

    def test_to_memory_that_its_maker_could_take_away_is_not_read(
        self, reader: SharedMemory, caplog: pytest.LogCaptureFixture
    ) -> None:
        token = "ab" * 16
        file = os.memfd_create(f"zenoh_ice-{token}", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(file, LARGE * 2)
            reference = MemoryReference(os.getpid(), file, token, 0, 1, False, (0,), (LARGE,), b"\x80")
            for _ in range(2):
                with pytest.raises(ConnectionLostException, match="not sealed"):
                    read(reader, msgspec.msgpack.encode(reference))
            assert caplog.text.count("may not read the memory of others") == 1
        finally:
            os.close(file)

    @pytest.mark.parametrize("payload", [b"\x90", b"\x99" + b"\xc0" * 9, b"\x9f" + b"\x01" * 15, b"\x93\x01"])
    def test_malformed_is_refused(self, reader: SharedMemory, payload: bytes) -> None:
        with pytest.raises(MarshalException, match="reference to shared memory"):
            read(reader, payload)

    def test_more_than_the_limit_is_refused_before_it_is_copied(self, sender: SharedMemory) -> None:
        reference = place(Ring(sender), 1)
        maps_nothing = shared_memory()
        with pytest.raises(MarshalException, match=f"at most {LARGE} are accepted"):
            maps_nothing.read(zenoh.ZBytes(reference), LARGE, "it")
        with pytest.raises(MarshalException, match="at most 10 are accepted"):
            maps_nothing.read(zenoh.ZBytes(reference), 10, "it")
        assert shared_maps() == 1  # the sender's own


def test_large_bytes_that_belong_nowhere_are_refused() -> None:
    class Nothing(Struct):
        pass

    with pytest.raises(MarshalException, match="where there are none"):
        Codec(Nothing).unpack(Parted(b"\x80", (0,), [b"x"]), "it")
