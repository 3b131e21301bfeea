"""The memory of a process that runs tests."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator

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
