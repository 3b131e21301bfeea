"""Who counts as one that can read the memory of a process, by what tokens tell."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
import zenoh

from tests.support.wire_doors import SilentSession
from zenoh_ice.network import neighbors as module
from zenoh_ice.network.client_tokens import client_token
from zenoh_ice.network.neighbors import Neighbors

HERE, THERE = "0123456789abcdef", "fedcba9876543210"


@pytest.fixture
def neighbors(monkeypatch: pytest.MonkeyPatch) -> Neighbors:
    """Those of a process that knows at once who is there."""
    monkeypatch.setattr(module, "_WORD_COMES", 0.0)
    return Neighbors(SilentSession(), "nao", HERE)  # type: ignore[arg-type]


def tell(neighbors: Neighbors, client: str, space: str, *, gone: bool = False) -> None:
    told: Any = SimpleNamespace(
        key_expr=client_token("nao", client, space),
        kind=zenoh.SampleKind.DELETE if gone else zenoh.SampleKind.PUT,
    )
    neighbors._on_token(told)


def test_clients_of_the_same_space_are_neighbors_while_they_are_there(neighbors: Neighbors) -> None:
    assert not neighbors.includes("a")
    tell(neighbors, "a", HERE)
    tell(neighbors, "b", THERE)
    tell(neighbors, "c", "")
    assert [neighbors.includes(client) for client in "abc"] == [True, False, False]
    tell(neighbors, "a", HERE, gone=True)
    assert not neighbors.includes("a")


@pytest.mark.parametrize("space", [THERE, ""])
def test_one_client_from_elsewhere_is_enough_for_not_all_to_be(neighbors: Neighbors, space: str) -> None:
    tell(neighbors, "a", HERE)
    assert neighbors.are_all()
    tell(neighbors, "b", space)
    assert not neighbors.are_all()
    tell(neighbors, "b", space, gone=True)
    assert neighbors.are_all()


def test_nobody_makes_a_neighbor_of_a_client_that_says_otherwise_itself(neighbors: Neighbors) -> None:
    tell(neighbors, "a", "")
    tell(neighbors, "a", HERE)  # somebody else says so
    assert not neighbors.includes("a")


def test_not_all_are_before_word_of_them_can_have_come(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WORD_COMES", 1000.0)
    assert not Neighbors(SilentSession(), "nao", HERE).are_all()  # type: ignore[arg-type]


def test_without_a_space_nobody_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WORD_COMES", 0.0)
    alone = Neighbors(SilentSession(), "nao", "")  # type: ignore[arg-type]
    tell(alone, "a", "")
    assert not alone.are_all()
