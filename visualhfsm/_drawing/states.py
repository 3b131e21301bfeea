"""One state of a picture: its circle, its name, and the signs of what it has."""

from __future__ import annotations

import cmath
import math
from typing import Final
from xml.etree.ElementTree import Element

from codegen.hfsm.document import State

from .arcs import RADIUS, place
from .elements import element, moved, pixels
from .symbols import BADGES, INK, PAPER, PARENT, PLAIN, Colors
from .text import fit_circle, width

_RING: Final = RADIUS - 5
_CODE_AT: Final = RADIUS - 13
_ABOVE_CODE: Final = 2.0
"""Pixels by which a name is higher when there is the dot of code below it."""
_FOOT: Final = 0.35
"""From the middle of a line to the foot of its letters, as a part of their size."""
_TIGHT: Final = 60.0
"""Pixels that a line of a name has at most."""
_BADGE: Final = 18.0
_BAR_STEP: Final = 4.0
_MOST_BARS: Final = 4


def draw_state(state: State, *, is_importing: bool) -> Element:
    """Return a state; `is_importing` says that one of its automata comes from another file."""
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
    drawn.extend(_badges(state, colors, is_importing=is_importing))
    return drawn


def _name(state: State, colors: Colors, *, has_code: bool) -> Element:
    fitted = fit_circle(state.name)
    middle = _FOOT * fitted.size - (_ABOVE_CODE if has_code else 0.0)
    top = middle - (len(fitted.lines) - 1) * fitted.line_height / 2
    lines = [
        element("tspan", text=line, x=0, y=top + index * fitted.line_height)
        for index, line in enumerate(fitted.lines)
    ]
    for line in lines:
        if width(line.text or "", fitted.size) > _TIGHT:  # in some font it would be too wide
            line.attrib |= {"textLength": pixels(_TIGHT), "lengthAdjust": "spacingAndGlyphs"}
    return element("text", *lines, font_size=fitted.size, font_weight="500", fill=colors.ink)


def _badges(state: State, colors: Colors, *, is_importing: bool) -> list[Element]:
    """Return the badges at the rim."""
    history = "restart" if state.history.text.strip() == "restart" else "resume"
    wanted = (
        (0.25, "child", len(state.children)),
        (0.75, history, bool(state.history.text.strip())),
        (-0.75, "imported", is_importing),
    )
    return [_badge(sign, count, turns * math.pi, colors) for turns, sign, count in wanted if count]


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
