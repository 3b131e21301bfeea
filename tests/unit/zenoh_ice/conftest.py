"""Fixtures of the tests of zenoh_ice: lent memory, and a pool of threads."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import closing

import pytest

from tests.support.limits import EVENT_LIMIT
from zenoh_ice.carriers._local.memory import Arena, ArenaView
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.threads.pool import Pool


@pytest.fixture
def limits() -> Limits:
    """The limits of the pool and the memory: a test that needs others is parametrized with them."""
    return LIMITS


@pytest.fixture
def arena(limits: Limits) -> Iterator[Arena]:
    with closing(Arena(limits)) as arena:
        yield arena


@pytest.fixture
def view(arena: Arena) -> Iterator[ArenaView]:
    with closing(ArenaView(os.dup(arena.file))) as view:
        yield view


@pytest.fixture
def pool(limits: Limits) -> Iterator[Pool]:
    pool = Pool(4, "pool", limits)
    yield pool
    assert pool.close(EVENT_LIMIT)
