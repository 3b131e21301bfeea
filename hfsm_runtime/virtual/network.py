"""Servants and proxies connected within the process, in virtual time.

Both are the real ones, over a transport without a network: arguments and results are encoded, validated and
decoded as on the wire, immediately and on the calling thread.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Collection, Mapping
from functools import partial
from queue import SimpleQueue
from typing import Any, Final

import msgspec

from zenoh_ice import (
    Communicator,
    ConnectionLostException,
    Object,
    ObjectNotExistException,
    Settings,
    SystemException,
    ZenohIceError,
)
from zenoh_ice.data.codec import Parted
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import decode_attachment, decode_error, encode_sample_attachment
from zenoh_ice.objects.streams import CHECKS
from zenoh_ice.routes.failing import FailingLink
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.limits import LIMITS
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Answer, Arrived, Caller, Inlet, Outcome, Pacer, outcome_of

from .._robot import like
from ..coroutine import Coroutine
from ._journal import Journal
from .clock import TaskClock

Polls = dict[str, Callable[[], Any]]

_STUB_RATE: Final = 10.0
"""The samples of a stub in a second of virtual time, for who subscribes without a rate."""
_CLOSE_PERIOD: Final = LIMITS.linger / CHECKS  # s of virtual time between checks for unused streams

_logger = logging.getLogger(__name__)


_SETTINGS: Final = Settings(clock="sim")


class VirtualNetwork:
    """Serve servants to the proxies of the same process, and remember the calls, or the newest `kept`.

    `on_listening` is called when a stream gets a listener.
    """

    def __init__(self, clock: TaskClock, kept: int | None = None) -> None:
        self.clock: Final = clock
        self.journal: Final = Journal(clock.now, kept)
        self.on_listening: Callable[[], object] = lambda: None
        self.polls: Final[dict[str, Polls]] = {}
        """Functions of stubs that return the newest value of a stream, by identity and operation."""
        self.offline: set[str] = set()
        """Identities of servants whose calls fail, and whose streams bring nothing, as over a cut link."""
        self.has_failed = False
        """Whether a link of it failed ever: limits of calls may pass after its end, too."""
        self.communicator: Final = _VirtualCommunicator(
            _SETTINGS,
            pool=Pool(0, "virtual"),
            transport=lambda pool: _VirtualTransport(self, pool),
            clock=clock,
        )
        self._adapter: Final = self.communicator.createObjectAdapter("virtual")
        self._adapter.activate()
        clock.call_every(_CLOSE_PERIOD, self.communicator.streams.close_unwanted)

    def serve(self, identity: str, servant: Object, polls: Polls | None = None) -> None:
        """Serve a servant, in place of any earlier one with this identity.

        `polls` returns the newest value of streams that the servant does not publish, by operation.
        """
        name = self.name(self.communicator.target(identity))
        self._adapter.removeAll([name])
        self.polls[name] = polls or {}
        self._adapter.add(servant, name)

    def impair(self, link: FailingLink | None, identities: Collection[str]) -> None:
        """Let calls and samples of some servants pass a link that fails, as `ObjectAdapter.impair` does."""
        self.has_failed = True
        self._adapter.impair(link, identities)

    def servant(self, identity: str) -> Object | None:
        """Return the servant of an identity, or None."""
        return self._adapter.find(self.name(self.communicator.target(identity)))

    def name(self, target: Target) -> str:
        """Return the identity of a servant, with its realm if that is another one."""
        return target.identity if target.realm == self.communicator.realm else str(target)


class _VirtualCommunicator(Communicator):
    """A communicator that serves other realms, too, whose errors say how to provide a missing servant."""

    def target(self, identity: str) -> Target:
        """Return what a servant serves that a document names: `Head`, or `Head@otherrealm`."""
        proxy = self.stringToProxy(identity)
        return Target(proxy.ice_getRealm(), proxy.ice_getIdentity())

    def find(
        self, target: Target, type_id: str | None, timeout: float, *, since: float | None = None
    ) -> Mapping[str, str]:
        try:
            return super().find(target, type_id, timeout, since=since)
        except ObjectNotExistException:
            served = like([target.identity], self.identities()) or "none: give robot= or stub()"
            raise ObjectNotExistException(
                f"there is no servant {target.identity}; there are {served}"
            ) from None


class _VirtualTransport(InProcessTransport):
    """The in-process transport, with a log of calls, offline servants, and stubs of streams."""

    def __init__(self, network: VirtualNetwork, pool: Pool) -> None:
        super().__init__(pool)
        self.clock = network.clock
        self._network: Final = network

    def caller(
        self,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,
    ) -> Caller:
        genuine = super().caller(target, operation, timeout=timeout, fingerprint=fingerprint)
        if operation.name.startswith("ice_"):
            return genuine
        return _LoggedCaller(self._network, genuine, target, operation)

    def take(self, answers: SimpleQueue[Answer | None], timeout: float) -> Answer | None:
        """Wait for an answer in virtual time: it comes at once but over a link that fails."""
        if answers.empty():
            self._network.clock.wait_for(lambda: not answers.empty(), timeout)
        return answers.get_nowait()

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:
        """Return a listening end of a stream, which a stub may feed."""
        genuine = super().subscribe(target, operation, queue)
        inlet = _PolledInlet(self._network, genuine, target, operation, queue)
        self._network.on_listening()
        return inlet


class _LoggedCaller:
    """Call through another caller, unless the servant is offline, and log the outcome."""

    def __init__(
        self, network: VirtualNetwork, genuine: Caller, target: Target, operation: Operation[..., Any]
    ) -> None:
        self.timeout: Final = genuine.timeout
        self._network: Final = network
        self._genuine: Final = genuine
        self._operation: Final = operation
        self._name: Final = network.name(target)
        self._what: Final = f"{self._name}.{operation.name}"

    def call(self, payload: bytes) -> Outcome:
        try:
            if self._name in self._network.offline:
                raise ConnectionLostException(f"{self._name} is offline: it was taken offline")
            outcome = self._genuine.call(payload)
        except SystemException as error:
            self._note(payload, None, error)
            raise
        ok, answer = outcome
        what, resolve = self._what, self._network.communicator.stringToProxy
        if ok:
            result = self._operation.result.unpack_result(answer, what, resolve)
            self._note(
                payload,
                result,
                None,
                sum(map(len, answer.large)) if isinstance(answer, Parted) else len(answer),
            )
        else:
            assert isinstance(answer, bytes)  # an error
            self._note(payload, None, decode_error(answer, self._operation.exceptions, what, resolve))
        return outcome

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        """Call immediately, and pass the outcome on."""
        done(outcome_of(partial(self.call, payload)))
        return lambda: None

    def _note(self, payload: bytes, result: object, error: Exception | None, size: int = 0) -> None:
        codec = self._operation.arguments
        arguments = codec.unpack(payload, self._what, self._network.communicator.stringToProxy)
        named = dict(zip(codec.fields, msgspec.structs.astuple(arguments), strict=True))
        self._network.journal.called(self._what, named, result, error, size)


class _PolledInlet:
    """The listening end of a stream; samples of a stub are made on demand."""

    def __init__(
        self,
        network: VirtualNetwork,
        genuine: Inlet,
        target: Target,
        operation: Operation[..., Any],
        queue: int,
    ) -> None:
        self._network: Final = network
        self._clock: Final = network.clock
        self._queue: Final = queue
        self._polls: Final = network.polls
        self._genuine: Final = genuine
        self._identity: Final = network.name(target)
        self._operation: Final = operation
        self._polled_at = -1.0
        self._failed = False
        self._count = 0
        self._end_deliveries: Callable[[], object] = lambda: None

    def close(self, timeout: float = 0.0) -> bool:
        self._end_deliveries()
        return self._genuine.close(timeout)

    @property
    def _stub(self) -> Callable[[], Any] | None:
        return self._polls.get(self._identity, {}).get(self._operation.name)

    @property
    def _is_offline(self) -> bool:
        return self._identity in self._network.offline

    def poll(self) -> Arrived | None:
        """Return the next sample; a stub has one for each moment, and none when it raises.

        What is sent while the servant is offline is lost.
        """
        if self._is_offline:
            self._genuine.poll()
            return None
        poll = self._stub
        if poll is None:
            sample: Arrived | None = self._genuine.poll()
            return sample
        now = self._clock.now()
        if now <= self._polled_at:
            return None
        self._polled_at = now
        try:
            value = poll()
        except (Exception, SystemExit) as error:  # a servant that fails has nothing to publish
            if not (self._failed or isinstance(error, (*self._operation.exceptions, ZenohIceError))):
                self._failed = True  # each moment would fill the log
                what = f"{self._identity}.{self._operation.name}"
                _logger.exception("%s has no sample while its stub fails", what)
            return None
        self._count += 1
        payload = self._operation.result.gather_result(value, f"sample of {self._operation.name}")
        return Arrived(bytes(payload), encode_sample_attachment("", self._count, now, wall_time=now))

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:
        """Call with each sample; a stub that is there already has `rate` a second, or some."""

        def call(sample: object) -> None:
            """Call as separate code, which may sleep."""
            Coroutine(f"callback of {self._operation.name}", partial(callback, sample)).go()

        def make() -> None:
            if self._stub is not None and (sample := self.poll()) is not None:
                call(sample)

        if self._stub is not None:
            self._end_deliveries = self._clock.call_every(1.0 / (rate or _STUB_RATE), make)
        paced = None if rate is None else _PacedCallback(self._clock, call, rate, self._queue)
        take = paced or call
        self._genuine.deliver(lambda sample: None if self._stub or self._is_offline else take(sample))

    def wait(self, changed: threading.Condition, holds: Callable[[], bool], timeout: float) -> bool:  # noqa: ARG002
        """Advance the time until a function returns true; return whether it did."""
        return self._clock.wait_for(holds, timeout)

    def open(self, sample: Arrived) -> Arrived:
        """Return the sample, whose age is in virtual time."""
        assert sample.attachment is not None  # it is stamped
        sent_at = decode_attachment(sample.attachment).wall_time
        return sample._replace(age=lambda: self._clock.now() - sent_at)


class _PacedCallback:
    """Call a function with samples, at most `rate` a second of virtual time; `queue` of them may wait."""

    def __init__(self, clock: TaskClock, callback: Callable[[Any], object], rate: float, queue: int) -> None:
        self._clock: Final = clock
        self._callback: Final = callback
        self._pacer: Final = Pacer(rate, clock)
        self._waiting: Final[deque[Any]] = deque(maxlen=queue)
        self._is_planned = False  # the next call is a task of the clock

    def __call__(self, sample: object) -> None:
        self._waiting.append(sample)
        self._plan()

    def _plan(self) -> None:
        """Call with the next sample, now or when it is due."""
        if not self._waiting or self._is_planned:
            return
        if delay := self._pacer.delay():
            self._is_planned = True
            self._clock.call_at(self._clock.now() + delay, self._call)
        else:
            self._call()

    def _call(self) -> None:
        self._is_planned = False
        self._pacer.count()
        self._callback(self._waiting.popleft())
        self._plan()
