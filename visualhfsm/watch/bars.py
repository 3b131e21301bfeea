"""Small bars for the terminal."""

from __future__ import annotations

import math

from rich.text import Text

__all__ = ["level_bar", "position_bar"]


def level_bar(fraction: float, width: int, style: str) -> Text:
    """Draw a bar that is filled from the left by a fraction from 0 to 1, to half a cell."""
    share = min(max(fraction, 0.0), 1.0) if math.isfinite(fraction) else 0.0
    halves = round(share * width * 2)
    full, half = divmod(halves, 2)
    filled = "━" * full + "╸" * half
    return Text.assemble((filled, style), ("─" * (width - len(filled)), "grey30"))


def position_bar(value: float, lower: float, upper: float, width: int, style: str) -> Text:
    """Draw a scale from `lower` to `upper` with a mark at `value` and a tick at zero."""
    span = upper - lower
    if not (0 < span < math.inf and math.isfinite(value)):
        return Text("─" * width, style="bright_black")

    def cell(position: float) -> int:
        share = (min(max(position, lower), upper) - lower) / span
        return min(int(share * width), width - 1)

    characters = ["─"] * width
    if lower < 0 < upper:
        characters[cell(0.0)] = "┼"
    mark = cell(value)
    characters[mark] = "█"
    bar = Text("".join(characters), style="bright_black")
    bar.stylize(style, mark, mark + 1)
    return bar
