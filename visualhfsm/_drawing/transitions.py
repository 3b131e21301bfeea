"""One transition of a picture: its arc with a sign, its name, and what fires it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias
from xml.etree.ElementTree import Element

from codegen.hfsm.document import Transition

from .arcs import Arc
from .elements import element, moved
from .labels import HANDLE, Label, Placed, Size
from .symbols import ARC, INK, MUTED, PAPER, TRIGGERS, UNKNOWN_TRIGGER
from .text import shortened, spoken_time, width

_NAME: Final = 12.0
_DETAIL: Final = 10.5
_WIDTHS: Final = (400.0, 260.0, 150.0)
"""Pixels of the longest line of a label, the less room there is, the shorter; more is cut off."""
_LINE: Final = 13.5
_FIRST_LINE: Final = 11.0
"""Pixels from the top of a label to the foot of its first line."""
_RANK_FOOT: Final = 3.5

_Lines: TypeAlias = tuple[tuple[str, float, str], ...]
"""The lines of a label, each with its size and its colour."""


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
        """Return the sizes of its name and of what fires it, for `place_labels`."""
        return Label(self.arc.handle, self.arc.normal, tuple(size for size, _ in self._texts()))

    def text(self, placed: Placed | None) -> Element:
        """Return its label where it was placed, and its number at the beginning of the arc."""
        texts = []
        if self.rank:
            foot = self.arc.rank.imag + _RANK_FOOT
            texts.append(_text(str(self.rank), _DETAIL, MUTED, self.arc.rank.real, foot, weight="650"))
        if placed is not None:
            size, lines = self._texts()[placed.size]
            top = placed.middle.imag - size.height / 2 + _FIRST_LINE
            for index, (text, letters, color) in enumerate(lines):
                weight = "500" if letters == _NAME else "400"
                texts.append(
                    _text(text, letters, color, placed.middle.real, top + index * _LINE, weight=weight)
                )
        return element("g", *texts)

    def _texts(self) -> list[tuple[Size, _Lines]]:
        """Return the texts that the label may have, each with its size, the longest first."""
        found: list[tuple[Size, _Lines]] = []
        for widest in _WIDTHS:
            lines = self._lines(widest)
            if not lines or (found and found[-1][1] == lines):
                continue
            wide = max(width(text, letters) + 6 for text, letters, _ in lines)
            found.append((Size(wide, len(lines) * _LINE + 2), lines))
        return found

    def _lines(self, widest: float) -> _Lines:
        name = shortened(self.transition.name.strip(), _NAME, widest)
        detail = shortened(_what_fires(self.transition), _DETAIL, widest)
        lines = ((name, _NAME, INK), (detail, _DETAIL, MUTED))
        return tuple(line for line in lines if line[0])


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
