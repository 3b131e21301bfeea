"""Positions on the canvas: default positions of the handles of transitions, and moving of elements."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, count, islice
from typing import Final, TypeVar

from codegen.hfsm.document import Annotation, Automaton, State, Transition
from codegen.hfsm.positions import on_circle

from .nodes import coordinate

Point = tuple[float, float]
"""x and y in pixels, y downwards."""

FAN: Final = 50.0
"""Pixels between the handles of transitions between the same two states."""
LOOP: Final = 90.0
"""Pixels from the middle of a state to the handle of a transition to itself."""
_NEAR: Final = 30.0
_CLEAR: Final = 52.0
"""Pixels that arcs keep from the middles of other states where possible: the radius and a margin."""
_MOST_TRIES: Final = 80
_MOST_STATES: Final = 200
"""States of the largest automaton in which arcs avoid other states, which takes time."""

_Placed = TypeVar("_Placed", State, Transition, Annotation)


def with_default_handles(automaton: Automaton, ids: frozenset[int]) -> Automaton:
    """Return an automaton with the handles of some transitions at their default places.

    A default place is a free one in the middle between both states, or beside it; that of a loop is above its
    state, or around it. In an automaton of usual size all handles stay apart, and no arc crosses another
    state, where that is possible.
    """
    states = {state.id: state for state in reversed(automaton.states)}
    is_usual = len(states) <= _MOST_STATES
    taken: dict[frozenset[int], list[Point]] = {}

    def beside(transition: Transition) -> list[Point]:
        return taken.setdefault(frozenset() if is_usual else _ends(transition), [])

    for transition in automaton.transitions:
        if transition.id not in ids:
            beside(transition).append((transition.x, transition.y))
    transitions = []
    for transition in automaton.transitions:
        if transition.id in ids:
            x, y = _free_place(states, transition, beside(transition), avoids_states=is_usual)
            beside(transition).append((x, y))
            transitions.append(replace(transition, x=coordinate(x), y=coordinate(y)))
        else:
            transitions.append(transition)
    if tuple(transitions) == automaton.transitions:
        return automaton
    return replace(automaton, transitions=tuple(transitions))


def spread(automaton: Automaton) -> Automaton:
    """Return an automaton whose states are apart: on a circle, if all of them have the same position."""
    count = len(automaton.states)
    if count < 2 or len({(state.x, state.y) for state in automaton.states}) > 1:
        return automaton
    states = []
    for number, state in enumerate(automaton.states, start=1):
        x, y = on_circle(number, count)
        states.append(replace(state, x=x, y=y))
    apart = replace(automaton, states=tuple(states))
    return with_default_handles(apart, frozenset(each.id for each in apart.transitions))


def moved(
    automaton: Automaton,
    shifts: Mapping[int, Point],
    handles: Mapping[int, Point],
    annotations: Mapping[int, Point] | None = None,
) -> Automaton:
    """Return an automaton with states moved by `shifts`, handles by `handles`, and annotations.

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
    found = replace(
        automaton,
        states=states,
        transitions=tuple(transitions),
        annotations=tuple(
            _shifted(each, (annotations or {}).get(each.id, nowhere)) for each in automaton.annotations
        ),
    )
    return automaton if found == automaton else found


def _shifted(node: _Placed, shift: Point) -> _Placed:
    if shift == (0.0, 0.0):
        return node
    return replace(node, x=coordinate(node.x + shift[0]), y=coordinate(node.y + shift[1]))


def _ends(transition: Transition) -> frozenset[int]:
    return frozenset((transition.origin, transition.destination))


def _free_place(
    states: Mapping[int, State], transition: Transition, taken: Sequence[Point], *, avoids_states: bool
) -> Point:
    origin, destination = states.get(transition.origin), states.get(transition.destination)
    places = _places(origin, destination)
    free = (place for place in places if all(math.dist(place, other) >= _NEAR for other in taken))
    first = next(free)
    if not avoids_states or origin is None or destination is None:
        return first
    ends = _ends(transition)
    others = [(each.x, each.y) for each in states.values() if each.id not in ends]
    tries = chain((first,), islice(free, _MOST_TRIES))
    return next((place for place in tries if _is_clear(origin, destination, place, others)), first)


def _is_clear(origin: State, destination: State, handle: Point, others: Sequence[Point]) -> bool:
    """Return whether the arc through a handle, a parabola, avoids other states."""
    chord = destination.x - origin.x, destination.y - origin.y
    middle = (origin.x + destination.x) / 2, (origin.y + destination.y) / 2
    bend = 2 * (handle[0] - middle[0]), 2 * (handle[1] - middle[1])
    length = math.hypot(*chord) + math.hypot(*bend)
    reach = length / 2 + _CLEAR
    near = [each for each in others if math.dist(each, middle) < reach]
    steps = max(2, int(length / _NEAR))
    for step in range(steps + 1):
        part = step / steps
        bow = 2 * part * (1 - part)
        x = origin.x + part * chord[0] + bow * bend[0]
        y = origin.y + part * chord[1] + bow * bend[1]
        if any(math.dist((x, y), each) < _CLEAR for each in near):
            return False
    return True


def _places(origin: State | None, destination: State | None) -> Iterator[Point]:
    """Yield infinitely many places for a handle, the best first."""
    if origin is not None and (destination is None or destination.id == origin.id):
        yield from _around(origin)
    elif destination is not None and origin is None:
        yield from _around(destination)
    elif origin is None or destination is None:
        yield from ((FAN * number, 0.0) for number in count())
    else:
        first, second = sorted((origin, destination), key=lambda state: state.id)
        x, y = (first.x + second.x) / 2, (first.y + second.y) / 2
        length = math.dist((first.x, first.y), (second.x, second.y)) or 1.0
        across = ((first.y - second.y) / length, (second.x - first.x) / length)
        if across == (0.0, 0.0):
            across = (0.0, -1.0)
        for number in count():
            offset = FAN * ((number + 1) // 2) * (1 if number % 2 else -1)
            yield x + across[0] * offset, y + across[1] * offset


def _around(state: State) -> Iterator[Point]:
    for turn in count():
        radius = LOOP + FAN * (turn // 6)
        angle = -math.pi / 2 + (turn % 6) * math.pi / 3
        yield state.x + radius * math.cos(angle), state.y + radius * math.sin(angle)
