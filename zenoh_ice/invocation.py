"""Futures of calls: what they cost is paid by whoever waits, and only when somebody does."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import Future, InvalidStateError
from contextlib import AbstractContextManager, nullcontext, suppress
from functools import partial
from typing import Any, Final, Protocol, TypeVar, cast

import zenoh

from .dispatch import Dispatcher, mark_thread
from .exceptions import CommunicatorDestroyedException
from .unattended import Unattended

__all__ = ["Exchange", "InvocationFuture", "Receiver", "Replies", "fail", "first_reply", "settle"]

V = TypeVar("V")

_THREADS: Final = 8  # of a communicator that receive for futures which nobody waits for
_PATIENCE: Final = 0.001  # s after which a thread that receives nothing is held up
_PENDING: Final = "PENDING"
_FINISHED: Final = "FINISHED"
_NOTHING: Final = nullcontext()
_CANCELLED: Final = frozenset({"CANCELLED", "CANCELLED_AND_NOTIFIED"})

_logger = logging.getLogger(__name__)


class Replies(Protocol):
    """What the answer to a request is received from; both raise ZError at the end without one."""

    def recv(self) -> zenoh.Reply:
        """Wait for the answer."""

    def try_recv(self) -> zenoh.Reply | None:
        """Return the answer, or None before it has come."""


class Exchange(Protocol):
    """A request that was sent."""

    @property
    def replies(self) -> Replies:
        """What the reply is received from."""

    @property
    def longest_wait(self) -> float:
        """Seconds within which the outcome is known in any case."""

    def interpret(self, reply: zenoh.Reply | None) -> object:
        """Return what the operation returns, or raise what it raises; None is the end without a reply."""

    def cancel(self) -> None:
        """Forget the request; no reply is received any more."""

    def close(self) -> None:
        """Let go of the replies."""


class InvocationFuture(Future[V]):
    """The outcome of a call, to wait for by `result`, to `await`, to be called back by or to cancel.

    `cancel` ends the wait at once; the servant may execute the call all the same. Functions given to
    `add_done_callback` run on threads of the communicator.
    """

    def __init__(self, receiver: Receiver | None = None) -> None:
        self._receiver = receiver
        self._watched = False
        self._unreceived: list[Exchange] = []
        """The exchange; who takes it out receives its reply, and nobody else does."""
        self._exchange: Exchange | None = None
        super().__init__()

    def __await__(self) -> Generator[Any, None, V]:
        import asyncio  # here: it takes long to load, and who awaits has it

        return asyncio.wrap_future(self).__await__()

    def begun(self, exchange: Exchange) -> None:
        """Take note that the request was sent."""
        self._exchange = exchange
        self._unreceived.append(exchange)
        if self._watched:
            self._watch()
        elif self._receiver is not None:
            self._receiver.unattended.add(self)
        if self._state in _CANCELLED:
            exchange.cancel()

    def attend(self) -> None:
        """Have the reply received, unless somebody does."""
        if not self._watched and self._state != _FINISHED:
            self._watched = True
            self._watch()

    def result(self, timeout: float | None = None) -> V:
        """Return what the operation returns, or raise what it raises.

        Without `timeout`, in s, it waits for as long as a call may take. Raises TimeoutError when the
        outcome is not known in time, CancelledError after `cancel`.
        """
        if self._state != _FINISHED:
            self._receive(timeout)
        if self._state == _FINISHED and self._exception is None:
            return cast("V", self._result)  # nobody changes it any more, so that no lock is needed
        with self._waiting():
            return super().result(timeout)

    def exception(self, timeout: float | None = None) -> BaseException | None:
        """Return what the operation raises, or None; waits as `result` does."""
        self._receive(timeout)
        with self._waiting():
            return super().exception(timeout)

    def running(self) -> bool:
        """Return whether the outcome is not known yet."""
        return not self.done()

    def cancel(self) -> bool:
        """End the wait; return False when the outcome is known already."""
        if not super().cancel():
            return False
        with self._lock:
            if self._state == "CANCELLED":
                self.set_running_or_notify_cancel()  # tells those that wait for several futures
        if self._exchange is not None:
            self._exchange.cancel()
        return True

    def _waiting(self) -> AbstractContextManager[None]:
        """Let the pool of threads that settles futures have one thread more, if this is one of them."""
        if self._receiver is None or self._state == _FINISHED:
            return _NOTHING
        return self._receiver.blocked()

    def _receive(self, timeout: float | None) -> None:
        """Receive the reply on the thread that wants it: that saves two changes of threads."""
        try:
            exchange = self._unreceived[-1]
            if timeout is not None and timeout < exchange.longest_wait:
                return  # a reply cannot be received with another limit than that of the call
            self._unreceived.remove(exchange)
        except (IndexError, ValueError):
            return  # not sent yet, or somebody else receives
        try:
            reply = first_reply(exchange.replies)
        except BaseException:  # Ctrl-C: others wait on, and who asks again does
            self._unreceived.append(exchange)
            if self._watched:
                self._watch()
            raise
        self.received(exchange, reply)

    def received(self, exchange: Exchange, reply: zenoh.Reply | None) -> None:
        """Let the future have the outcome that a reply is, or that there was none."""
        self._exchange = None
        exchange.close()
        if self._state in _CANCELLED:
            return
        try:
            result = cast("V", exchange.interpret(reply))
        except BaseException as error:  # noqa: BLE001 - it is told by the future
            fail(self, error)
            return
        with self._lock:
            # As long as nobody has taken the lock from `_condition`, there is nobody to wake or to call back.
            alone = not self._watched and self._state == _PENDING
            if alone:
                self._result = result
                self._state = _FINISHED
        if not alone:
            with suppress(InvalidStateError):
                self.set_result(result)

    # The standard library takes this lock wherever it needs to be woken when the outcome is known: by then
    # somebody must receive the reply who does not wait for it in person.

    @property
    def _condition(self) -> threading.Condition:
        self.attend()
        return self._lock

    @_condition.setter
    def _condition(self, condition: threading.Condition) -> None:
        self._lock = condition

    def _watch(self) -> None:
        if self._receiver is not None:
            with suppress(IndexError):
                self._receiver.watch(self, self._unreceived.pop())


class Receiver:
    """Receive replies for futures that somebody wants to be told of, with few threads for any number of them.

    One thread receives them in the order in which they were sent, which is that in which most come, and
    settles the futures. When it is held up, by a call that takes long or by a callback of a user, another
    thread goes on in its place. Once all but one are held up, the last looks after all calls by turns.
    A receiver ends when its session is closed, which ends all calls.
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
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(max(0.0, deadline - time.monotonic()))
        for future in tuple(self._futures):
            fail(future, _destroyed())

    def _start(self) -> None:
        name = f"{self._name} replies {len(self._threads) + 1}"
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
                    self._changed.wait()
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


