"""Memory files from both sides: the content of slots, what a reader writes into them, their release."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import closing

import msgspec
import pytest
import zenoh

from tests.support.memory_files import NEAR, open_memory_files, shared_memory
from zenoh_ice import ConnectionLostException
from zenoh_ice._codec import LARGE, Parted, Pieces
from zenoh_ice._zenoh import shared_memory as module
from zenoh_ice._zenoh.shared_memory import (
    HEADER,
    MemoryFile,
    Ring,
    SharedMemory,
    decode_reference,
    memory_space,
)

pytestmark = pytest.mark.skipif(not memory_space(), reason="no memory is shared here")

# It looks like the header of a slot.
PICTURE = HEADER.pack(1, 0) * (LARGE // HEADER.size)


@pytest.fixture(autouse=True)
def all_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait for no tokens: all are known at once."""
    monkeypatch.setattr(module, "_WORD_COMES", 0.0)


@pytest.fixture
def make_memory() -> Iterator[Callable[[], SharedMemory]]:
    """Make what processes share, closed after the test."""
    made: list[SharedMemory] = []

    def make() -> SharedMemory:
        made.append(shared_memory())
        return made[-1]

    yield make
    for memory in made:
        memory.close()


def pieces() -> Pieces:
    return Pieces((b"", b""), (PICTURE,), (0,))


def read(reader: SharedMemory, reference: bytes) -> bytes:
    came = reader.read(zenoh.ZBytes(reference), 2 * LARGE, "it")
    assert isinstance(came, Parted)
    return came.large[0]


def test_what_is_written_again_cannot_be_read_before_it_is_whole(
    make_memory: Callable[[], SharedMemory], monkeypatch: pytest.MonkeyPatch
) -> None:
    genuine, reads = module.fence, 0

    def read_meanwhile() -> None:
        nonlocal reads
        monkeypatch.setattr(module, "fence", genuine)
        with pytest.raises(ConnectionLostException):
            read(make_memory(), reference)
        reads += 1
        monkeypatch.setattr(module, "fence", read_meanwhile)

    with closing(MemoryFile(LARGE)) as file:
        for _ in range(8):
            reference = file.place(pieces(), lent=False) or b""
        assert read(make_memory(), reference) == PICTURE
        for _ in range(7):
            file.place(pieces(), lent=False)
        assert read(make_memory(), reference) == PICTURE
        monkeypatch.setattr(module, "fence", read_meanwhile)
        file.place(pieces(), lent=False)
        assert reads == 2  # before and after it was written


def test_a_reference_into_a_picture_writes_nothing_into_it(make_memory: Callable[[], SharedMemory]) -> None:
    sender, reader = make_memory(), make_memory()
    sound = Ring(sender).place(pieces())
    assert sound is not None
    for slot in range(8):
        forged = msgspec.structs.replace(decode_reference(sound, "it"), lent=True, slot=slot, sizes=(16,))
        try:
            read(reader, msgspec.msgpack.encode(forged))
        except ConnectionLostException:
            continue
    assert read(make_memory(), sound) == PICTURE


def test_more_than_a_process_needs_is_not_kept_mapped(
    make_memory: Callable[[], SharedMemory], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_MOST_MAPS", 2)
    reader = make_memory()
    senders = [make_memory() for _ in range(4)]
    for sender in senders * 2:
        reference = sender.lend(pieces(), NEAR)
        assert reference is not None
        assert read(reader, reference) == PICTURE
    assert open_memory_files() == 4 * 2 + 2  # each sender's file and its map, and the reader's maps


def test_a_stream_that_needs_larger_memory_lets_go_of_the_smaller(
    make_memory: Callable[[], SharedMemory],
) -> None:
    ring = Ring(make_memory())
    for size in (LARGE, 2 * LARGE, 8 * LARGE):
        assert ring.place(Pieces((b"", b""), (bytes(size),), (0,))) is not None
        assert open_memory_files() == 2  # the file and its map
    ring.close()
    assert open_memory_files() == 0


def test_memory_of_those_who_ended_is_let_go_when_somebody_says_so(
    make_memory: Callable[[], SharedMemory],
) -> None:
    sender, reader = make_memory(), make_memory()
    reference = sender.lend(pieces(), NEAR)
    assert reference is not None
    assert read(reader, reference) == PICTURE
    reader.close_ended()
    assert open_memory_files() == 3
    sender.close()
    reader.close_ended()
    assert open_memory_files() == 0


def test_who_ends_waits_for_those_who_have_not_read_yet(make_memory: Callable[[], SharedMemory]) -> None:
    sender, reader = make_memory(), make_memory()
    reference = sender.lend(pieces(), NEAR)
    assert reference is not None
    came: list[bytes] = []
    reading = threading.Timer(0.05, lambda: came.append(read(reader, reference)))
    reading.start()
    sender.close()
    reading.join()
    assert came == [PICTURE]


def test_a_thread_that_stood_still_before_it_wrote_keeps_its_slot(
    make_memory: Callable[[], SharedMemory], monkeypatch: pytest.MonkeyPatch
) -> None:
    sender, reader = make_memory(), make_memory()
    other: list[bytes | None] = []
    genuine = module.fence

    def stand_still() -> None:
        monkeypatch.setattr(module, "fence", genuine)
        monkeypatch.setattr("time.monotonic", lambda: 1e9)  # long after it was taken
        other.append(sender.lend(Pieces((b"", b""), (b"o" * LARGE,), (0,)), NEAR))

    monkeypatch.setattr(module, "fence", stand_still)
    first = sender.lend(pieces(), NEAR)
    monkeypatch.undo()
    assert first is not None
    assert other[0] is not None
    assert (read(reader, first), read(reader, other[0])) == (PICTURE, b"o" * LARGE)


def test_memory_that_may_not_be_read_is_reported_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError("not you")

    reported: list[str] = []
    sender, reader = (
        shared_memory(),
        shared_memory(on_unreadable=lambda: reported.append(reader.readable_space)),
    )
    assert reader.readable_space == memory_space()
    reference = sender.lend(pieces(), NEAR)
    assert reference is not None
    monkeypatch.setattr("os.open", refuse)
    for _ in range(2):
        with pytest.raises(ConnectionLostException, match=r"cannot be read from here \(not you\)"):
            read(reader, reference)
    monkeypatch.undo()
    assert reported == [""]
    sender.close()
