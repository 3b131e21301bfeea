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

Tell = Callable[..., None]


@pytest.fixture
def realm(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[SharedMemory, Tell]]:
    """A process that knows at once who is there, and what lets clients come and go."""
    monkeypatch.setattr(module, "_WORD_COMES", 0.0)
    monkeypatch.setattr(module, "_LAST_READS", 0.0)
    watchers: list[Callable[[str, bool], object]] = []
    memory = shared_memory(tokens=watchers.append)
    memory.readable_by_all()  # follows the clients from now on

    def tell(client: str, space: str, *, gone: bool = False) -> None:
        watchers[0](client_token("nao", client, space), not gone)

    yield memory, tell
    memory.close()


def includes(memory: SharedMemory, client: str) -> bool:
    return memory.lend(PAYLOAD, client) is not None


def test_clients_of_the_same_space_are_neighbors_while_they_are_there(
    realm: tuple[SharedMemory, Tell],
) -> None:
    memory, tell = realm
    assert not includes(memory, "a")
    tell("a", HERE)
    tell("b", THERE)
    tell("c", "")
    assert [includes(memory, client) for client in "abc"] == [True, False, False]
    tell("a", HERE, gone=True)
    assert not includes(memory, "a")


@pytest.mark.parametrize("space", [THERE, ""])
def test_one_client_from_elsewhere_is_enough_for_not_all_to_be(
    realm: tuple[SharedMemory, Tell], space: str
) -> None:
    memory, tell = realm
    tell("a", HERE)
    assert memory.readable_by_all()
    tell("b", space)
    assert not memory.readable_by_all()
    tell("b", space, gone=True)
    assert memory.readable_by_all()


def test_nobody_makes_a_neighbor_of_a_client_that_says_otherwise_itself(
    realm: tuple[SharedMemory, Tell],
) -> None:
    memory, tell = realm
    tell("a", "")
    tell("a", HERE)  # somebody else says so
    assert not includes(memory, "a")


def test_not_all_are_before_word_of_them_can_have_come(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WORD_COMES", 1000.0)
    assert not shared_memory().readable_by_all()


def test_without_a_space_nobody_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WORD_COMES", 0.0)
    watchers: list[Callable[[str, bool], object]] = []
    alone = shared_memory(enabled=False, tokens=watchers.append)
    alone.readable_by_all()
    for tell in watchers:
        tell(client_token("nao", "a", ""), True)
    assert not alone.readable_by_all()
    assert not includes(alone, "a")
