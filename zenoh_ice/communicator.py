"""The communicator: a process's door to the servants of its realm, and to the clients of its own servants."""

from __future__ import annotations

import atexit
import itertools
import logging
import os
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import ExitStack
from functools import partial
from typing import Any, ClassVar, Final, Self

from ._presence import ClientWatch, Presence
from ._threads import Coroutines, Pool, Pulse, is_marked_thread
from ._tokens import ServantInfo
from ._values import PROXY_TEXT, Struct
from .clock import Clock, RobotClock, WallClock
from .exceptions import (
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectionLostException,
    MarshalException,
    ObjectNotExistException,
    SystemException,
    TimeoutException,
)
from .interface import Interface, Operation
from .proxy import ObjectPrx, _Call, fail, streamed
from .servant import ObjectAdapter, ServedObject
from .settings import Settings, load_settings
from .status import ProcessStatus, decode_status, encode_status
from .streams import Sample, Streams, Timing, WallTiming
from .text import printable
from .transport import NoAnswer, Served, Target, Transport, check_name

__all__ = ["Communicator", "initialize"]

_PROXY: Final = re.compile(PROXY_TEXT)
_SESSION_ID: Final = re.compile("[0-9a-f]{1,32}")
_MOST_CALLS: Final = 256  # that are kept for other proxies: each has a querier
_DESTROY_LIMIT: Final = 2.0  # s for which threads may go on with what they do
_STATUS_LIMIT: Final = 0.5  # s for which a process that seems to be there is asked how its servants are
_ON_ITS_WAY: Final = 0.05  # s in which word of a subscription comes to the servant
_MOST_RIVALS: Final = 16  # processes that serve what we do, reported in as many seconds
_MOST_NAMED: Final = 8  # servants in a message

_logger = logging.getLogger(__name__)

_started_zenoh = False
"""Whether this process opened a session: Zenoh's threads, which a fork has not, outlive it."""

_forked = False
"""Whether this process was forked from one that had: its copy of Zenoh does not run."""


def initialize(settings: Settings | None = None, **overrides: object) -> Communicator:
    """Return a communicator; use it in a `with` block, or call `destroy` at the end.

    Without `settings` they come from the environment; `overrides` are fields of Settings that win over both:
    `initialize(realm="nao", connect=["tcp/127.0.0.1:7447"])`. It does not wait for a server.

    Raises EndpointInUseException when another process listens already, ConfigurationException for a setting
    that is not valid, and CommunicatorDestroyedException in a process that was forked from one with a
    communicator: start it with the method `spawn`.
    """
    if _forked:
        raise CommunicatorDestroyedException(
            "this process was forked from one that had a communicator, and Zenoh does not work in a fork: "
            'start it by multiprocessing.get_context("spawn"), or fork before the first communicator'
        )
    if settings is None:
        settings = load_settings()
    return Communicator(settings.override(**overrides) if overrides else settings)


