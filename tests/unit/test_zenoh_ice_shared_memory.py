"""The pool of shared memory from which large payloads are sent."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest
import zenoh

from zenoh_ice import ConnectionLostException
from zenoh_ice.wire import shared_memory
from zenoh_ice.wire.pieces import LARGE, Pieces
from zenoh_ice.wire.shared_memory import SharedMemory, may_lock_enough, read_payload

POOL = 1 << 20


@pytest.fixture
def memory() -> Iterator[SharedMemory]:
    memory = SharedMemory(enabled=True, size=POOL)
    yield memory
    memory.close()


def is_shared(payload: bytes | zenoh.ZBytes) -> bool:
    return isinstance(payload, zenoh.ZBytes) and payload.as_shm() is not None


def test_small_payloads_stay_what_they_are(memory: SharedMemory) -> None:
    small = bytes(LARGE - 1)
    assert memory.place(small) is small
    assert not memory.used


@pytest.mark.parametrize(
    "payload", [bytes(range(1, 256)) * (LARGE // 128), Pieces([b"ab", b"c" * LARGE, b"d"])]
)
def test_large_payloads_are_placed_whole(memory: SharedMemory, payload: bytes | Pieces) -> None:
    placed = memory.place(payload)
    assert isinstance(placed, zenoh.ZBytes)
    assert is_shared(placed)
    assert read_payload(placed, "it") == bytes(payload)
    assert memory.used


def test_what_does_not_fit_is_sent_as_it_is(memory: SharedMemory) -> None:
    held = [memory.place(bytes(POOL // 4)) for _ in range(8)]
    assert is_shared(held[0])
    assert held[-1] == bytes(POOL // 4)
    assert memory.place(bytes(2 * POOL)) == bytes(2 * POOL)


def test_what_nobody_holds_is_used_again(memory: SharedMemory) -> None:
    assert all(is_shared(memory.place(bytes(POOL // 4))) for _ in range(100))


def test_what_was_sent_last_stays_valid(memory: SharedMemory) -> None:
    placed = memory.place(b"x" * (POOL // 4))
    assert isinstance(placed, zenoh.ZBytes)
    descriptor = placed.as_shm()
    del placed
    memory.place(bytes(POOL // 4))
    assert descriptor is not None
    assert bytes(descriptor) == b"x" * (POOL // 4)


def test_without_shared_memory_nothing_is_placed() -> None:
    memory = SharedMemory(enabled=False)
    assert memory.place(Pieces([bytes(LARGE), b"x"])) == bytes(LARGE) + b"x"


def test_closed_pool_places_nothing(memory: SharedMemory) -> None:
    memory.place(bytes(LARGE))
    memory.close()
    assert memory.place(bytes(LARGE)) == bytes(LARGE)
    assert not memory.used


def test_pool_that_cannot_be_had_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    memory = SharedMemory(enabled=True, size=1 << 60)
    assert [memory.place(bytes(LARGE)) for _ in range(2)] == [bytes(LARGE)] * 2
    (record,) = caplog.records
    assert "no shared memory" in record.message


def test_payload_whose_memory_was_taken_back_before_it_was_read_is_lost() -> None:
    payload = SimpleNamespace(
        to_bytes=lambda: bytes(LARGE), as_shm=lambda: SimpleNamespace(is_valid=lambda: False)
    )
    with pytest.raises(ConnectionLostException, match="image was lost with its shared memory"):
        read_payload(cast("Any", payload), "image")


@pytest.mark.parametrize(
    ("limit", "capable", "enough"),
    [
        (resource.RLIM_INFINITY, False, True),
        (1 << 30, False, True),
        (8 << 20, False, False),
        (8 << 20, True, True),
    ],
)
def test_shared_memory_needs_the_right_to_lock_it(
    monkeypatch: pytest.MonkeyPatch, limit: int, capable: bool, enough: bool
) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _: (limit, limit))
    monkeypatch.setattr(shared_memory, "_may_lock_everything", lambda: capable)
    assert may_lock_enough() is enough
