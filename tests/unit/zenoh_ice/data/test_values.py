"""The base classes of data that is sent."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

from zenoh_ice.data.values import slice_name
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


class Grid(Struct):
    size: ClassVar[int] = 8
    origin: Place = Place(1, 2)
    steps: list[Long] = [1, 2]  # noqa: RUF012 - each struct gets its own
    name: str = "grid"


class Named(Struct):
    name: str = "base"


class Optional(Named):
    name: str | None = None  # type: ignore[assignment]


def test_default_values_are_new_for_each_struct() -> None:
    one, other = Grid(), Grid()
    assert (one.origin, one.steps, one.name, Grid.size) == (Place(1, 2), [1, 2], "grid", 8)
    one.steps.append(3)
    one.origin.row = 9
    assert (other.steps, other.origin) == ([1, 2], Place(1, 2))


def test_a_member_that_is_declared_again_has_its_new_default_value() -> None:
    assert Optional().name is None
    assert Named().name == "base"


def test_default_values_stay_where_python_has_called_builtin_types_before() -> None:
    """Python 3.11 calls a class past its metaclass at a place where it has often called a builtin one."""

    def fresh(kind: type[Any]) -> Any:
        return kind()

    for _ in range(100):
        fresh(list)
    assert fresh(Grid) == Grid()


@pytest.mark.parametrize(("python", "slice"), [("_while", "while"), ("row", "row"), ("row_", "row_")])
def test_a_name_that_python_reserves_has_none_of_our_marks_in_slice(python: str, slice: str) -> None:
    assert slice_name(python) == slice
