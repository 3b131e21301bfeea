"""Texts of a picture: how wide they are, and how names fit into circles.

No font is measured, here or in the page, so that both break a text into the same lines on every machine:
the widths are those of DejaVu Sans, the widest of the fonts that a picture names, so a text fits in each.
"""

from __future__ import annotations

import json
import math
import re
import unicodedata
from collections.abc import Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import Final, NamedTuple

from visualhfsm._base.html_file import STATIC

from .arcs import RADIUS

FAMILY: Final = "Inter, system-ui, 'DejaVu Sans', Arial, sans-serif"

_ROW: Final = re.compile(r'(\d+): ("(?:[^"\\]|\\.)+")')
"""Letters by their width in thousandths of their size, as the page has them."""
_WIDTHS: Final = MappingProxyType(
    {
        letter: int(wide) / 1000
        for wide, letters in _ROW.findall((STATIC / "measures" / "letter-widths.js").read_text("utf-8"))
        for letter in json.loads(letters)
    }
)
_WIDE: Final = 1.0
"""Width of all other characters, some of which are narrower: ideographs fill a square."""
_WITHOUT_WIDTH: Final = frozenset({"Mn", "Me", "Cf"})
"""Categories of characters that take no room: accents, and what joins characters."""
BOLD: Final = 1.14
"""The width of bold letters in widths of other ones."""
_SIZES: Final = (13.0, 12.0, 11.0, 10.0)
_LINE: Final = 1.16
_MOST_LINES: Final = 3
_FITS: Final = (
    (13.0, 1),
    (12.0, 1),
    *((size, lines) for size in _SIZES for lines in range(1, _MOST_LINES + 1)),
)
"""Sizes and numbers of lines, the best first: a single line may be a little smaller than several."""
_MARGIN: Final = 5.0
"""Pixels between a name and the rim of its state."""
_RING_MARGIN: Final = 10.0
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
        return self.size * _LINE


def width(text: str, size: float) -> float:
    """Return the width of a text in pixels, at a size of letters in pixels."""
    return sum(_width(each) for each in text) * size


def shortened(text: str, size: float, room: float) -> str:
    """Return a text that is no wider than some pixels, shortened at its end."""
    if width(text, size) <= room:
        return text
    used = width(_ELLIPSIS, size)
    taken = 0
    for each in text:
        used += _width(each) * size
        if used > room:
            break
        taken += 1
    return text[:taken].rstrip() + _ELLIPSIS


def wrapped(text: str, size: float, room: float) -> list[str]:
    """Return a text in lines no wider than some pixels, broken at spaces, or within a word that is wider.

    Its own line ends and the spaces before a line are kept.
    """
    lines: list[str] = []
    for paragraph in text.replace("\r\n", "\n").split("\n"):
        indent = paragraph[: len(paragraph) - len(paragraph.lstrip(" "))]
        line = "\N{NO-BREAK SPACE}" * len(indent)
        has_word = False
        for word in paragraph.split():
            longer = f"{line} {word}" if has_word else line + word
            if has_word and width(longer, size) > room:
                lines.append(line)
                longer = word
            while width(longer, size) > room and len(longer) > 1:
                taken = _fitting(longer, size, room)
                lines.append(longer[:taken])
                longer = longer[taken:]
            line, has_word = longer, True
        lines.append(line)
    return lines


def _fitting(text: str, size: float, room: float) -> int:
    """Return how many characters of a text fit, at least one."""
    used = 0.0
    for index, each in enumerate(text):
        used += _width(each) * size
        if used > room:
            return max(1, index)
    return len(text)


def fit_circle(name: str, *, has_ring: bool = False) -> Fitted:
    """Return the lines of a state's name.

    It is broken at spaces, hyphens, underscores, before capitals and ideographs.
    """
    radius = RADIUS - (_RING_MARGIN if has_ring else _MARGIN)
    words = _words(" ".join(name.split()))
    if not words:
        return Fitted((), _SIZES[0])
    for size, count in _FITS:
        lines = _broken(words, size, count, radius)
        if lines is not None:
            return Fitted(tuple(lines), size)
    return Fitted(tuple(_cut(words, _SIZES[-1], radius)), _SIZES[-1])


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


@lru_cache(maxsize=4096)
def _width(character: str) -> float:
    """Return the width of a character, as a part of the size."""
    if unicodedata.category(character) in _WITHOUT_WIDTH:
        return 0.0
    return _WIDTHS.get(unicodedata.normalize("NFD", character)[0], _WIDE)


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


def _broken(words: Sequence[str], size: float, count: int, radius: float) -> list[str] | None:
    """Return the words in at most `count` lines, or None when they do not fit."""
    lines = [""]
    for word in words:
        longer = lines[-1] + word
        if lines[-1] and width(longer.strip(), size) > _chord(len(lines) - 1, count, size, radius):
            lines.append(word)
        else:
            lines[-1] = longer
    lines = [line.strip() for line in lines]
    if len(lines) > count:
        return None
    fits = (width(line, size) <= _chord(index, len(lines), size, radius) for index, line in enumerate(lines))
    return lines if all(fits) else None


def _cut(words: Sequence[str], size: float, radius: float) -> list[str]:
    """Return as much of the words as fits in all lines, each shortened at its end."""
    lines: list[str] = []
    left = list(words)
    while left and len(lines) < _MOST_LINES:
        room = _chord(len(lines), _MOST_LINES, size, radius)
        taken = len(left) if len(lines) == _MOST_LINES - 1 else 1
        while taken < len(left) and width("".join(left[: taken + 1]).strip(), size) <= room:
            taken += 1
        lines.append(shortened("".join(left[:taken]).strip(), size, room))
        left = left[taken:]
    return lines


def _chord(index: int, count: int, size: float, radius: float) -> float:
    """Return the width of the line with an index that fits in a circle."""
    height = size * _LINE
    far = max(abs(index - count / 2), abs(index + 1 - count / 2)) * height - size * 0.2
    return 2 * math.sqrt(max(0.0, radius**2 - far**2))