def settle(future: Future[Any], compute: Callable[[], object]) -> None:
    """Give a future the outcome of a function, unless it has one already."""
    try:
        result = compute()
    except BaseException as error:  # noqa: BLE001 - it is told by the future
        fail(future, error)
    else:
        with suppress(InvalidStateError):
            future.set_result(result)


def fail(future: Future[Any], error: BaseException) -> None:
    """Give a future an exception, unless it has an outcome already."""
    with suppress(InvalidStateError):  # it was cancelled, or the communicator was destroyed and said so
        future.set_exception(error)


def first_reply(replies: Replies) -> zenoh.Reply | None:
    """Wait for a reply; return None when the call ended without one.

    Nothing else may keep the channel, not even the frames of an exception: one that a servant fills with more
    replies holds up all that comes by the same link.
    """
    try:
        return replies.recv()
    except zenoh.ZError:  # the channel was closed
        return None


def _replies_so_far(replies: Replies) -> list[zenoh.Reply | None]:
    """Return the reply that has come, None for the end without one, or nothing as long as it may come."""
    try:
        reply = replies.try_recv()
    except zenoh.ZError:
        return [None]
    return [] if reply is None else [reply]


def _destroyed() -> CommunicatorDestroyedException:
    return CommunicatorDestroyedException("the communicator was destroyed during the call")
