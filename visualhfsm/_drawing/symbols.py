"""The glyphs and the light colours of a picture: those of `glyphs.js` and `theme.css` of the page."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final, NamedTuple


class Trigger(NamedTuple):
    """The sign of what fires a transition: a path around (0, 0), filled or drawn as a line."""

    path: str
    is_filled: bool = False


TRIGGERS: Final = MappingProxyType(
    {
        "time": Trigger("M0-5A5 5 0 1 1-.01-5M0-2.7V0L2 1.3"),
        "condition": Trigger("M0-5L5 0L0 5L-5 0Z"),
        "event": Trigger("M1.5-5.5L-3.5 1H-.5L-1.5 5.5L3.5-1H.5Z", is_filled=True),
        "finished": Trigger("M-4.5.5L-1.5 3.5L4.5-3.5"),
    }
)
UNKNOWN_TRIGGER: Final = Trigger("M-3-3L3 3M3-3L-3 3")

BADGES: Final = MappingProxyType(
    {
        "child": "M-4.5-1.5L0-4.5L4.5-1.5L0 1.5ZM-4.5 1.5L0 4.5L4.5 1.5",
        "imported": "M-4-4H1M-4-4V4H4V1M4-4L-1 1M-1-2.5V1H2.5",
        "resume": "M-2.5-4V4M2.5-4V4M-2.5 0H2.5",
        "restart": "M3.6-1.5A4 4 0 1 0 4 1M4-4.5V-1.2H.8",
    }
)
"""The signs at the rim of a state."""


class Colors(NamedTuple):
    """The colours of a circle, its line and its name."""

    fill: str
    line: str
    ink: str


PLAIN: Final = Colors("#dbeafc", "#1f6fbf", "#0d2c4f")
PARENT: Final = Colors("#cbeedd", "#0a7752", "#06382a")
"""The colours of a state that owns automata."""
PAPER: Final = "#ffffff"
INK: Final = "#1a2330"
MUTED: Final = "#526073"
ARC: Final = "#566377"
