"""Draw an automaton as SVG: states and transitions at their places in the document, colored by coverage."""

from __future__ import annotations

import math
from html import escape
from typing import Final

from .inventory import StateItem, TransitionItem
from .summary import AutomatonCoverage

__all__ = ["draw", "rank_state", "rank_transition"]

Point = tuple[float, float]

_WIDTH: Final = 132.0
_HEIGHT: Final = 44.0
_MARGIN: Final = 40.0
_BOW: Final = 0.18
"""How far a transition bows that has no place of its own, as a share of its length.

The next that goes the same way bows as much farther.
"""
_CLOSE: Final = 1.0
_LONGEST: Final = 16
"""Characters of a name in a box; the rest is in the tooltip."""


def rank_state(automaton: AutomatonCoverage, state: StateItem) -> str:
    """Return `hit` or `miss`."""
    return "hit" if automaton.entered(state) else "miss"


def rank_transition(automaton: AutomatonCoverage, transition: TransitionItem) -> str:
    """Return `hit`, `miss`, or `part` when it fired and its guard was not seen both true and false."""
    if not automaton.times_fired(transition):
        return "miss"
    return "hit" if not transition.guarded or all(automaton.guard(transition)) else "part"


def draw(automaton: AutomatonCoverage) -> str:
    """Return an automaton as an SVG element."""
    places = _places(automaton.items.states)
    handles = _handles(automaton.items.transitions, places)
    points = [*places.values(), *handles.values()]
    left, right = min(x for x, _ in points) - _WIDTH / 2, max(x for x, _ in points) + _WIDTH / 2
    top, bottom = min(y for _, y in points) - _HEIGHT / 2, max(y for _, y in points) + _HEIGHT / 2
    box = (left - _MARGIN, top - _MARGIN, right - left + 2 * _MARGIN, bottom - top + 2 * _MARGIN)
    view = " ".join(f"{value:.0f}" for value in box)
    name = escape(automaton.items.name)
    parts = [f'<svg viewBox="{view}" width="{box[2]:.0f}" role="img" aria-label="automaton {name}">']
    parts += [
        _transition(automaton, each, places, handles[each.id])
        for each in automaton.items.transitions
        if each.id in handles
    ]
    parts += [_state(automaton, state, places[state.id]) for state in automaton.items.states]
    return "\n".join([*parts, "</svg>"])


def _places(states: tuple[StateItem, ...]) -> dict[int, Point]:
    """Return the centers of the states; in a row when the document has no places for them."""
    places = {state.id: (state.x, state.y) for state in states}
    if len(set(places.values())) < len(places):
        return {state.id: (index * 1.8 * _WIDTH, 0.0) for index, state in enumerate(states)}
    return places


def _handles(transitions: tuple[TransitionItem, ...], places: dict[int, Point]) -> dict[int, Point]:
    """Return the points through which transitions are drawn, each beside those that go the same way."""
    handles: dict[int, Point] = {}
    for each in transitions:
        if each.origin in places and each.destination in places:
            number = 1
            while (handle := _handle(each, places, number)) in handles.values() and number <= len(handles):
                number += 1
            handles[each.id] = handle
    return handles


def _handle(transition: TransitionItem, places: dict[int, Point], number: int) -> Point:
    """Return the point through which a transition is drawn that is the `number`th of those of its way."""
    (x1, y1), (x2, y2) = places[transition.origin], places[transition.destination]
    middle = ((x1 + x2) / 2, (y1 + y2) / 2)
    own = (transition.x, transition.y)
    if own != (0.0, 0.0) and math.dist(own, middle) > _CLOSE:
        return own
    if transition.origin == transition.destination:
        return x1, y1 - (1.2 + 0.7 * number) * _HEIGHT
    bow = number * _BOW
    return middle[0] + bow * (y2 - y1), middle[1] - bow * (x2 - x1)


def _state(automaton: AutomatonCoverage, state: StateItem, place: Point) -> str:
    x, y = place[0] - _WIDTH / 2, place[1] - _HEIGHT / 2
    count = automaton.entered(state)
    double = (
        f'<rect class="inner" x="{x + 4:.1f}" y="{y + 4:.1f}" width="{_WIDTH - 8}" height="{_HEIGHT - 8}" '
        'rx="9"/>'
        if state.final
        else ""
    )
    start = _start((x, place[1])) if state.initial else ""
    return (
        f'<g class="state {rank_state(automaton, state)}"><title>{escape(state.name)}: line {state.line}, '
        f"entered {times(count)}</title>{start}"
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{_WIDTH}" height="{_HEIGHT}" rx="12"/>{double}'
        f'<text x="{place[0]:.1f}" y="{place[1] - 2:.1f}">{escape(_cut(state.name))}</text>'
        f'<text class="count" x="{place[0]:.1f}" y="{place[1] + 14:.1f}">{times(count)}</text></g>'
    )


