"""At most once: the answers of recent calls, for who sends a call again because its answer got lost."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from .exceptions import ConnectionLostException
from .pieces import Pieces
from .wire_errors import encode_error

__all__ = ["Answer", "AnswerLater", "AnswerMemory", "RememberedCall"]

Answer = tuple[bool, bytes | Pieces]
"""Whether a call succeeded, and its result or error as it travels."""
AnswerLater = Callable[[bool, bytes | Pieces], object]
"""Takes an answer when there is one."""

_MOST_CALLS: Final = 256
_LONGEST_ANSWER: Final = 4096  # bytes


class RememberedCall:
    """A call that was executed, or is being executed."""

    def __init__(self, lock: threading.Lock) -> None:
        self._lock: Final = lock
        self._answer: Answer | None = None
        self._waiting: list[AnswerLater] = []

    def answer(self, later: AnswerLater) -> Answer | None:
        """Return the answer; without one yet, None, and `later` is given it."""
        with self._lock:
            if self._answer is None:
                self._waiting.append(later)
            return self._answer

    def end(self, ok: bool, payload: bytes | Pieces) -> None:
        """Keep the answer, and give it to those who asked meanwhile."""
        answer = (ok, payload)
        with self._lock:
            self._answer = answer if len(payload) <= _LONGEST_ANSWER else (False, _forgotten(len(payload)))
            waiting, self._waiting = self._waiting, []
        for later in waiting:
            later(*answer)


class AnswerMemory:
    """The last 256 calls of a servant that must not be executed twice, by their ids.

    An answer of more than 4 kB is not kept, only that there was one.
    """

    def __init__(self) -> None:
        self._lock: Final = threading.Lock()
        self._calls: Final[dict[str, RememberedCall]] = {}

    def begin(self, call_id: str) -> tuple[RememberedCall, bool]:
        """Return what is known of a call, and whether it came for the first time and is to be executed."""
        with self._lock:
            call = self._calls.get(call_id)
            if call is not None:
                return call, False
            if len(self._calls) >= _MOST_CALLS:
                del self._calls[next(iter(self._calls))]
            call = self._calls[call_id] = RememberedCall(self._lock)
            return call, True


def _forgotten(size: int) -> bytes:
    return encode_error(
        ConnectionLostException(f"the call was executed, and its answer of {size} bytes was lost on the way")
    )
