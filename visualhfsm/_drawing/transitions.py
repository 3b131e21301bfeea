"""One transition of a picture: its arc with a sign, its name, and what fires it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element

from codegen.hfsm.document import Transition

from .arcs import Arc
from .elements import element, moved
from .labels import HANDLE, Label
from .symbols import ARC, INK, MUTED, PAPER, TRIGGERS, UNKNOWN_TRIGGER
from .text import shortened, spoken_time, width

_NAME: Final = 12.0
_DETAIL: Final = 10.5
_WIDEST_LINE: Final = 150.0
"""Pixels of the longest line of a label; a longer one is shortened."""
_LINE: Final = 13.5
_FIRST_LINE: Final = 11.0
"""Pixels from the top of a label to the foot of its first line."""
_RANK_FOOT: Final = 3.5


@dataclass(frozen=True, slots=True)
class DrawnTransition:
    """A transition with its arc; `rank` is its place among those out of its state, 0 for the only one."""

    transition: Transition
    arc: Arc
    rank: int

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

    def label(self) -> Label:
        """Return the size of its name and of what fires it, for `place_labels`."""
        lines = self._lines()
        wide = max((width(text, size) + 6 for text, size, _ in lines), default=0.0)
        return Label(self.arc.handle, self.arc.normal, wide, len(lines) * _LINE + 2)

    def text(self, middle: complex) -> Element:
        """Return its label with its middle at a point, and its number at the beginning of the arc."""
        top = middle.imag - self.label().height / 2 + _FIRST_LINE
        texts = []
        if self.rank:
            foot = self.arc.rank.imag + _RANK_FOOT
            texts.append(_text(str(self.rank), _DETAIL, MUTED, self.arc.rank.real, foot, weight="650"))
        for index, (text, size, color) in enumerate(self._lines()):
            weight = "500" if size == _NAME else "400"
            texts.append(_text(text, size, color, middle.real, top + index * _LINE, weight=weight))
        return element("g", *texts)

    def _lines(self) -> list[tuple[str, float, str]]:
        """Return the lines of the label, each with its size and its colour."""
        name = shortened(self.transition.name.strip(), _NAME, _WIDEST_LINE)
        detail = shortened(_what_fires(self.transition), _DETAIL, _WIDEST_LINE)
        lines = ((name, _NAME, INK), (detail, _DETAIL, MUTED))
        return [line for line in lines if line[0]]


def _text(text: str, size: float, color: str, x: float, y: float, *, weight: str) -> Element:
    """Return a text with a rim in the colour of the paper, which keeps it apart from arcs below it."""
    return element(
        "text",
        text=text,
        x=x,
        y=y,
        font_size=size,
        font_weight=weight,
        fill=color,
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
