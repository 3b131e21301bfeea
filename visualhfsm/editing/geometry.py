"""Places on the canvas: the default places of the handles of transitions, and moving things."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import count
from typing import Final, TypeVar

from codegen.hfsm.document import Automaton, State, Transition

from .nodes import coordinate

Point = tuple[float, float]
"""x and y in pixels, y downwards."""

_FAN: Final = 50.0
"""Pixels between the handles of transitions between the same two states."""
_LOOP: Final = 90.0
"""Pixels from the middle of a state to the handle of a transition to itself."""
_NEAR: Final = 30.0

_Placed = TypeVar("_Placed", State, Transition)


def with_default_handles(automaton: Automaton, ids: frozenset[int]) -> Automaton:
    """Return an automaton with the handles of some transitions at their default places.

    Each is a free one in the middle between both states, or beside it; that of a loop is above its state, or
    around it.
    """
    states = {state.id: state for state in reversed(automaton.states)}
    taken: dict[frozenset[int], list[Point]] = {}
    for transition in automaton.transitions:
        if transition.id not in ids:
            taken.setdefault(_ends(transition), []).append((transition.x, transition.y))
    transitions = []
    for transition in automaton.transitions:
        if transition.id not in ids:
            transitions.append(transition)
            continue
        beside = taken.setdefault(_ends(transition), [])
        places = _places(states.get(transition.origin), states.get(transition.destination))
        x, y = next(place for place in places if all(math.dist(place, other) >= _NEAR for other in beside))
        beside.append((x, y))
        transitions.append(replace(transition, x=coordinate(x), y=coordinate(y)))
    if tuple(transitions) == automaton.transitions:
        return automaton
    return replace(automaton, transitions=tuple(transitions))


def moved(automaton: Automaton, shifts: Mapping[int, Point], handles: Mapping[int, Point]) -> Automaton:
    """Return an automaton with states moved by `shifts`, and handles by `handles`.

    A handle that is not named follows the states at its ends.
    """
    nowhere = (0.0, 0.0)
    states = tuple(
        _shifted(state, shifts[state.id]) if state.id in shifts else state for state in automaton.states
    )
    transitions = []
    for transition in automaton.transitions:
        start = shifts.get(transition.origin, nowhere)
        end = shifts.get(transition.destination, nowhere)
        follow = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
        shift = handles.get(transition.id, follow)
        transitions.append(_shifted(transition, shift))
    if states == automaton.states and tuple(transitions) == automaton.transitions:
        return automaton
    return replace(automaton, states=states, transitions=tuple(transitions))


def _shifted(node: _Placed, shift: Point) -> _Placed:
    if shift == (0.0, 0.0):
        return node
    return replace(node, x=coordinate(node.x + shift[0]), y=coordinate(node.y + shift[1]))


def _ends(transition: Transition) -> frozenset[int]:
    return frozenset((transition.origin, transition.destination))


def _places(origin: State | None, destination: State | None) -> Iterator[Point]:
    """Yield infinitely many places for a handle, the best first."""
    if origin is not None and (destination is None or destination.id == origin.id):
        yield from _around(origin)
    elif destination is not None and origin is None:
        yield from _around(destination)
    elif origin is None or destination is None:
        yield from ((_FAN * number, 0.0) for number in count())
    else:
        first, second = sorted((origin, destination), key=lambda state: state.id)
        x, y = (first.x + second.x) / 2, (first.y + second.y) / 2
        length = math.dist((first.x, first.y), (second.x, second.y)) or 1.0
        across = ((first.y - second.y) / length, (second.x - first.x) / length)
        if across == (0.0, 0.0):
            across = (0.0, -1.0)
        for number in count():
            offset = _FAN * ((number + 1) // 2) * (1 if number % 2 else -1)
            yield x + across[0] * offset, y + across[1] * offset


def _around(state: State) -> Iterator[Point]:
    for turn in count():
        radius = _LOOP + _FAN * (turn // 6)
        angle = -math.pi / 2 + (turn % 6) * math.pi / 3
        yield state.x + radius * math.cos(angle), state.y + radius * math.sin(angle)
