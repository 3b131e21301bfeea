"""Memory that several readers share, some of which end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

import pytest

from zenoh_ice import _memory
from zenoh_ice._memory import Arena, Extent

ENDED, LIVING = object(), object()


class Clock:
    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(_memory, "time", clock)
    return clock


@pytest.fixture
def arena(clock: Clock) -> Iterator[Arena]:
    with closing(Arena()) as arena:
        yield arena


def lend(arena: Arena, *links: object) -> Extent:
    extent = arena.lend([b"x" * 100], [(link, 1) for link in links])
    assert extent is not None
    return extent


def test_the_end_of_one_reader_takes_nothing_from_another(arena: Arena, clock: Clock) -> None:
    shared = lend(arena, ENDED, LIVING)
    arena.forget(ENDED)
    clock.now += 1000.0
    assert lend(arena, LIVING).start != shared.start
    arena.give_back(shared.start, (LIVING, 1))
    assert lend(arena, LIVING).start == shared.start


def test_memory_is_used_again_when_its_last_reader_ended(arena: Arena, clock: Clock) -> None:
    shared = lend(arena, ENDED, LIVING)
    arena.give_back(shared.start, (LIVING, 1))
    arena.forget(ENDED, 1)
    assert lend(arena, LIVING).start != shared.start  # it may still be reading
    clock.now += 1000.0
    assert lend(arena, LIVING).start == shared.start
