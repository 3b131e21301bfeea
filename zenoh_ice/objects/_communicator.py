"""The communicator: the connection of a process to the servants and clients of its realm."""

from __future__ import annotations

import atexit
import logging
import os
import re
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import ExitStack, suppress
from functools import partial
from typing import Any, Final, Self

import msgspec
from msgspec.structs import astuple

from zenoh_ice.data.exceptions import (
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectionLostException,
    MarshalException,
    ObjectNotExistException,
    SystemException,
    TimeoutException,
)
from zenoh_ice.data.keys import Target, check_name
from zenoh_ice.data.status import ProcessStatus, ServantStatus, decode_status, encode_status
from zenoh_ice.data.text import few, printable
from zenoh_ice.data.values import PROXY_TEXT
from zenoh_ice.objects._adapter import ObjectAdapter
from zenoh_ice.objects._presence import ClientWatch, Presence, ServantInfo
from zenoh_ice.objects._servant import ServedObject
from zenoh_ice.objects.callbacks import CallFuture
from zenoh_ice.objects.proxy import ObjectPrx, fail, stream
from zenoh_ice.objects.streams import Streams
from zenoh_ice.routes._given_up import GivenUpCalls
from zenoh_ice.settings import Settings, load_settings
from zenoh_ice.threads._starting import UserCodeThread
from zenoh_ice.threads.clock import WALL, Clock, RobotClock
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Relay, Transport

_PROXY: Final = re.compile(PROXY_TEXT)
_DESTROY_LIMIT: Final = 2.0  # s for which threads may still run
_ON_ITS_WAY: Final = 0.05  # s in which news of a subscription reaches the servant
_MOST_RIVALS: Final = 16  # processes that serve what we do, reported in as many seconds
_CHECK_PERIOD: Final = 0.05  # s between two checks of a wait for the end

_logger = logging.getLogger(__name__)

_live: Final[set[Communicator]] = set()
_zenoh_processes: Final[set[int]] = set()
"""Processes that opened a session, this one or one that it was forked from: Zenoh does not run in a fork."""
_DEFAULTS: Final = Settings()


def initialize(
    settings: Settings | None = None, *, limits: Limits = LIMITS, **overrides: object
) -> Communicator:
    """Return a communicator; use it in a `with` block, or call `destroy` at the end.

    Without `settings` they come from the environment; `overrides` are fields of Settings that override both:
    `initialize(realm="nao", connect=["tcp/127.0.0.1:7447"])`. It does not wait for a server.
    `limits` are waits and sizes that are no settings, for tests.

    Raises EndpointInUseException when another process listens already, ConfigurationException for a setting
    that is not valid, and CommunicatorDestroyedException in a process that was forked from one with a
    communicator: start it with the method `spawn`.
    """
    if _zenoh_processes - {os.getpid()}:
        raise CommunicatorDestroyedException(
            "this process was forked from one that had a communicator, and Zenoh does not work in a fork: "
            'start it by multiprocessing.get_context("spawn"), or fork before the first communicator'
        )
    return Communicator((settings or load_settings()).override(**overrides), limits=limits)


