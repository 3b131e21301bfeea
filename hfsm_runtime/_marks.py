"""Marks of a component on the pictures of its cameras."""

from __future__ import annotations

import math
import threading
from typing import Final, NamedTuple

from .errors import MarkError

_SHOWN: Final = 500_000_000
"""Nanoseconds of component time for which a mark is shown."""
_MOST_MARKS: Final = 16
"""Marks that are kept for each camera."""
_MOST_CAMERAS: Final = 8
_LONGEST_TEXT: Final = 60
"""Characters of a label, and of the name of a camera."""


class Mark(NamedTuple):
    """A pixel of a camera's picture, right and down from its top left corner."""

    camera: str
    u: float
    v: float
    label: str


def make_mark(camera: str, u: float, v: float, label: str = "") -> Mark:
    """Return a mark; raises MarkError when it cannot be one."""
    for name, text in (("camera", camera), ("label", label)):
        if not isinstance(text, str) or len(text) > _LONGEST_TEXT or not text.isprintable():
            raise MarkError(
                f"the {name} of a mark is a text of at most {_LONGEST_TEXT} visible characters, "
                f"not {text!r:.80}"
            )
    if not camera:
        raise MarkError("a mark is on the picture of a camera: name it, such as 'Camera'")
    try:
        mark = Mark(camera, float(u), float(v), label)
    except (TypeError, ValueError) as error:
        raise MarkError(f"a mark is at two numbers of pixels, not {u!r:.40} and {v!r:.40}") from error
    if not (math.isfinite(mark.u) and math.isfinite(mark.v)):
        raise MarkError(f"the mark {label!r} is at {u} and {v}: a pixel is at finite numbers")
    return mark


class Marks:
    """The newest marks on each camera's picture, one for each label. For any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._marks: dict[str, dict[str, tuple[int, Mark]]] = {}

    def add(self, mark: Mark, now: int) -> None:
        """Keep a mark made at a component time in ns; the oldest gives way when there are too many."""
        with self._lock:
            marks = self._marks.pop(mark.camera, {})
            marks.pop(mark.label, None)
            marks[mark.label] = now, mark
            self._marks[mark.camera] = marks
            if len(marks) > _MOST_MARKS:
                del marks[next(iter(marks))]
            if len(self._marks) > _MOST_CAMERAS:
                del self._marks[next(iter(self._marks))]

    def shown(self, now: int) -> list[Mark]:
        """Return the marks of the last half second, the newest last."""
        with self._lock:
            found = [made for marks in self._marks.values() for made in marks.values()]
        return [mark for made, mark in sorted(found) if now - made <= _SHOWN]
