"""Texts of a picture, whose widths are estimated: the font of who looks is unknown."""

from __future__ import annotations

import math
import textwrap
import unicodedata
from typing import Final, NamedTuple

FAMILY: Final = "Inter, system-ui, 'DejaVu Sans', Arial, sans-serif"

_LETTER: Final = 0.56
"""Width of a usual letter in parts of its size; ideographs fill a square."""
_FITS: Final = ((13.0, 1, 68.0), (12.0, 1, 68.0), (12.0, 2, 62.0), (11.0, 3, 56.0), (10.0, 3, 58.0))
"""Sizes of a name in a circle, with its lines and the pixels of each, the best first."""
_ELLIPSIS: Final = "…"
_MINUTE: Final = 60_000.0
_SECOND: Final = 1000.0


class Fitted(NamedTuple):
    """A name in a circle: its lines, and the size of its letters in pixels."""

    lines: tuple[str, ...]
    size: float

    @property
    def line_height(self) -> float:
        """The distance between two lines in pixels."""
        return self.size * 1.16


def width(text: str, size: float) -> float:
    """Return about the width of a text in pixels, at a size of letters in pixels."""
    return sum(map(_width, text)) * size


def shortened(text: str, size: float, room: float) -> str:
    """Return a text that is about no wider than some pixels, shortened at its end."""
    if width(text, size) <= room:
        return text
    while text and width(text + _ELLIPSIS, size) > room:
        text = text[:-1]
    return text.rstrip() + _ELLIPSIS


def wrapped(text: str, size: float, room: float) -> list[str]:
    """Return a text in lines about no wider than some pixels; its own line ends and indents are kept."""
    lines: list[str] = []
    for paragraph in text.replace("\r\n", "\n").split("\n"):
        words = paragraph.lstrip(" ")
        indent = "\N{NO-BREAK SPACE}" * (len(paragraph) - len(words))
        letters = int(room / size / max(map(_width, words or " "))) if words else 1
        lines += textwrap.wrap(words, max(1, letters), initial_indent=indent) or [indent]
    return lines


def fit_circle(name: str) -> Fitted:
    """Return the lines of a state's name.

    It is broken at spaces, hyphens, underscores, before capitals and ideographs.
    """
    words = _words(" ".join(name.split()))
    for size, count, room in _FITS:
        lines = _joined(words, size, room)
        if len(lines) <= count and all(width(line, size) <= room for line in lines):
            return Fitted(tuple(lines), size)
    lines = [*lines[: count - 1], *(["".join(lines[count - 1 :])] if len(lines) >= count else [])]
    return Fitted(tuple(shortened(line, size, room) for line in lines), size)


def spoken_time(milliseconds: str) -> str:
    """Return a time in minutes, seconds or milliseconds, such as `1.5 s`; other text stays as it is."""
    text = milliseconds.strip()
    try:
        value = float(text)
    except ValueError:
        return text
    if not math.isfinite(value):
        return text
    if value >= _MINUTE and value % _MINUTE == 0:
        return f"{value / _MINUTE:.15g} min"
    if value >= _SECOND and value.is_integer():
        return f"{value / _SECOND:.15g} s"
    return f"{value:.15g} ms"


def _width(character: str) -> float:
    """Return about the width of a character, as a part of the size."""
    if unicodedata.category(character) in ("Mn", "Me", "Cf"):  # accents, and what joins characters
        return 0.0
    return 1.0 if unicodedata.east_asian_width(character) in "WF" else _LETTER


def _words(text: str) -> list[str]:
    """Return the parts of a text between which it may be broken."""
    words: list[str] = []
    for each in text:
        last = words[-1][-1] if words else " "
        is_hump = each.isupper() and (last.islower() or last.isdigit())
        if last in " _-" or is_hump or "\u3400" <= each <= "\u9fff":
            words.append(each)
        else:
            words[-1] += each
    return words


def _joined(words: list[str], size: float, room: float) -> list[str]:
    """Return the words in lines as long as they may be."""
    lines: list[str] = []
    for word in words:
        if lines and width((lines[-1] + word).strip(), size) <= room:
            lines[-1] += word
        else:
            lines.append(word)
    return [line.strip() for line in lines]