class Communicator:
    """The entry point of all communication: it makes proxies and adapters, and has the streams and the clock.

    It is thread-safe. User code, that is servants and callbacks, runs on the communicator's threads.
    """

    def __init__(
        self,
        settings: Settings,
        *,
        pool: Pool | None = None,
        transport: Callable[[Pool], Transport] | None = None,
        clock: Clock | None = None,
        limits: Limits = LIMITS,
    ) -> None:
        """Join a realm: over Zenoh, unless a function that makes another transport for a pool is given.

        `clock` is the component's clock, instead of the one in the settings. With a pool of no threads,
        unused streams are closed by `streams.close_unwanted`.
        """
        self.settings = settings
        self.realm = settings.realm
        self.limits = limits
        self.destroyed = False
        self.sends_only_stops = False
        """While set, proxies call nothing else: who commanded has ended, perhaps not all of its threads."""
        self.served: Final[dict[Target, ServedObject]] = {}
        """Servants of this process."""
        self.client_watches: tuple[ClientWatch, ...] = ()
        """The watches for lost clients."""
        self.given_up = GivenUpCalls()
        """Calls of servants of this process that must not begin any more."""
        self._lock: Final = threading.RLock()
        self._active: Final[dict[ObjectAdapter, None]] = {}  # adapters, in the order of their activation
        self._serves_status = False
        self._futures: Final[set[Future[Any]]] = set()
        self._rivals: set[str] = set()  # sessions that were reported
        self._reports: list[float] = []  # when
        self._clock = clock
        self._clock_lock: Final = threading.Lock()
        self._shutdown: Final = threading.Event()
        self._destroyed: Final = threading.Event()
        with ExitStack() as end:  # runs all, the last first, whatever they raise
            end.callback(_live.discard, self)
            end.callback(self._destroyed.set)
            self.pool = pool or Pool(settings.dispatch_threads, f"zenoh_ice {self.realm}", limits)
            self.pool.on_stall = self._on_stall
            end.callback(self.pool.close, _DESTROY_LIMIT)
            end.callback(self._fail_futures)
            if transport is None:
                from zenoh_ice.routes._transport import (
                    RoutedTransport,  # here: tests within one process need no Zenoh
                )

                _zenoh_processes.add(os.getpid())
                transport = partial(RoutedTransport, settings, limits=limits)
            self.transport = transport(self.pool)
            end.callback(self.transport.close)
            end.callback(self._close_watches)
            self.client_id = self.transport.id
            # A listener without endpoints to connect to gets its links when others connect, and they may
            # leave.
            named = "connect" in settings.origins or settings.connect != _DEFAULTS.connect
            self.presence = Presence(
                self.transport,
                self.pool.submit,
                is_served=lambda target, left: self._ask(target, min(self.limits.status, left)) is not None,
                needs_links=named or not settings.listen,
                limits=limits,
            )
            self.presence.watch(self.realm)
            self.streams = Streams(
                self.transport,
                self.presence,
                resolve=self.stringToProxy,
                sees_listener=self._sees_listener,
                pool=self.pool,
                limits=limits,
            )
            end.callback(self.streams.close)
            end.callback(self._deactivate_all)
            self._end: Final = end.pop_all()
        _live.add(self)

    # Proxies.

    def stringToProxy(self, text: str) -> ObjectPrx:
        """Return the proxy that a text names: `Head`, or in another realm `Head@otherrealm`.

        Raises ConfigurationException when the text is no proxy.
        """
        match = _PROXY.match(" ".join(text.split()).replace(" @ ", "@"))
        if match is None:
            raise ConfigurationException(
                f"{text!r} is not a proxy: write NAME[@REALM], each of letters, digits, '_', '-' and "
                "'.' alone; endpoints are settings, such as --connect"
            )
        identity, realm = match.groups()
        target = Target(realm or self.realm, identity)
        return ObjectPrx(self, target, self.settings.timeout)

    def target(self, identity: str) -> Target:
        """Return what a servant with an identity serves. Raises ConfigurationException."""
        return Target(self.realm, check_name(identity, "identity"))

    def find(
        self, target: Target, type_id: str | None, timeout: float, *, since: float | None = None
    ) -> Mapping[str, str]:
        """Wait until a servant is present; return the fingerprints of its interfaces by type id.

        The requested interface is missing from them if the servant does not have it. `since` is the moment of
        the monotonic clock when it was requested, now by default.
        """
        self.check()
        if (local := self.served.get(target)) is not None:
            return local.fingerprints
        if (relay := self.transport.relay) is not None:
            return {} if type_id is None else relay.find(target, type_id, timeout)
        self.presence.wait_for(target, type_id, timeout, since=since)
        if not (found := self.presence.interfaces(target)):
            raise self.presence.explain_absence(target)
        return found

    def knows(self, target: Target) -> bool:
        """Return whether `find` would return at once."""
        if self.destroyed:
            return False
        return self.transport.relay is not None or target in self.served or target in self.presence.present

    def new_future(self) -> Future[Any]:
        """Return a future that has an outcome at the latest when the communicator is destroyed."""
        self.check()
        relay = self.transport.relay
        future = CallFuture() if relay is None else _ObservedFuture(relay)
        self._futures.add(future)
        Future.add_done_callback(future, self._forget_future)  # is none of a user's
        return future

    # Servants.

    def createObjectAdapter(self, name: str) -> ObjectAdapter:
        """Return an adapter, which makes servants reachable; the name is for logs and errors."""
        with self._lock:
            self.check()
            if not self._serves_status:
                self.transport.serve_status(self.realm, partial(self._encode_status, time.time()))
                self.presence.add_listener(self._report_rivals)
                self._serves_status = True
        return ObjectAdapter(self, name, self.served, self._keep)

    def _keep(self, adapter: ObjectAdapter, active: bool) -> None:
        """Remember an adapter while it is active: the end deactivates it."""
        with self._lock:
            if active:
                self._active[adapter] = None
            else:
                self._active.pop(adapter, None)

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

        Raises ConnectionLostException when it is absent, does not answer within `timeout` s, by default
        the limit of calls, or access control denies it.
        """
        check_name(process, "id of a session")
        limit = self.settings.timeout if timeout is None else timeout
        if not limit > 0:
            raise ConfigurationException(f"a limit is above 0 s, not {limit!r}")
        return decode_status(self.transport.ask_status(self._watched(realm), process, limit), process)

    def onClientLost(self, callback: Callable[[str], Any]) -> ClientWatch:
        """Call a function with the id of every client of the realm that ends or is lost, until closed.

        A client that dies is reported at once, one that hangs after the lease, and one that dies right after
        its first call within 2.5 s. The id is that of `Current.client`. The function runs on a thread of the
        communicator; its exceptions are logged.
        """
        self.check()
        watch = ClientWatch(
            self.transport, self.realm, callback, self.pool.submit, self._forget_watch, limits=self.limits
        )
        with self._lock:
            self._set_watches((*self.client_watches, watch))
        return watch

    @property
    def clock(self) -> Clock:
        """The component's clock, chosen by the setting `clock`; choosing may wait for the robot's server."""
        with self._clock_lock:  # not the other lock: choosing calls the robot's server
            self.check()
            self._clock = self._clock or _choose_clock(self)
            return self._clock

    # Life.

    def check(self) -> None:
        """Raise CommunicatorDestroyedException after the end."""
        if self.destroyed:
            raise CommunicatorDestroyedException("the communicator was destroyed, or inherited by a fork")

    def shutdown(self) -> None:
        """Withdraw all servants and let `waitForShutdown` return; proxies still work."""
        self._shutdown.set()
        self._deactivate_all()

    def waitForShutdown(self, timeout: float | None = None) -> bool:
        """Wait until `shutdown` or `destroy` is called, at most `timeout` s; return whether one was."""
        end = time.monotonic() + (threading.TIMEOUT_MAX if timeout is None else timeout)
        # Not `Event.wait`: Ctrl-C may leave its lock taken, and is not noticed if it comes right before.
        while (left := end - time.monotonic()) > 0 and not self._shutdown.is_set():
            time.sleep(min(left, _CHECK_PERIOD))
        return self._shutdown.is_set()

    def destroy(self) -> None:
        """End everything: servants, streams, waiting calls, threads, the session.

        Any thread may call it, a servant's included, and more than once. Threads that wait for a call or a
        sample get CommunicatorDestroyedException; threads that wait for room on a blocked link get it after
        the limit of calls. Running calls may continue for some seconds.
        """
        with self._lock:
            first, self.destroyed = not self.destroyed, True
        if not first:
            if not isinstance(threading.current_thread(), UserCodeThread):  # the first may wait for it
                self._destroyed.wait(3 * _DESTROY_LIMIT)
            return
        self._shutdown.set()
        with self._end:
            self.presence.close()  # before waits for servants, or for their end

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.destroy()

    def _deactivate_all(self) -> None:
        with self._lock:
            adapters = tuple(self._active)
        with ExitStack() as steps:  # all, the last first, whatever they raise
            for adapter in adapters:
                steps.callback(adapter.deactivate)

    def _watched(self, realm: str | None) -> str:
        self.check()
        watched = self.realm if realm is None else check_name(realm, "realm")
        self.presence.watch(watched)
        return watched

    def _forget_watch(self, watch: ClientWatch) -> None:
        with self._lock:
            self._set_watches(tuple(each for each in self.client_watches if each is not watch))

    def _set_watches(self, watches: tuple[ClientWatch, ...]) -> None:  # with the lock
        self.client_watches = watches
        self.pool.checks = tuple(each.check for each in watches)

    def _close_watches(self) -> None:
        for watch in self.client_watches:
            watch.close()

    def _forget_future(self, future: Future[Any]) -> None:
        self._futures.discard(future)
        if future.cancelled():
            future.set_running_or_notify_cancel()  # lets `wait` and `as_completed` know, as an executor does

    def _fail_futures(self) -> None:
        for future in tuple(self._futures):
            fail(future, CommunicatorDestroyedException("the communicator was destroyed during the call"))

    def _on_stall(self) -> None:
        """Hide the servants while no call is executed: a call then fails at once, instead of at its limit."""
        stalled, served = self.pool.stalled, tuple(self.served.values())
        if stalled and served:
            _logger.error(
                "realm %s: no thread takes calls any more; withdrawing %d servants until one does",
                self.realm,
                len(served),
            )
        elif served:
            _logger.warning("realm %s: calls are executed again, by %d servants", self.realm, len(served))
        for each in served:
            if stalled:
                each.hide()
            else:
                each.announce()

    def _encode_status(self, since: float) -> bytes:
        return encode_status(
            since,
            local_sockets=bool(self.transport.local_address),
            servants={str(target): served.status() for target, served in self.served.copy().items()},
        )

    def _ask(self, target: Target, limit: float) -> ServantStatus | None:
        """Return the status of a servant; None if no process that serves it answers within `limit` s."""
        servers = self.presence.servers(target)[:3]
        for server in servers if limit > 0 else ():
            with suppress(SystemException):
                status = self.processStatus(server.server, realm=target.realm, timeout=limit / len(servers))
                if servant := status.servants.get(str(target)):
                    return servant
        return None

    def _sees_listener(self, target: Target, stream: str, end: float) -> bool:
        """Return whether a servant sees a listener to a stream, or cannot report it before `end`.

        That is a moment of the monotonic clock.
        """
        for delay in (0.0, _ON_ITS_WAY):
            if end - time.monotonic() <= delay:
                return True
            time.sleep(delay)
            status = self._ask(target, min(self.limits.status, end - time.monotonic()))
            if status is None or stream in status.listened:
                return True
        return False

    def _find_rivals(self) -> dict[str, list[str]]:
        """Return our identities that others serve, too, by the ids of their sessions."""
        found: dict[str, list[str]] = {}
        for server, target in sorted(self.presence.others(self.client_id)):
            if target in self.served:
                found.setdefault(server, []).append(target.identity)
        return found

    def _report_rivals(self) -> None:
        """Log an error for each process that serves what we do, started before either knew of the other."""
        now, found = time.monotonic(), self._find_rivals().keys()
        with self._lock:
            ended = self._rivals - found
            self._reports = [moment for moment in self._reports if now - moment < _MOST_RIVALS]
            # A realm may be flooded with tokens: some are reported at a later change, if still there.
            new = sorted(found - self._rivals)[: _MOST_RIVALS - len(self._reports)]
            self._reports += [now] * len(new)
            self._rivals = (self._rivals & found) | set(new)
        for server in ended:
            _logger.warning("session %s no longer serves the same identities as this process", server)
        for server in new:
            self.pool.submit(partial(self._report_rival, server))  # it may take a while

    def _report_rival(self, server: str) -> None:
        who = "another process"
        with suppress(SystemException):
            status = self.processStatus(server, timeout=self.limits.status)
            who = f"{printable(status.program)} (process {status.pid} on {printable(status.host)})"
        _logger.error(
            "realm %s has two servers of %s: this process, and %s, session %s; each call reaches one of "
            "both, and their streams mix: stop one, or give it another --realm",
            self.realm,
            few(self._find_rivals().get(server, []), 8),
            who,
            server,
        )


class _ObservedFuture(CallFuture):
    """A future whose relay decides when it is done."""

    def __init__(self, relay: Relay) -> None:
        super().__init__()
        self._relay: Final = relay

    def result(self, timeout: float | None = None) -> Any:  # noqa: ANN401
        if not self.done():
            self._relay.wait(self, timeout)
        return super().result(0.0)

    def exception(self, timeout: float | None = None) -> BaseException | None:
        if not self.done():
            self._relay.wait(self, timeout)
        return super().exception(0.0)


class _ClockReading(msgspec.Struct):
    time: float
    rate: float
    simulated: bool


class _ClockPrx(ObjectPrx):
    """The part of the robot's clock in interfaces/clock.idl that this package needs.

    The package must not import generated code. Without a fingerprint, the proxy reads every version that has
    these members.
    """

    @stream(idempotent=True)
    def getTime(self) -> _ClockReading:
        raise NotImplementedError  # the method only declares the operation


def _choose_clock(communicator: Communicator) -> Clock:
    """Return the clock that the settings select.

    `sim` follows the robot's clock, `wall` is steady wall time, and `auto` follows the robot's clock if there
    is one and its time is simulated. Raises, for `sim` alone, what a call of the servant `Clock` raises, and
    MarshalException for an impossible time.
    """
    choice = communicator.settings.clock
    if choice == "wall":
        return WALL
    proxy = _ClockPrx.uncheckedCast(communicator.stringToProxy("Clock"))
    try:
        clock = RobotClock(*astuple(proxy.getTime()))
        if choice == "sim" or clock.simulated:
            communicator._end.callback(clock.close)  # first: streams that were closed refuse to subscribe
            proxy.getTime.subscribe(lambda sample: clock.update(*astuple(sample.value)))
            return clock
    except (ObjectNotExistException, ConnectionLostException, TimeoutException, MarshalException) as error:
        if choice == "sim":
            raise
        _logger.info("using the wall clock: %s", error)
    return WALL


@atexit.register
def _destroy_all() -> None:
    # Without this, a session with handlers in Python would keep the interpreter from ending.
    for communicator in tuple(_live):
        communicator.destroy()


def _abandon_all() -> None:
    """Refuse all further use in a forked child: its sessions are broken and must not be touched."""
    for communicator in tuple(_live):
        communicator.destroyed = True
        communicator._shutdown.set()
        communicator._destroyed.set()
    _live.clear()


os.register_at_fork(after_in_child=_abandon_all)