def _transition(
    automaton: AutomatonCoverage, transition: TransitionItem, places: dict[int, Point], handle: Point
) -> str:
    start, end = places[transition.origin], places[transition.destination]
    count = automaton.times_fired(transition)
    rank = rank_transition(automaton, transition)
    label = f"{_cut(transition.name)} · {count}"
    anchor, (x, y) = _beside(handle, ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2))
    title = f"{transition.name} {transition.trigger}: line {transition.line}, fired {times(count)}"
    if transition.guarded:
        held, held_not = automaton.guard(transition)
        title += f"; its guard was true {times(held)}, false {times(held_not)}"
    return (
        f'<g class="transition {rank}"><title>{escape(title)}</title>'
        f"{_arrow(start, end, handle)}"
        f'<text x="{x:.1f}" y="{y:.1f}" style="text-anchor: {anchor}">{escape(label)}</text></g>'
    )


def _arrow(start: Point, end: Point, handle: Point) -> str:
    """Return a curve from box to box through a point, with a head at its end."""
    if start == end:
        spread = _WIDTH / 3
        first, last = (handle[0] - spread, handle[1]), (handle[0] + spread, handle[1])
        begin, tip = _edge(start, first), _edge(start, last)
        # A cubic passes its middle at 3/4 of the way to its control points.
        reach = [
            (begin[0] + (c[0] - begin[0]) * 4 / 3, begin[1] + (c[1] - begin[1]) * 4 / 3)
            for c in (first, last)
        ]
        curve = f"C {_text(reach[0])} {_text(reach[1])} {_text(tip)}"
        back = reach[1]
    else:
        outwards = _control(start, end, handle)
        begin, tip = _edge(start, outwards), _edge(end, outwards)
        control = _control(begin, tip, handle)
        curve, back = f"Q {_text(control)} {_text(tip)}", control
    return f'<path d="M {_text(begin)} {curve}"/>{_head(tip, back)}'


def _control(start: Point, end: Point, middle: Point) -> Point:
    """Return the control point of the quadratic curve that passes through a point half the way."""
    return 2 * middle[0] - (start[0] + end[0]) / 2, 2 * middle[1] - (start[1] + end[1]) / 2


def _head(tip: Point, back: Point) -> str:
    """Return the head of an arrow that comes from the direction of `back`."""
    angle = math.atan2(tip[1] - back[1], tip[0] - back[0])
    wings = [
        (tip[0] - 11 * math.cos(angle + turn), tip[1] - 11 * math.sin(angle + turn)) for turn in (0.42, -0.42)
    ]
    return f'<path class="head" d="M {_text(tip)} L {_text(wings[0])} L {_text(wings[1])} Z"/>'


def _start(edge: Point) -> str:
    """Return the arrow that points to the initial state."""
    x, y = edge
    line = f'<path d="M {x - 26:.1f},{y:.1f} L {x - 8:.1f},{y:.1f}"/>'
    dot = f'<circle cx="{x - 28:.1f}" cy="{y:.1f}" r="5"/>'
    return f'<g class="start">{line}{dot}{_head((x - 2, y), (x - 20, y))}</g>'


def _beside(handle: Point, middle: Point) -> tuple[str, Point]:
    """Return anchor and place of a label, on the side of the curve that looks away from the straight line."""
    dx, dy = handle[0] - middle[0], handle[1] - middle[1]
    if abs(dx) > abs(dy):
        return (
            ("start", (handle[0] + 8, handle[1] + 4)) if dx > 0 else ("end", (handle[0] - 8, handle[1] + 4))
        )
    return "middle", (handle[0], handle[1] - 8 if dy <= 0 else handle[1] + 17)


def _edge(center: Point, towards: Point) -> Point:
    """Return where the way from a box's center to a point leaves the box."""
    dx, dy = towards[0] - center[0], towards[1] - center[1]
    scale = max(abs(dx) / (_WIDTH / 2 + 2), abs(dy) / (_HEIGHT / 2 + 2), 1e-9)
    return center[0] + dx / scale, center[1] + dy / scale


def _text(point: Point) -> str:
    return f"{point[0]:.1f},{point[1]:.1f}"


def _cut(name: str) -> str:
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"


def times(count: int) -> str:
    """Return a number of times in words."""
    return {0: "never", 1: "once"}.get(count, f"{count} times")
