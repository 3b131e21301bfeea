"""The memory of a process that runs tests."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from functools import cache, lru_cache

import pytest

from tests.support.memory import Memory, freeze


class Cycle:
    """Garbage for the garbage collection alone."""

    def __init__(self, size: int) -> None:
        self.itself = self
        self.content = b"x" * size


@pytest.fixture(autouse=True)
def nothing_is_collected_by_itself() -> Iterator[None]:
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize(("size", "is_left"), [(64 << 20, False), (1, True)])
def test_garbage_is_collected_when_it_is_much(size: int, is_left: bool) -> None:
    memory = Memory()
    garbage = weakref.ref(Cycle(size))
    memory.give_back()
    assert (garbage() is not None) == is_left


def test_what_is_frozen_is_looked_at_no_more_and_garbage_goes_before_that() -> None:
    kept, garbage = Cycle(1), weakref.ref(Cycle(1))
    freeze()
    assert garbage() is None
    assert not any(each is kept for each in gc.get_objects())


@pytest.mark.parametrize(("size", "left"), [(64 << 20, (0, 1)), (1, (1, 1))])
def test_caches_with_a_limit_are_emptied_when_the_process_has_grown(size: int, left: tuple[int, int]) -> None:
    limited, unlimited = lru_cache(maxsize=8)(Cycle), cache(Cycle)
    for each in (limited, unlimited):
        each.__module__ = "codegen.cached"
        each(1)
    memory = Memory()
    memory.keep_the_collected()
    grown = Cycle(size)
    memory.give_back()
    assert tuple(each.cache_info().currsize for each in (limited, unlimited)) == left
    assert len(grown.content) == size
