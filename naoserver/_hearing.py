"""What people say to a robot that has no ears: somebody types it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from naoserver.errors import InvalidCommand

LONGEST_SENTENCE: Final = 500
"""Characters of the longest sentence."""


class Hearing:
    """Pass sentences on to all listeners. Thread-safe once they are known."""

    def __init__(self) -> None:
        self._listeners: list[Callable[[str], str]] = []

    def listen(self, understand: Callable[[str], str]) -> None:
        """Call `understand` with each sentence; it returns what it recognized, an empty text if nothing."""
        self._listeners.append(understand)

    def hear(self, sentence: str) -> str:
        """Return what was recognized in a sentence, empty if nothing. Raises InvalidCommand if it is none."""
        if not sentence.strip():
            raise InvalidCommand("text", "text is empty: there is nothing to hear")
        if len(sentence) > LONGEST_SENTENCE:
            message = f"text has {len(sentence)} characters: at most {LONGEST_SENTENCE} are heard at a time"
            raise InvalidCommand("text", message)
        return ", ".join(filter(None, [understand(sentence) for understand in self._listeners]))
