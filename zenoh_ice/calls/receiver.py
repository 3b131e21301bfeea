"""Threads that receive the replies of calls for which nobody waits in person."""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections import deque
from functools import partial
from typing import Any, Final

import zenoh

from ..dispatch import Dispatcher, mark_thread
from ..exceptions import CommunicatorDestroyedException
from .invocation import Exchange, InvocationFuture, Replies, fail, first_reply
from .unattended import Unattended

__all__ = ["Receiver"]

_THREADS: Final = 8  # of a communicator that receive for futures which nobody waits for
_PATIENCE: Final = 0.001  # s after which a thread that receives nothing is held up
_SPARE_FOR: Final = 5.0  # s after which a thread that nobody needs ends, unless it is the last that is free

_logger = logging.getLogger(__name__)


class Receiver:
    """Receive replies for futures that somebody wants to be told of, with few threads for any number of them.

    One thread receives them in the order in which they were sent, which is that in which most come, and
    settles the futures. When it is held up, by a call that takes long or by a callback of a user, another
    thread goes on in its place. Once all but one are held up, the last looks after all calls by turns.
    Threads that are needed no longer end after a while. A receiver ends when its session is closed, which
    ends all calls.
    """

    def __init__(self, name: str, dispatcher: Dispatcher) -> None:
        self._name: Final = name
        self._dispatcher: Final = dispatcher
        self.blocked: Final = dispatcher.blocked
        self.unattended: Final = Unattended(name)
        self._changed = threading.Condition()
        self._waiting: deque[tuple[InvocationFuture[Any], Exchange]] = deque()
        self._futures: set[InvocationFuture[Any]] = set()
        self._threads: list[threading.Thread] = []
        self._numbers: Final = itertools.count(1)
        self._busy = 0
        self._active: threading.Thread | None = None
        """Who receives; not those who are held up."""
        self._received = 0
        self._closed = False

    def watch(self, future: InvocationFuture[Any], exchange: Exchange) -> None:
        """Receive a reply, and let a future have the outcome."""
        with self._changed:
            if self._closed:
                self._dispatcher.submit(partial(fail, future, _destroyed()))
                return
            self._futures.add(future)
            self._waiting.append((future, exchange))
            if self._active is None or len(self._waiting) == 1:  # otherwise somebody looks up soon
                self._changed.notify()
            if len(self._threads) - self._busy < 1 and len(self._threads) < _THREADS:
                self._start()

    def close(self, timeout: float) -> None:
        """End the threads, after the session was closed; futures that have no outcome get an exception."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        deadline = time.monotonic() + timeout
        self.unattended.close(timeout)
        for thread in tuple(self._threads):
            if thread is not threading.current_thread():
                thread.join(max(0.0, deadline - time.monotonic()))
        for future in tuple(self._futures):
            fail(future, _destroyed())

    def _start(self) -> None:
        name = f"{self._name} replies {next(self._numbers)}"
        thread = threading.Thread(target=self._work, name=name, daemon=True)
        thread.start()  # first: if Ctrl-C strikes here, what was not started must not be waited for
        self._threads.append(thread)

    def _work(self) -> None:
        mark_thread()
        while self._wait_for_turn():
            if self._busy >= _THREADS:
                self._look_through()
            else:
                self._receive_in_order()

    def _wait_for_turn(self) -> bool:
        """Wait until there is something to receive and nobody does; return False at the end."""
        with self._changed:
            while not self._waiting or self._active is not None:
                if not self._waiting:
                    if self._closed:
                        return False
                    if not self._changed.wait(_SPARE_FOR) and len(self._threads) - self._busy > 1:
                        self._threads.remove(threading.current_thread())
                        return False
                else:
                    received = self._received
                    self._changed.wait(_PATIENCE)
                    if self._received == received:  # whoever receives is held up
                        self._active = None
            self._active = threading.current_thread()
            self._busy += 1
            if self._busy == len(self._threads) < _THREADS:
                self._start()  # who looks up when this one is held up
            return True

    def _receive_in_order(self) -> None:
        myself = threading.current_thread()
        while True:
            with self._changed:
                if not self._waiting or self._active is not myself:
                    self._end_turn()
                    return
                future, exchange = self._waiting.popleft()
            self._settle(future, exchange, first_reply(exchange.replies))
            self._received += 1

    def _look_through(self) -> None:
        """Take the replies that have come; whatever takes long then is done by others."""
        with self._changed:
            waiting = list(self._waiting)
            found = [(each, reply) for each in waiting for reply in _replies_so_far(each[1].replies)]
            received = {id(each) for each, _ in found}
            self._waiting = deque(each for each in waiting if id(each) not in received)
            self._end_turn()
        for each, reply in found:
            self._dispatcher.submit(partial(self._settle, *each, reply))
        time.sleep(_PATIENCE)

    def _end_turn(self) -> None:
        self._busy -= 1
        if self._active is threading.current_thread():
            self._active = None
            if self._waiting:
                self._changed.notify()

    def _settle(self, future: InvocationFuture[Any], exchange: Exchange, reply: zenoh.Reply | None) -> None:
        try:
            future.received(exchange, reply)
        except BaseException:
            _logger.exception("internal error in %s", threading.current_thread().name)
        self._futures.discard(future)


def _replies_so_far(replies: Replies) -> list[zenoh.Reply | None]:
    """Return the reply that has come, None for the end without one, or nothing as long as it may come."""
    try:
        reply = replies.try_recv()
    except zenoh.ZError:
        return [None]
    return [] if reply is None else [reply]


def _destroyed() -> CommunicatorDestroyedException:
    return CommunicatorDestroyedException("the communicator was destroyed during the call")
