"""The interface that proxies, servants and streams build on: a few operations on encoded payloads.

Two transports of this package implement it, in `routes/`: between processes, and within one. Others stand in
front of a communicator: they record what passes, replay it, or run in virtual time (`hfsm_runtime`), or let
code that nobody trusts call servants.
"""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from functools import partial
from typing import Any, Final, NamedTuple, Protocol

from zenoh_ice.data.codec import Buffer, Parted, Pieces
from zenoh_ice.data.exceptions import ObjectNotExistException, SystemException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import (
    encode_error,
    unknown_exception,
)
from zenoh_ice.threads.clock import WALL, Clock
from zenoh_ice.threads.pool import Job, JobKind

_REFUSALS: Final = JobKind()

_logger = logging.getLogger(__name__)


class Arrived(NamedTuple):
    """A sample that arrived, encoded; its large byte sequences may be separate."""

    payload: bytes | Parted
    attachment: bytes | None
    age: Callable[[], float] | None = None
    """Returns its age in wall s, where that does not follow from the attachment."""


Answer = tuple[bool, "bytes | Pieces"]
"""True and the result of a call, or false and its exception, encoded, as a servant gives it."""

Outcome = tuple[bool, "bytes | Parted"]
"""The same as it arrived at the caller."""

Reply = Callable[[bool, "bytes | Pieces"], object]
"""Takes the answer of a call; it is called once."""


Ended = Callable[[], bool]
"""Returns whether the connection over which a call came has ended: then nobody waits for its answer."""


class Receiver(Protocol):
    """The servant's side of calls, as a transport sees it."""

    @property
    def runs_here(self) -> bool:
        """Return whether this thread runs a call of the servant: it must not wait for another one's end."""

    def admit(
        self,
        name: str,
        payload: Buffer | None,
        attachment: Buffer | None,
        reply: Reply,
        *,
        gone: bool = False,
        ended: Ended | None = None,
    ) -> Job | None:
        """Give a call its place; return the function that runs or refuses it, None if it waits for its turn.

        Calls are executed in the order in which they are admitted; other calls wait meanwhile, so it takes
        microseconds. `gone` says that nobody waits for the answer any more; for a call that waits, `ended` is
        asked before it runs. The returned function raises nothing: it gives `reply` the answer in any case.
        """


class Receivers(dict[str, Receiver]):
    """Receivers by the prefix of their target; raises ObjectNotExistException for another one."""

    def __missing__(self, prefix: str) -> Receiver:
        raise ObjectNotExistException(f"{prefix.rpartition('/')[2]} is no longer served")


def refusal(failure: BaseException, key: str, reply: Reply) -> Job:
    """Return the job that refuses a call whose receiver did not admit it, or is not there."""
    if not isinstance(failure, ObjectNotExistException):
        _logger.error("internal error at %s", key, exc_info=failure)
        failure = unknown_exception(failure)
    return _REFUSALS, partial(reply, False, encode_error(failure))


class NoAnswer(SystemException):
    """A call ended without an answer.

    `timed_out` says whether its limit had passed, `broken` whether the connection that it took has ended.
    """

    def __init__(self, *, timed_out: bool, broken: bool = False) -> None:
        super().__init__("no answer")
        self.timed_out = timed_out
        self.broken = broken


def outcome_of(call: Callable[[], Outcome]) -> Outcome | SystemException:
    """Return the outcome of a call, or the exception that it raises."""
    try:
        return call()
    except SystemException as error:
        return error


class Caller(Protocol):
    """Call one operation of one servant, within one time limit; thread-safe."""

    @property
    def timeout(self) -> float:
        """The limit of a call in s."""

    def call(self, payload: bytes) -> Outcome:
        """Call and wait for the answer; raises NoAnswer, or another SystemException for an unreadable one."""

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        """Call without waiting; `done` gets the outcome, once, on another thread.

        Return a function that gives the call up. Raises SystemException where the call cannot be sent.
        """


class Pacer:
    """Compute when the next sample is due, so that there are at most `rate` a second on average."""

    def __init__(self, rate: float | None, clock: Clock = WALL) -> None:
        self._period: Final = 0.0 if rate is None else 1.0 / rate
        self._clock: Final = clock
        self._due = -math.inf

    def delay(self) -> float:
        """Return the seconds of the clock to wait before the next sample."""
        return 0.0 if self._due == -math.inf else max(0.0, self._due - self._clock.now())

    def count(self) -> None:
        """Count a sample now."""
        if not self._period:
            return
        # From when it was due, so that late samples do not lower the rate; but pauses are not made up for.
        now = self._clock.now()
        self._due = (self._due if now - self._due < self._period else now) + self._period


