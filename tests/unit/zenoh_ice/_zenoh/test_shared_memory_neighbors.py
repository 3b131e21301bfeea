"""Which clients of a realm can read the memory of this process, as their tokens show."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from tests.support.memory_files import shared_memory
from zenoh_ice._codec import LARGE, Pieces
from zenoh_ice._presence import client_token
from zenoh_ice._zenoh import shared_memory as module
from zenoh_ice._zenoh.shared_memory import SharedMemory, memory_space

HERE, THERE = memory_space(), "fedcba9876543210"
PAYLOAD = Pieces((b"", b""), (bytes(LARGE),), (0,))

pytestmark = pytest.mark.skipif(not HERE, reason="no memory is shared here")

ShowToken = Callable[..., None]


@pytest.fixture
def realm(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[SharedMemory, ShowToken]]:
    """A process that knows its neighbors at once, and functions that add and remove clients."""
    monkeypatch.setattr(module, "_WORD_COMES", 0.0)
    monkeypatch.setattr(module, "_LAST_READS", 0.0)
    watchers: list[Callable[[str, bool], object]] = []
    memory = shared_memory(tokens=watchers.append)
    memory.readable_by_all()  # follows the clients from now on

    def show_token(client: str, space: str, *, gone: bool = False) -> None:
        watchers[0](client_token("nao", client, space), not gone)

    yield memory, show_token
    memory.close()


def includes(memory: SharedMemory, client: str) -> bool:
    return memory.lend(PAYLOAD, client) is not None


def test_clients_of_the_same_space_are_neighbors_while_they_are_there(
    realm: tuple[SharedMemory, ShowToken],
) -> None:
    memory, show_token = realm
    assert not includes(memory, "a")
    show_token("a", HERE)
    show_token("b", THERE)
    show_token("c", "")
    assert [includes(memory, client) for client in "abc"] == [True, False, False]
    show_token("a", HERE, gone=True)
    assert not includes(memory, "a")


@pytest.mark.parametrize("space", [THERE, ""])
def test_one_client_from_elsewhere_is_enough_for_not_all_to_be(
    realm: tuple[SharedMemory, ShowToken], space: str
) -> None:
    memory, show_token = realm
    show_token("a", HERE)
    assert memory.readable_by_all()
    show_token("b", space)
    assert not memory.readable_by_all()
    show_token("b", space, gone=True)
    assert memory.readable_by_all()


def test_nobody_makes_a_neighbor_of_a_client_that_says_otherwise_itself(
    realm: tuple[SharedMemory, ShowToken],
) -> None:
    memory, show_token = realm
    show_token("a", "")
    show_token("a", HERE)  # somebody else says so
    assert not includes(memory, "a")


def test_not_all_are_before_word_of_them_can_have_come(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WORD_COMES", 1000.0)
    assert not shared_memory().readable_by_all()


def test_without_a_space_nobody_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WORD_COMES", 0.0)
    watchers: list[Callable[[str, bool], object]] = []
    alone = shared_memory(enabled=False, tokens=watchers.append)
    alone.readable_by_all()
    for watcher in watchers:
        watcher(client_token("nao", "a", ""), True)
    assert not alone.readable_by_all()
    assert not includes(alone, "a")
