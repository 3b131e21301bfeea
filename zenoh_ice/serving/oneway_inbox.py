"""Where oneway calls arrive: in order, bounded, and with nobody who waits for an answer."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import zenoh
from zenoh.handlers import Callback

from ..dispatch import Lane
from ..exceptions import BusyException, ObjectNotExistException, UnknownException, ZenohIceError
from ..stop_signals import unbroken
from ..wire.errors import decode_error

if TYPE_CHECKING:
    from ..dispatch import Dispatcher
    from .answer_memory import Answer

__all__ = ["OnewayInbox"]

_MOST_WAITING: Final = 1024
_COMPLAINT_PERIOD: Final = 1.0  # s

_logger = logging.getLogger(__name__)


class OnewayInbox:
    """Take the oneway calls of some keys, and run them on a pool in the order in which they came.

    `execute` is given the key, the call and the moment of the monotonic clock at which it came. At most 1024
    calls of `most_bytes` altogether wait; more are dropped, which `refuse` is told and the log.
    """

    def __init__(
        self,
        name: str,
        dispatcher: Dispatcher,
        execute: Callable[[str, zenoh.Sample, float], Answer | None],
        refuse: Callable[[ZenohIceError], object],
        *,
        width: int,
        most_bytes: int,
    ) -> None:
        self._name: Final = name
        self._execute: Final = execute
        self._refuse: Final = refuse
        self._most_bytes: Final = most_bytes
        self._lane: Final = Lane(dispatcher, f"oneway calls of {name}", width=width, depth=_MOST_WAITING)
        self._subscribers: list[zenoh.Subscriber[Any]] = []
        self._lock: Final = threading.Lock()
        self._waiting_bytes = 0
        self._untold = 0
        self._told_at = -_COMPLAINT_PERIOD

    def open(self, session: zenoh.Session, keys: Iterable[str]) -> None:
        """Take calls from now on."""
        for key in keys:
            # Not by a channel of Zenoh's for each operation: the order of the calls would be lost.
            handler = Callback(unbroken(self._on_sample), indirect=False)
            self._subscribers.append(session.declare_subscriber(key, handler))

    def close(self) -> None:
        """Take no more calls."""
        while self._subscribers:
            self._subscribers.pop().undeclare()

    def drain(self, timeout: float, *, expected: int) -> bool:
        """Wait for at most `timeout` s for the calls that came; return whether all but `expected` ended."""
        return self._lane.close(timeout, expected=expected)

    def drop(self) -> None:
        """Forget the calls that wait."""
        self._lane.drop()

    def _on_sample(self, sample: zenoh.Sample) -> None:  # on Zenoh's thread: it only notes the call
        if sample.kind != zenoh.SampleKind.PUT:
            return
        size = len(sample.payload) + (0 if sample.attachment is None else len(sample.attachment))
        with self._lock:
            fits = self._waiting_bytes + size <= self._most_bytes
            if fits:
                self._waiting_bytes += size
        try:
            if not fits:
                raise BusyException(f"{self._name}: oneway calls of {self._most_bytes} bytes wait already")
            self._lane.submit(partial(self._run, sample, size, time.monotonic()))
        except (BusyException, ObjectNotExistException) as error:
            if fits:
                self._give_back(size)
            self._refuse(error)
            self._complain(error)

    def _run(self, sample: zenoh.Sample, size: int, since: float) -> None:
        key = str(sample.key_expr)
        try:
            answer = self._execute(key, sample, since)
        finally:
            self._give_back(size)
        if answer is not None and not answer[0]:
            error = decode_error(bytes(answer[1]), (), key)
            if not isinstance(error, UnknownException):  # the servant failed: it was logged as for every call
                self._complain(error)

    def _give_back(self, size: int) -> None:
        with self._lock:
            self._waiting_bytes -= size

    def _complain(self, error: ZenohIceError) -> None:
        """Log what nobody is told, at most once a second."""
        now = time.monotonic()
        with self._lock:
            self._untold += 1
            if now - self._told_at < _COMPLAINT_PERIOD:
                return
            count, self._untold, self._told_at = self._untold, 0, now
        _logger.warning("%d oneway calls of %s were dropped, the last: %s", count, self._name, error)
