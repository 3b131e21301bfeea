"""One transition of a picture: its arc with a sign, its name, and what fires it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias
from xml.etree.ElementTree import Element

from codegen.hfsm.document import Transition

from .arcs import Arc, Box
from .elements import element, moved
from .symbols import ARC, INK, MUTED, PAPER, TRIGGERS, UNKNOWN_TRIGGER
from .text import shortened, spoken_time, width

_NAME: Final = 12.0
_DETAIL: Final = 10.5
_WIDEST: Final = 190.0
"""Pixels of the longest line of a label; more is cut off."""
HANDLE: Final = 9.0
"""Radius of the sign of a transition."""
_GAP: Final = 5.0
_LINE: Final = 13.5
_FIRST_LINE: Final = 11.0
"""Pixels from the top of a label to the foot of its first line."""
_RANK_FOOT: Final = 3.5
_NOWHERE: Final = Box(0.0, 0.0, 0.0, 0.0)

_Lines: TypeAlias = tuple[tuple[str, float, str], ...]
"""The lines of a label, each with its size and its colour."""


@dataclass(frozen=True, slots=True)
class DrawnTransition:
    """A transition with its arc; `rank` is its place among those out of its state, 0 for the only one.

    Its label stands on a `side` of its handle.
    """

    transition: Transition
    arc: Arc
    rank: int
    side: complex

    def line(self) -> Element:
        """Return its arc, with the sign of what fires it and a dot when it has code."""
        trigger = TRIGGERS.get(self.transition.type, UNKNOWN_TRIGGER)
        glyph = element("path", d=trigger.path, fill="none", stroke=ARC, stroke_width=1.5)
        if trigger.is_filled:
            glyph = element("path", d=trigger.path, fill=ARC)
        sign = element(
            "g",
            element("circle", r=HANDLE, fill=PAPER, stroke=ARC, stroke_width=1.4),
            glyph,
            transform=moved(self.arc.handle),
            stroke_linecap="round",
            stroke_linejoin="round",
        )
        if not self.transition.code.is_blank:
            sign.append(element("circle", cx=7, cy=-7, r=4, fill=ARC, stroke=PAPER, stroke_width=1.2))
        return element(
            "g",
            element("path", d=self.arc.path, fill="none", stroke=ARC, stroke_width=1.6),
            element("path", d=self.arc.head, fill=ARC),
            sign,
        )

    def box(self) -> Box | None:
        """Return about where its label stands, beside its handle; None without one."""
        lines = self._lines()
        if not lines:
            return None
        wide = max(width(text, letters) + 6 for text, letters, _ in lines)
        high = len(lines) * _LINE + 2
        across, down = abs(self.side.real), abs(self.side.imag)
        room = HANDLE + _GAP
        reach = min((wide / 2 + room) / max(across, 1e-6), (high / 2 + room) / max(down, 1e-6))
        return Box.around(self.arc.handle + self.side * reach, wide, high)

    def beside(self, taken: Sequence[Box]) -> DrawnTransition:
        """Return it with its label where that covers the least of some boxes, at its best side if it can."""
        normal = self.arc.normal
        sides = (replace(self, side=side) for side in (normal, -normal, -1j, 1j, 1 + 0j, -1 + 0j))
        return min(sides, key=lambda each: sum(map((each.box() or _NOWHERE).covered, taken)))

    def text(self) -> Element:
        """Return its label, and its number at the beginning of the arc."""
        texts = []
        if self.rank:
            foot = self.arc.rank.imag + _RANK_FOOT
            texts.append(_text(str(self.rank), _DETAIL, MUTED, self.arc.rank.real, foot, weight="650"))
        if (box := self.box()) is not None:
            x, anchor = (box.left + box.right) / 2, "middle"
            if abs(self.side.real) > abs(self.side.imag):  # however wide the font is
                x, anchor = (box.left, "start") if self.side.real > 0 else (box.right, "end")
            for index, (text, letters, color) in enumerate(self._lines()):
                weight = "500" if letters == _NAME else "400"
                y = box.top + _FIRST_LINE + index * _LINE
                texts.append(_text(text, letters, color, x, y, weight=weight, anchor=anchor))
        return element("g", *texts)

    def _lines(self) -> _Lines:
        name = shortened(self.transition.name.strip(), _NAME, _WIDEST)
        detail = shortened(_what_fires(self.transition), _DETAIL, _WIDEST)
        lines = ((name, _NAME, INK), (detail, _DETAIL, MUTED))
        return tuple(line for line in lines if line[0])


def _text(
    text: str, size: float, color: str, x: float, y: float, *, weight: str, anchor: str = "middle"
) -> Element:
    """Return a text with a rim in the colour of the paper, which keeps it apart from arcs below it."""
    return element(
        "text",
        text=text,
        x=x,
        y=y,
        font_size=size,
        font_weight=weight,
        fill=color,
        text_anchor=anchor,
        stroke=PAPER,
        stroke_width=4,
        stroke_linejoin="round",
        paint_order="stroke",
    )


def _what_fires(transition: Transition) -> str:
    """Return the trigger and the guard of a transition in a few words."""
    trigger = _first_line(transition.trigger.text)
    match transition.type:
        case "time":
            trigger = spoken_time(transition.trigger.text) or "no time"
        case "event":
            trigger = trigger or "no event"
        case "condition":
            pass
        case _:
            trigger = ""
    guard = _first_line(transition.guard.text)
    return " ".join(part for part in (trigger, f"[{guard}]" if guard else "") if part)


def _first_line(text: str) -> str:
    return text.strip().split("\n", 1)[0]
