"""States without positions are drawn apart."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations

from codegen.hfsm.document import Automaton, State, Transition
from visualhfsm._document.geometry import spread

HEAP = Automaton(
    id=1,
    states=tuple(State(id=number, name=f"s{number}") for number in range(1, 5)),
    transitions=(
        Transition(id=1, origin=1, destination=2),
        Transition(id=2, origin=2, destination=1),
        Transition(id=3, origin=3, destination=3),
    ),
)


def test_states_in_one_place_are_spread_with_their_arcs() -> None:
    apart = spread(HEAP)
    assert all(math.dist((a.x, a.y), (b.x, b.y)) > 100 for a, b in combinations(apart.states, 2))
    assert all(math.dist((a.x, a.y), (b.x, b.y)) > 25 for a, b in combinations(apart.transitions, 2))
    assert [state.name for state in apart.states] == [state.name for state in HEAP.states]


def test_states_that_have_positions_keep_them() -> None:
    moved = (HEAP.states[0], *(replace(state, x=9.0) for state in HEAP.states[1:]))
    for automaton in (replace(HEAP, states=moved), replace(HEAP, states=HEAP.states[:1]), Automaton(id=1)):
        assert spread(automaton) is automaton