class Registration:
    """A registration of a receiver, a watcher or a token, until it is closed."""

    def __init__(self, close: Callable[[], object]) -> None:
        self._close: Callable[[], object] | None = close

    def close(self) -> None:
        """End it: call the function that it was made from, once."""
        close, self._close = self._close, None
        if close is not None:
            close()


class Outlet(Protocol):
    """The publishing end of a stream; thread-safe."""

    @property
    def listening(self) -> bool:
        """Return whether anybody listens; takes a microsecond."""

    def put(self, payload: bytes | Pieces, attachment: bytes) -> None:
        """Send a sample; it is dropped where the listener or the network is slower."""

    def close(self) -> None:
        """Release the key."""


class Inlet(Protocol):
    """The listening end of a stream: a queue that drops the oldest samples."""

    def poll(self) -> Any:  # noqa: ANN401 - each transport has its own
        """Return the next sample as it arrived, None while there is none."""

    def wait(self, changed: threading.Condition, holds: Callable[[], bool], timeout: float) -> bool:
        """Wait until a function that polls returns true, for at most `timeout` s; return whether it did.

        The caller holds `changed`, which is notified of every other change that the function depends on.
        """

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:
        """Call a function with each sample as it arrived, one after the other, until `close`.

        With a rate, only with the newest, at most that many per second. `poll` then returns no samples.
        Raises BusyException where the system gives the process no thread for it.
        """

    def open(self, sample: Any) -> Arrived:  # noqa: ANN401 - what `poll` and `deliver` give
        """Return the contents of a sample.

        Raises MarshalException for one that is too large, ConnectionLostException for one that was lost with
        its sender's memory.
        """

    def close(self, timeout: float = 0.0) -> bool:
        """Stop listening; return whether a running function ended within `timeout` s."""


class Relay(Protocol):
    """The far side of a transport that finds servants and waits for them by itself.

    Such a transport stands in front of another communicator, or of a recording of one: no tokens appear on
    it, and a call is made at once, whose outcome says whether the servant was there.
    """

    def find(self, target: Target, type_id: str, timeout: float) -> Mapping[str, str]:
        """Return the fingerprints of a servant's interfaces by type id, as `Communicator.find` does."""

    def wait(self, future: Future[Any], timeout: float | None) -> None:
        """Wait until a future of a call is done, for at most `timeout` s."""


class Transport(Protocol):
    """Carry encoded calls, samples and tokens between processes, or within one."""

    id: str
    """The id of this end: `Current.client` in the servants that it calls."""
    endpoints: Sequence[str]
    """The endpoints that it connects to; none for one that connects to nobody."""
    token_delay: float
    """Seconds within which existing tokens arrive, once a link is made."""
    clock: Clock
    """The clock by which the readers of its streams pace themselves: wall time, or that of a test."""
    relay: Relay | None
    """The finder of servants in place of the communicator; None where tokens show who is there."""

    @property
    def local_address(self) -> str:
        """Where processes of this machine reach its servants without a network; empty if they do not."""

    def is_near(self, target: Target) -> bool:
        """Return whether the next call to a target needs no network."""

    def explain_unreachable(self, limit: float) -> str:
        """Return why nothing answers at the endpoints, after `limit` s at most."""

    # Calls.

    def caller(
        self,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,
    ) -> Caller:
        """Return the caller of an operation.

        `timeout` is the limit of a call in s. `fingerprint` is that of the caller's interface; without any,
        the servant does not learn who calls.
        """

    def serve(self, target: Target, receiver: Receiver) -> Registration:
        """Pass the calls of a target to a receiver, on threads that may run user code."""

    # Streams.

    def publish(self, target: Target, operation: Operation[..., Any]) -> Outlet:
        """Return the publishing end of a stream."""

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:
        """Return a listening end of a stream, with room for `queue` samples."""

    # Presence.

    def announce(self, token: str) -> Registration:
        """Show a token to everybody until it is closed, or until this process is gone."""

    def watch(self, pattern: str, changed: Callable[[str, bool], object]) -> Registration:
        """Call a function with each token that appears (True) or disappears (False), the present ones first.

        It must not wait: it may run on a thread that receives for all.
        """

    def watch_links(self, changed: Callable[[str, bool], object]) -> Registration:
        """Call a function with the id of each process to which a link is made (True) or lost (False)."""

    # Status.

    def serve_status(self, realm: str, status: Callable[[], bytes]) -> Registration:
        """Answer requests for the status of this process, also while all servants are busy."""

    def ask_status(self, realm: str, process: str, timeout: float) -> Buffer:
        """Return the status of a process by its id; raises ConnectionLostException without one in time."""

    def close(self) -> None:
        """End everything; waiting calls raise NoAnswer."""
