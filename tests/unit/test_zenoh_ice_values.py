"""The roots of what travels."""

from __future__ import annotations

import pytest

from zenoh_ice.generated import Long, Struct


class Place(Struct):
    row: Long
    column: Long


# Pairs whose tuples have one hash in CPython of 64 bits, in every process.
COLLIDING = [
    (1, 2056075346960942179),
    (21, -1148744378065023704),
]


def test_equal_structs_have_equal_hashes() -> None:
    assert hash(Place(1, 2)) == hash(Place(True, 2.0))  # type: ignore[arg-type]
    assert {Place(1, 2): "here"}[Place(1, 2)] == "here"


def test_structs_with_a_mutable_member_have_no_hash() -> None:
    with pytest.raises(TypeError, match="unhashable"):
        hash(Place([], 2))  # type: ignore[arg-type]


def test_keys_cannot_be_chosen_to_collide() -> None:
    assert len({hash(pair) for pair in COLLIDING}) == 1
    assert len({hash(Place(*pair)) for pair in COLLIDING}) == len(COLLIDING)
