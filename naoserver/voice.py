"""The voice of a robot that has no loudspeaker: texts that take as long as a voice would take for them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from naoserver.capabilities import Utterance
from naoserver.errors import InvalidCommand

__all__ = ["LONGEST_TEXT", "MOST_WAITING", "TimedVoice", "speaking_time"]

_RATE: Final = 14.0
"""Characters a second: 150 words a minute, of 4.6 letters and a blank each."""
_PAUSE: Final = 0.4
"""Seconds of breath around a text."""
LONGEST_TEXT: Final = 2000
"""Characters that are said at a time."""
MOST_WAITING: Final = 100
"""Texts that may wait to be said."""


def speaking_time(text: str) -> float:
    """Return the seconds that a voice takes for a text."""
    return _PAUSE + len(text) / _RATE


@dataclass(frozen=True, slots=True)
class _Speech:
    text: str
    start: float
    end: float


class TimedVoice:
    """Say texts one after the other on a clock, `now` in s of robot time.

    Implements Voice; safe from any thread.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._lock = threading.Lock()
        self._agenda: deque[_Speech] = deque()  # what is being said, and what comes after it
        self._newest = ""
        self._begun = 0

    def say(self, text: str) -> None:
        """Say a text after those that were asked for before.

        Raises InvalidCommand when too many wait already.
        """
        with self._lock:
            now = self._now()
            self._go_on(now)
            if len(self._agenda) > MOST_WAITING:
                raise InvalidCommand("text", f"{MOST_WAITING} texts wait to be said already")
            start = self._agenda[-1].end if self._agenda else now
            self._agenda.append(_Speech(text, start, start + speaking_time(text)))

    def stop(self) -> None:
        """Fall silent, and forget what was not said yet."""
        with self._lock:
            self._go_on(self._now())
            if self._agenda:
                self._begin(self._agenda[0])
            self._agenda.clear()

    def utterance(self) -> Utterance:
        """Return what is being said."""
        with self._lock:
            self._go_on(self._now())
            if not self._agenda:
                return Utterance(self._newest, speaking=False, count=self._begun)
            return Utterance(self._agenda[0].text, speaking=True, count=self._begun + 1)

    def _go_on(self, now: float) -> None:
        """Drop what has been said by now."""
        while self._agenda and self._agenda[0].end <= now:
            self._begin(self._agenda.popleft())

    def _begin(self, speech: _Speech) -> None:
        self._newest = speech.text
        self._begun += 1
