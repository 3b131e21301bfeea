"""Fixtures of the tests of zenoh_ice: lent memory, and a pool of threads."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import closing

import pytest

from tests.support.limits import EVENT_LIMIT
from zenoh_ice._memory import Arena, ArenaView
from zenoh_ice._pool import Pool


@pytest.fixture
def arena() -> Iterator[Arena]:
    with closing(Arena()) as arena:
        yield arena


@pytest.fixture
def view(arena: Arena) -> Iterator[ArenaView]:
    with closing(ArenaView(os.dup(arena.file))) as view:
        yield view


@pytest.fixture
def pool() -> Iterator[Pool]:
    pool = Pool(4, "pool")
    yield pool
    assert pool.close(EVENT_LIMIT)
