"""One state of a picture: its circle, its name, and the signs of what it has."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Final
from xml.etree.ElementTree import Element

from codegen.hfsm.document import State

from .arcs import RADIUS, place
from .elements import element, moved
from .symbols import BADGES, INK, PAPER, PARENT, PLAIN, Colors
from .text import fit_circle

_RING: Final = RADIUS - 5
_CODE_AT: Final = RADIUS - 13
_ABOVE_CODE: Final = 2.0
"""Pixels by which a name is higher when there is the dot of code below it."""
_FOOT: Final = 0.35
"""From the middle of a line to the foot of its letters, as a part of their size."""
_BADGE: Final = 18.0
_BAR_STEP: Final = 4.0
_MOST_BARS: Final = 4
_CLEAR: Final = 0.5
"""Radians between a badge and an arc, or another badge."""
_TURNS: Final = (0.0, 0.35, -0.35, 0.7, -0.7, 1.05, -1.05, 1.4, -1.4, 1.9, -1.9, 2.4, -2.4)
"""Radians by which a badge may move, the best first."""


def draw_state(state: State, touched: Sequence[float], *, is_importing: bool) -> Element:
    """Return a state; `touched` are the angles in radians at which arcs touch its rim.

    `is_importing` says that one of its automata comes from another file.
    """
    colors = PARENT if state.children else PLAIN
    rim = (INK, 6.0) if state.final else (colors.line, 2.0)
    drawn = element(
        "g",
        element("circle", r=RADIUS, fill=colors.fill, stroke=rim[0], stroke_width=rim[1]),
        transform=moved(place(state)),
    )
    if state.initial:
        drawn.append(element("circle", r=_RING, fill="none", stroke=colors.line, stroke_width=1.6))
    has_code = not all(each.is_blank for each in (state.entry, state.code, state.exit))
    drawn.append(_name(state, colors, has_code=has_code))
    if has_code:
        drawn.append(element("circle", cy=_CODE_AT, r=3, fill=colors.line))
    drawn.extend(_badges(state, touched, colors, is_importing=is_importing))
    return drawn


def _name(state: State, colors: Colors, *, has_code: bool) -> Element:
    fitted = fit_circle(state.name, has_ring=state.initial or state.final)
    middle = _FOOT * fitted.size - (_ABOVE_CODE if has_code else 0.0)
    top = middle - (len(fitted.lines) - 1) * fitted.line_height / 2
    lines = (
        element("tspan", text=line, x=0, y=top + index * fitted.line_height)
        for index, line in enumerate(fitted.lines)
    )
    return element("text", *lines, font_size=fitted.size, font_weight="500", fill=colors.ink)


def _badges(state: State, touched: Sequence[float], colors: Colors, *, is_importing: bool) -> list[Element]:
    """Return the badges at the rim, each as near to its usual place as arcs and other badges allow."""
    history = state.history.text.strip()
    wanted: list[tuple[float, str, int]] = []  # half turns, sign, how many
    if state.children:
        wanted.append((0.25, "child", len(state.children)))
    if history:
        wanted.append((0.75, "restart" if history == "restart" else "resume", 1))
    if is_importing:
        wanted.append((-0.75, "imported", 1))
    taken = [*touched]
    badges: list[Element] = []
    for half_turns, sign, count in wanted:
        usual = half_turns * math.pi
        angles = (usual + turn for turn in _TURNS)
        angle = next((each for each in angles if all(_apart(each, other) > _CLEAR for other in taken)), usual)
        taken.append(angle)
        badges.append(_badge(sign, count, angle, colors))
    return badges


def _badge(sign: str, count: int, angle: float, colors: Colors) -> Element:
    """Return a badge at some angle, with a sign and, if there are several automata, a bar for each."""
    bars = min(count, _MOST_BARS) if count > 1 else 0
    path = BADGES[sign] + "".join(f"M{9 + index * 4}-4.5V4.5" for index in range(bars))
    wide = _BADGE + (bars * _BAR_STEP + 1 if bars else 0.0)
    line = colors.line
    return element(
        "g",
        element(
            "rect",
            x=-_BADGE / 2,
            y=-_BADGE / 2,
            width=wide,
            height=_BADGE,
            rx=_BADGE / 2,
            fill=PAPER,
            stroke=line,
            stroke_width=1.4,
        ),
        element(
            "path",
            d=path,
            fill="none",
            stroke=PARENT.line,
            stroke_width=1.5,
            stroke_linecap="round",
            stroke_linejoin="round",
        ),
        transform=moved(cmath.rect(RADIUS, angle)),
    )


def _apart(one: float, other: float) -> float:
    """Return the angle between two directions in radians."""
    return abs(math.remainder(one - other, math.tau))
