"""At most once: the answers of recent calls, for who sends a call again because its answer got lost."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Final

from ..exceptions import BusyException, ConnectionLostException
from ..wire.errors import encode_error
from ..wire.pieces import Pieces

__all__ = ["Answer", "AnswerLater", "AnswerMemory", "CallKey"]

Answer = tuple[bool, bytes | Pieces]
"""Whether a call succeeded, and its result or error as it travels."""
AnswerLater = Callable[[bool, bytes | Pieces], object]
"""Takes an answer when there is one."""

_MOST_CALLS: Final = 256
_LONGEST_ANSWER: Final = 4096  # bytes
_MOST_ASKING: Final = 4  # for the answer of one call, while it runs


CallKey = tuple[str, str, int]
"""By what a call is known again: its id, what it calls, and the hash of its arguments.

Not by its id alone: who foresees that could have another call take its place. Nobody else can compute the
hash.
"""


class AnswerMemory:
    """The last 256 calls of a servant that must not be executed twice.

    An answer of more than 4 kB is not kept, only that there was one.
    """

    def __init__(self) -> None:
        self._lock: Final = threading.Lock()
        self._answers: Final[OrderedDict[CallKey, Answer]] = OrderedDict()  # as they were given
        self._running: Final[
            dict[CallKey, tuple[AnswerLater, ...]]
        ] = {}  # with those who asked again meanwhile

    def begin(self, call: CallKey) -> bool:
        """Note a call that is about to be executed; return False when it was begun before."""
        with self._lock:
            if call in self._running or call in self._answers:
                return False
            self._running[call] = ()
            return True

    def answer(self, call: CallKey, later: AnswerLater) -> Answer | None:
        """Return the answer of a call that was begun before; None while there is none: `later` gets it."""
        with self._lock:
            waiting = self._running.get(call)
            if waiting is None:
                return self._answers.get(call) or (False, _forgotten())
            if len(waiting) >= _MOST_ASKING:
                return False, _busy(call)
            self._running[call] = (*waiting, later)
            return None

    def end(self, call: CallKey, ok: bool, payload: bytes | Pieces) -> None:
        """Keep the answer of a call, and give it to those who asked meanwhile."""
        answer = ok, payload
        with self._lock:
            waiting = self._running.pop(call)
            if len(self._answers) >= _MOST_CALLS:
                self._answers.popitem(last=False)
            self._answers[call] = answer if len(payload) <= _LONGEST_ANSWER else (False, _forgotten())
        for later in waiting:
            later(*answer)


def _forgotten() -> bytes:
    return encode_error(ConnectionLostException("the call was executed, and its answer was lost on the way"))


def _busy(call: CallKey) -> bytes:
    return encode_error(BusyException(f"{call[1]}: it runs, and {_MOST_ASKING} wait for its answer already"))
