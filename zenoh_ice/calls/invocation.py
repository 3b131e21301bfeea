"""Futures of calls: what they cost is paid by whoever waits, and only when somebody does."""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator
from concurrent.futures import Future, InvalidStateError
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar, cast

import zenoh

if TYPE_CHECKING:
    from .receiver import Receiver

__all__ = ["Exchange", "InvocationFuture", "Replies", "fail", "first_reply", "settle"]

V = TypeVar("V")

_PENDING: Final = "PENDING"
_FINISHED: Final = "FINISHED"
_NOTHING: Final = nullcontext()
_CANCELLED: Final = frozenset({"CANCELLED", "CANCELLED_AND_NOTIFIED"})


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
        """Let go of the replies, and return what the operation returns, or raise what it raises.

        None is the end without a reply.
        """

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
        # As the base class does it, but for the condition, which takes longer to make than all the rest:
        # hardly any call in flight needs one.
        self._state = _PENDING
        self._result = self._exception = None
        self._waiters = []
        self._done_callbacks: list[Callable[[Future[V]], object]] = []
        self._lock: Final = threading.RLock()
        self._made_condition: threading.Condition | None = None
        self._receiver = receiver
        self._watched = False
        self._unreceived: list[Exchange] = []
        """The exchange; who takes it out receives its reply, and nobody else does."""
        self._exchange: Exchange | None = None

    def __await__(self) -> Generator[Any, None, V]:
        import asyncio  # here: it takes long to load, and who awaits has it

        return asyncio.wrap_future(self).__await__()

    @property
    def given_up(self) -> bool:
        """Whether it was cancelled; unlike `cancelled` that has no reply received."""
        return self._state in _CANCELLED

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
        if self._state in _CANCELLED:
            exchange.close()
            return
        try:
            result = cast("V", exchange.interpret(reply))
        except BaseException as error:  # noqa: BLE001 - it is told by the future
            fail(self, error)
            return
        with self._lock:
            # As long as nobody has taken `_condition`, there is nobody to wake or to call back.
            alone = not self._watched and self._state == _PENDING
            if alone:
                self._result = result
                self._state = _FINISHED
        if not alone:
            with suppress(InvalidStateError):
                self.set_result(result)

    @property
    def _condition(self) -> threading.Condition:
        """The condition of the base class.

        It is taken wherever somebody wants to be woken when the outcome is known: from then on the reply is
        received by somebody who does not wait for it in person.
        """
        self.attend()
        made = self._made_condition
        if made is None:
            with self._lock:
                made = self._made_condition = self._made_condition or threading.Condition(self._lock)
        return made

    @_condition.setter
    def _condition(self, condition: threading.Condition) -> None:
        # Nobody does; without it this were no future for what declares one that `as_completed` takes.
        self._made_condition = condition

    def _watch(self) -> None:
        if self._receiver is not None:
            with suppress(IndexError):
                self._receiver.watch(self, self._unreceived.pop())


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
