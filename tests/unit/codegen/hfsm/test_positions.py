"""States that a file does not place stand apart."""

from __future__ import annotations

import math
from itertools import combinations

import pytest

from codegen.hfsm.positions import on_circle


@pytest.mark.parametrize("count", [1, 2, 3, 4, 9])
def test_states_stand_on_a_circle_with_room_for_arcs_between_them(count: int) -> None:
    places = [on_circle(number, count) for number in range(1, count + 1)]
    assert all(math.dist(one, other) > 200 for one, other in combinations(places, 2))
    assert all(x > 80 and y > 80 for x, y in places)
    middles = {((a + c) / 2, (b + d) / 2) for (a, b), (c, d) in combinations(places, 2)}
    assert len(middles) == math.comb(count, 2)
