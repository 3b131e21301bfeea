"""At most once: the answers of recent calls, for who sends a call again because its answer got lost."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from .exceptions import ConnectionLostException
from .pieces import Pieces
from .wire_errors import encode_error

__all__ = ["Answer", "AnswerLater", "AnswerMemory"]

Answer = tuple[bool, bytes | Pieces]
"""Whether a call succeeded, and its result or error as it travels."""
AnswerLater = Callable[[bool, bytes | Pieces], object]
"""Takes an answer when there is one."""

_MOST_CALLS: Final = 256
_LONGEST_ANSWER: Final = 4096  # bytes


class AnswerMemory:
    """The last 256 calls of a servant that must not be executed twice, by their ids.

    An answer of more than 4 kB is not kept, only that there was one.
    """

    def __init__(self) -> None:
        self._lock: Final = threading.Lock()
        self._answers: Final[dict[str, Answer]] = {}  # in the order in which they were given
        self._running: Final[dict[str, tuple[AnswerLater, ...]]] = {}  # with those who asked again meanwhile

    def begin(self, call_id: str) -> bool:
        """Note a call that is about to be executed; return False when it was begun before."""
        with self._lock:
            if call_id in self._running or call_id in self._answers:
                return False
            self._running[call_id] = ()
            return True

    def answer(self, call_id: str, later: AnswerLater) -> Answer | None:
        """Return the answer of a call that was begun before; None while there is none: `later` gets it."""
        with self._lock:
            waiting = self._running.get(call_id)
            if waiting is None:
                return self._answers.get(call_id) or (False, _forgotten())
            self._running[call_id] = (*waiting, later)
            return None

    def end(self, call_id: str, ok: bool, payload: bytes | Pieces) -> None:
        """Keep the answer of a call, and give it to those who asked meanwhile."""
        answer = ok, payload
        with self._lock:
            waiting = self._running.pop(call_id)
            if len(self._answers) >= _MOST_CALLS:
                del self._answers[next(iter(self._answers))]
            self._answers[call_id] = answer if len(payload) <= _LONGEST_ANSWER else (False, _forgotten())
        for later in waiting:
            later(*answer)


def _forgotten() -> bytes:
    return encode_error(ConnectionLostException("the call was executed, and its answer was lost on the way"))