class Communicator:
    """The root of everything that talks: proxies, adapters, streams and the clock come from here.

    It may be used from any thread. User code, servants and callbacks alike, runs on its own threads.
    """

    def __init__(
        self,
        settings: Settings,
        *,
        pool: Pool | None = None,
        transport: Callable[[Pool], Transport] | None = None,
        clock: Clock | None = None,
        timing: Timing | None = None,
    ) -> None:
        """Join a realm: over Zenoh unless another transport is given, which is made for a pool of threads.

        `clock` is the component's where the settings do not choose it, `timing` that of the streams.
        """
        self.settings: Final = settings
        self.realm: Final = settings.realm
        self.destroyed = False
        self.served: Final[dict[Target, ServedObject]] = {}
        """What this process serves."""
        self.call_numbers: Final = itertools.count(1)
        self._lock: Final = threading.RLock()
        self._adapters: list[ObjectAdapter] = []
        self._calls: Final[dict[tuple[object, ...], _Call]] = {}
        self._futures: Final[set[Future[Any]]] = set()
        self._rivals: set[str] = set()  # sessions that were reported
        self._reports: Final[deque[float]] = deque(maxlen=_MOST_RIVALS)  # when
        self._clock = clock
        self._clock_lock: Final = threading.Lock()
        self._shutdown: Final = threading.Event()
        self._destroyed: Final = threading.Event()
        self._serves = False
        self._status: Served | None = None
        self._since = 0.0
        self.pulse: Final = Pulse()
        with ExitStack() as on_failure:
            name = f"zenoh_ice {settings.realm}"
            self.pool: Final = pool or Pool(settings.dispatch_threads, name)
            on_failure.callback(self.pool.close, _DESTROY_LIMIT)
            self.transport: Final = (transport or partial(_zenoh_transport, settings))(self.pool)
            on_failure.callback(self.transport.close)
            self.client_id: Final = self.transport.id
            self.presence: Final = Presence(self.transport, self.pool.submit)
            on_failure.callback(self.presence.close)
            self.presence.watch(self.realm)
            self.coroutines: Final = Coroutines(f"{name} coroutines")
            self.streams: Final = Streams(
                self.transport,
                self.presence,
                resolve=self.stringToProxy,
                is_heard=self._is_heard,
                timing=timing or WallTiming(),
            )
            on_failure.pop_all()
        _live.add(self)

    # Proxies.

    def stringToProxy(self, text: str) -> ObjectPrx:
        """Return the proxy of a text: `Head`, or of another realm `Head@otherrealm`.

        `-o` before the realm makes its calls oneway. Raises ConfigurationException when the text is no proxy.
        """
        match = _PROXY.match(" ".join(text.split()).replace(" @ ", "@"))
        if match is None:
            hint = "; endpoints are settings, such as --connect" if ":" in text else ""
            raise ConfigurationException(
                f"{text!r} is no proxy: write NAME[ -t|-o][@REALM], each of letters, digits, '_', '-' and "
                f"'.' alone{hint}"
            )
        identity, mode, realm = match.groups()
        target = Target(realm or self.realm, identity)
        return ObjectPrx(self, target, self.settings.timeout, oneway=mode == "o")

    def find(
        self, target: Target, type_id: str | None, timeout: float, *, since: float | None = None
    ) -> Mapping[str, str]:
        """Wait until a servant is there; return the fingerprints of its interfaces by type id.

        The interface asked for is missing from them if the servant does not have it. `since` is the moment of
        the monotonic clock when it was asked for, now by default.
        """
        self.check()
        local = self.served.get(target)
        if local is not None:
            return local.fingerprints
        self.presence.wait_for(target, type_id, timeout, since=since)
        found = self.presence.interfaces(target)
        if not found:
            raise self.presence.explain_absence(target)
        return found

    def knows(self, target: Target) -> bool:
        """Return whether `find` would return at once."""
        return target in self.served or bool(self.presence.interfaces(target))

    def call_of(self, proxy: ObjectPrx, operation: Operation[..., Any], timeout: float) -> _Call:
        """Return what calls an operation of a proxy's servant; proxies share it."""
        self.check()
        key = proxy._target, operation, proxy.ice_interface, timeout, proxy._oneway
        with self._lock:
            call = self._calls.get(key)
            if call is None:
                if len(self._calls) >= _MOST_CALLS:  # proxies keep those that they use
                    del self._calls[next(iter(self._calls))]
                call = self._calls[key] = _Call(proxy, operation, timeout)
        return call

    def new_future(self) -> Future[Any]:
        """Return a future that has an outcome at the latest when the communicator is destroyed."""
        self.check()
        future: Future[Any] = Future()
        self._futures.add(future)
        future.add_done_callback(self._forget_future)
        return future

    def explain_no_answer(
        self, target: Target, what: str, started: float, timeout: float, end: NoAnswer
    ) -> SystemException:
        """Return the exception of a call that ended without an answer."""
        if self.destroyed:
            return CommunicatorDestroyedException(f"{what}: the communicator was destroyed during the call")
        limit = min(_STATUS_LIMIT, max(0.0, started + timeout - time.monotonic()))
        return self.presence.explain_no_answer(
            target,
            what,
            started,
            timeout=timeout if end.timed_out else None,
            is_served=lambda: self._asks(target, limit) is not None,
        )

    # Servants.

    def createObjectAdapter(self, name: str) -> ObjectAdapter:
        """Return an adapter, which makes servants reachable; the name is for people."""
        with self._lock:
            self.check()
            if not self._serves:
                self._serves = True
                if self.pool.has_threads:  # otherwise no call waits
                    self.pulse.start()
                self.presence.add_listener(self._report_rivals)
            adapter = ObjectAdapter(self, name)
            self._adapters.append(adapter)
        return adapter

    def identities(self, realm: str | None = None) -> list[str]:
        """Return the identities served in a realm as far as known by now, sorted."""
        return self.presence.identities(self._watched(realm))

    def servants(self, realm: str | None = None) -> list[ServantInfo]:
        """Return the servants of a realm as far as known by now, sorted by identity."""
        return self.presence.servants(self._watched(realm))

    def processStatus(
        self, process: str, *, realm: str | None = None, timeout: float | None = None
    ) -> ProcessStatus:
        """Return the status of a process that serves, by the id of its session: `ServantInfo.server`.

        Raises ConnectionLostException when it is not there, does not answer within `timeout` s, by default
        the limit of calls, or access control denies it.
        """
        self.check()
        if not _SESSION_ID.fullmatch(process):
            raise ConfigurationException(f"{process!r} is no id of a session: those are ServantInfo.server")
        limit = self.settings.timeout if timeout is None else timeout
        if not limit > 0:
            raise ConfigurationException(f"a limit is above 0 s, not {limit!r}")
        realm = self.realm if realm is None else check_name(realm, "realm")
        return decode_status(self.transport.ask_status(realm, process, limit), process)

    def onClientLost(self, callback: Callable[[str], Any]) -> ClientWatch:
        """Call a function with the id of every client of the realm that ends or is lost, until closed.

        One that dies is reported at once, one that hangs after the lease. The id is that of
        `Current.client`. The function runs on a thread of the communicator; its exceptions are logged.
        """
        self.check()
        return ClientWatch(self.transport, self.realm, callback, self.pool.submit)

    def serve_status(self) -> None:
        """Answer those who ask for the status of this process, from now on."""
        with self._lock:
            if self._status is None:
                self._since = time.time()
                self._status = self.transport.serve_status(self.realm, self._encode_status)

    # Time.

    @property
    def clock(self) -> Clock:
        """The component's clock, chosen by the setting `clock`; choosing may wait for the robot's server."""
        with self._clock_lock:  # not the other one: choosing calls the robot's server
            self.check()
            if self._clock is None:
                self._clock = _choose_clock(self)
            return self._clock

    # Life.

    def check(self) -> None:
        """Raise CommunicatorDestroyedException after the end."""
        if self.destroyed:
            raise CommunicatorDestroyedException("the communicator was destroyed, or inherited by a fork")

    def shutdown(self) -> None:
        """Withdraw all servants and let `waitForShutdown` return; proxies go on working."""
        self._shutdown.set()
        with self._lock:
            adapters = list(self._adapters)
        for adapter in adapters:
            adapter.deactivate()

    def waitForShutdown(self, timeout: float | None = None) -> bool:
        """Wait until `shutdown` or `destroy` is called, at most `timeout` s; return whether one was."""
        return self._shutdown.wait(timeout)

    def destroy(self) -> None:
        """End everything: servants, streams, calls that wait, threads, the session.

        Any thread may call it, a servant's included, and more than once. Those who wait for a call or a
        sample get CommunicatorDestroyedException; those who wait for room on a link that takes nothing, after
        the limit of calls. What runs may go on for some seconds.
        """
        with self._lock:
            first, self.destroyed = not self.destroyed, True
            adapters, self._adapters = self._adapters, []
        if not first:
            if not is_marked_thread():  # such a thread may be what the first caller waits for
                self._destroyed.wait(3 * _DESTROY_LIMIT)
            return
        self._shutdown.set()
        # Run from the last to the first, each whatever the others raise.
        with ExitStack() as steps:
            steps.callback(_live.discard, self)
            steps.callback(self._destroyed.set)
            steps.callback(self.pool.close, _DESTROY_LIMIT)
            steps.callback(self.pulse.close)
            steps.callback(self._fail_futures)
            steps.callback(self.transport.close)
            if self._status is not None:
                steps.callback(self._status.close)
            steps.callback(self.coroutines.close, _DESTROY_LIMIT)
            steps.callback(self._close_clock)
            steps.callback(self.streams.close)
            for adapter in adapters:
                steps.callback(adapter.destroy)
            steps.callback(self.presence.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.destroy()

    def __repr__(self) -> str:
        return f"<communicator {self.client_id} of realm {self.realm}>"

    def _watched(self, realm: str | None) -> str:
        self.check()
        watched = self.realm if realm is None else check_name(realm, "realm")
        self.presence.watch(watched)
        return watched

    def _abandon(self) -> None:
        """Refuse all further use: in a forked child the session is broken and must not be touched."""
        self.destroyed = True
        self._shutdown.set()
        self._destroyed.set()

    def _forget_future(self, future: Future[Any]) -> None:
        self._futures.discard(future)
        if future.cancelled():
            future.set_running_or_notify_cancel()  # lets `wait` and `as_completed` know, as an executor does

    def _fail_futures(self) -> None:
        for future in tuple(self._futures):
            fail(future, CommunicatorDestroyedException("the communicator was destroyed during the call"))

    def _close_clock(self) -> None:
        if self._clock_lock.acquire(timeout=_DESTROY_LIMIT):
            try:
                if isinstance(self._clock, RobotClock):
                    self._clock.close()
            finally:
                self._clock_lock.release()

    def _encode_status(self) -> bytes:
        return encode_status(
            self._since,
            shared_memory=bool(getattr(self.transport, "shares_memory", False)),
            servants={str(target): served.status() for target, served in list(self.served.items())},
        )

    def _asks(self, target: Target, limit: float) -> ProcessStatus | None:
        """Return the status of a process that serves a target; None if none of them answers."""
        servers = self.presence.servers(target)[:3]
        for server in servers if limit > 0 else ():
            try:
                status = self.processStatus(server.server, realm=target.realm, timeout=limit / len(servers))
            except SystemException:
                continue
            if str(target) in status.servants:
                return status
        return None

    def _is_heard(self, target: Target, stream: str) -> bool:
        """Return whether a servant knows of a listener to a stream, or that cannot be known."""
        for look in range(2):
            if look:
                time.sleep(_ON_ITS_WAY)
            status = self._asks(target, _STATUS_LIMIT)
            if status is None or stream in status.servants[str(target)].listened:
                return True
        return False

    def _report_rivals(self) -> None:
        """Log an error for each process that serves what we do, started before either knew of the other."""
        own = {target.identity for target in list(self.served)}
        servants = self.presence.servants(self.realm)
        found = {info.server for info in servants if info.identity in own} - {self.client_id}
        now, new = time.monotonic(), []
        with self._lock:
            ended = self._rivals - found
            self._rivals &= found
            for server in found - self._rivals:
                # A realm may be flooded with tokens: some are reported at a later change, if still there.
                if len(self._reports) < _MOST_RIVALS or now - self._reports[0] >= _MOST_RIVALS:
                    self._reports.append(now)
                    self._rivals.add(server)
                    new.append(server)
        for server in ended:
            _logger.warning("what this process serves is no longer served by session %s, too", server)
        for server in new:
            self.pool.submit(partial(self._report_rival, server))  # it may take a while

    def _report_rival(self, server: str) -> None:
        try:
            status = self.processStatus(server, timeout=_STATUS_LIMIT)
        except SystemException:
            who = "another process"
            servants = self.presence.servants(self.realm)
            theirs = {info.identity for info in servants if info.server == server}
        else:
            who = f"{printable(status.program)} (process {status.pid} on {printable(status.host)})"
            theirs = {name.partition("@")[0] for name in status.servants}
        names = sorted(theirs & {target.identity for target in list(self.served)})
        more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
        _logger.error(
            "%s%s %s served in realm %s by %s, session %s, too: each call reaches one of both, and their "
            "streams mix; stop one, or give it another --realm",
            ", ".join(names[:_MOST_NAMED]),
            more,
            "is" if len(names) == 1 else "are",
            self.realm,
            who,
            server,
        )


_live: Final[set[Communicator]] = set()


# The robot's clock, as far as this package needs interfaces/clock.idl: it may not import what is generated
# from it. Without a fingerprint it reads every version that has these members.


class _ClockReading(Struct):
    time: float
    rate: float
    simulated: bool


class _Arguments(Struct):
    pass


class _Result(Struct):
    returnValue: _ClockReading


_GET_TIME: Final[Operation[[], _ClockReading]] = Operation(
    "getTime", arguments=_Arguments, result=_Result, idempotent=True, streamed=True
)


class _ClockPrx(ObjectPrx):
    ice_interface: ClassVar[Interface] = Interface("::nao::Clock", operations=(_GET_TIME,))

    @streamed(_GET_TIME)
    def getTime(self) -> _ClockReading:
        return self.ice_invoke(_GET_TIME)


def _choose_clock(communicator: Communicator) -> Clock:
    """Return the clock that the settings ask for.

    `sim` follows the robot's clock, `wall` is steady wall time, and `auto` follows the robot's clock if there
    is one and its time is simulated. Raises, for `sim` alone, what a call of the servant `Clock` raises, and
    MarshalException when it shows what no clock can.
    """
    choice = communicator.settings.clock
    if choice == "wall":
        return WallClock()
    try:
        proxy = _ClockPrx.uncheckedCast(communicator.stringToProxy("Clock"))
        first = proxy.getTime()
        clock = RobotClock(first.time, first.rate, first.simulated)
    except (ObjectNotExistException, ConnectionLostException, TimeoutException, MarshalException) as error:
        if choice == "sim":
            raise
        _logger.info("going by the wall's clock: %s", error)
        return WallClock()
    if choice == "auto" and not clock.simulated:
        return WallClock()

    def update(sample: Sample[_ClockReading]) -> None:
        clock.update(sample.value.time, sample.value.rate, sample.value.simulated)

    clock.follow(Served(proxy.getTime.subscribe(update).close))
    return clock


def _zenoh_transport(settings: Settings, pool: Pool) -> Transport:
    from ._zenoh.transport import ZenohTransport  # here: tests within one process need no Zenoh

    global _started_zenoh  # noqa: PLW0603 - it is of the whole process
    _started_zenoh = True
    return ZenohTransport(settings, pool)


def _destroy_all() -> None:
    # Without this, a session with handlers in Python would keep the interpreter from ending.
    for communicator in tuple(_live):
        _logger.debug("%r was not destroyed before the end of the program", communicator)
        communicator.destroy()


def _abandon_all() -> None:
    global _forked  # noqa: PLW0603 - it is of the whole process
    _forked = _forked or _started_zenoh
    for communicator in tuple(_live):
        communicator._abandon()
    _live.clear()


atexit.register(_destroy_all)
os.register_at_fork(after_in_child=_abandon_all)
