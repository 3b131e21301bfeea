"""The communicator: a process's door to the servants of its realm, and to its own servants' clients."""

from __future__ import annotations

import atexit
import logging
import os
import re
import threading
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final, Self

from .adapter import ObjectAdapter
from .calls.implicit_context import ImplicitContext
from .calls.manner import Mode
from .calls.outgoing_calls import OutgoingCalls
from .clocks.clock import Clock
from .communicator_services import CommunicatorServices
from .dispatch import Dispatcher, is_marked_thread
from .exceptions import ConfigurationException
from .identity import PROXY_TEXT, Identity, Target, check_realm, identityToString, stringToIdentity
from .network.client_tokens import client_token
from .network.clients import Clients, ClientWatch
from .network.neighbors import Neighbors
from .network.presence import Presence
from .network.process_status import ProcessStatus, ProcessStatusServer, ask_process_status
from .network.pulse import Pulse
from .network.servant_table import ServantInfo
from .network.session import close_session, connect_endpoints, open_session
from .proxy import ObjectPrx
from .serving.coroutines import Coroutines
from .serving.local_servants import LocalServants
from .serving.rivals import Rivals
from .settings import Settings, load_settings
from .shutdown import Shutdown
from .streams.stream_readers import StreamReaders
from .streams.subscription import Subscription
from .wire.shared_memory import SharedMemory

__all__ = ["Communicator", "initialize"]

_PROXY: Final = re.compile(PROXY_TEXT)
_SESSION_ID: Final = re.compile("[0-9a-f]{1,32}")
_DESTROY_LIMIT: Final = 2.0  # s for which threads may go on with what they do

_logger = logging.getLogger(__name__)


def initialize(settings: Settings | None = None, **overrides: object) -> Communicator:
    """Return a communicator; use it in a `with` block, or call `destroy` at the end.

    Without `settings` they come from the environment; `overrides` are fields of Settings that win over both:
    `initialize(realm="nao", connect=["tcp/127.0.0.1:7447"])`. It does not wait for a server.

    Raises EndpointInUseException when another process listens already, ConfigurationException for a setting
    that is not valid.
    """
    if settings is None:
        settings = load_settings()
    return Communicator(settings.override(**overrides) if overrides else settings)


class Communicator(CommunicatorServices):
    """The root of everything that talks: proxies, adapters, streams and the clock come from here.

    It may be used from any thread. User code, servants and callbacks alike, runs on its own threads.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.realm: Final = settings.realm
        self.destroyed = False
        self.local_servants = LocalServants()
        self.crowded_at: Final[dict[Target, float]] = {}
        """When calls may last have fallen out of the queues of others' servants, on the monotonic clock."""
        self._lock = threading.RLock()
        self._adapters: list[ObjectAdapter] = []
        self._subscriptions: set[Subscription[Any]] = set()
        self._clock: Clock | None = None
        self._clock_lock = threading.Lock()
        self._shutdown: Final = Shutdown()
        self.pulse: Final = Pulse()
        self._destroyed = threading.Event()
        self.shared_memory: Final = SharedMemory(
            enabled=settings.shared_memory, on_unreadable=self._ask_for_the_network
        )
        self.session: Final = open_session(settings)
        with ExitStack() as on_failure:
            on_failure.callback(self.session.close)
            self.client_id: Final = str(self.session.zid())
            self.dispatcher: Final = Dispatcher(settings.dispatch_threads, f"zenoh_ice {settings.realm}")
            on_failure.callback(self.dispatcher.close, _DESTROY_LIMIT)
            self.presence = Presence(
                self.session, connect_endpoints(settings), self.dispatcher.submit, settings.security
            )
            on_failure.callback(self.presence.close)
            self.presence.watch(self.realm)
            self.presence.add_listener(self.shared_memory.forget_ended)
            self.coroutines: Final = Coroutines(f"zenoh_ice {settings.realm} coroutines")
            self.process_status_server: Final = ProcessStatusServer(self)
            self._calls = OutgoingCalls(self)
            self.call_numbers: Final = self._calls.numbers
            self._readers = StreamReaders(self)
            self._rivals: Final = Rivals(self)
            self._clients: Final = Clients(self.session, self.realm, self.dispatcher.submit)
            self.neighbors: Final = Neighbors(self.session, self.realm, self.shared_memory.space)
            self._tokens: dict[str, object] = {}
            self._more_tokens: list[object] = []
            self.appear_in(self.realm)
            on_failure.pop_all()
        _live.add(self)

    # Proxies and servants.

    def stringToProxy(self, text: str) -> ObjectPrx:
        """Return the proxy of a text: `Head`, `soccer/Ball -f debug`, or of another realm `Head@otherrealm`.

        `-o` before the realm makes its calls oneway, `-O` oneway in batches.

        Raises ConfigurationException when the text is no proxy.
        """
        match = _PROXY.match(" ".join(text.split()).replace(" @ ", "@"))
        if match is None:
            hint = "; endpoints are settings, such as --connect" if ":" in text else ""
            raise ConfigurationException(
                f"{text!r} is no proxy: write [CATEGORY/]NAME[ -f FACET][ -t|-o|-O][@REALM], each of "
                f"letters, digits, '_', '-' and '.' alone{hint}"
            )
        category, name, facet, mode, realm = match.groups()
        target = Target(realm or self.realm, str(Identity(name, category or "")), facet or "")
        proxy = ObjectPrx(self, target, self.settings.timeout)
        return proxy.ice_mode(Mode(mode)) if mode else proxy

    def proxyToString(self, proxy: ObjectPrx) -> str:
        """Return a proxy as text that `stringToProxy` takes."""
        return proxy.ice_toString()

    def stringToIdentity(self, text: str) -> Identity:
        """Return the identity of a text, `name` or `category/name`; raises ConfigurationException."""
        return stringToIdentity(text)

    def identityToString(self, identity: Identity) -> str:
        """Return an identity as text."""
        return identityToString(identity)

    def getImplicitContext(self) -> ImplicitContext:
        """Return what every call tells its servant; it is empty at first."""
        return self._calls.implicit_context

    def flushBatchRequests(self) -> None:
        """Send what the batches of all proxies hold.

        Raises what says that a call cannot arrive, after the others were sent.
        """
        self._calls.flush_batches()

    def createObjectAdapter(self, name: str) -> ObjectAdapter:
        """Return an adapter, which makes servants reachable; the name is for people."""
        with self._lock:
            self.check()
            self.pulse.start()
            self._rivals.start()
            adapter = ObjectAdapter(self, name)
            self._adapters.append(adapter)
        return adapter

    def identities(self, realm: str | None = None) -> list[str]:
        """Return the identities served in a realm as far as known by now, sorted."""
        return self.presence.identities(self._watched(realm))

    def servants(self, realm: str | None = None) -> list[ServantInfo]:
        """Return the servants of a realm as far as known by now, sorted by identity and facet."""
        return self.presence.servants(self._watched(realm))

    def _watched(self, realm: str | None) -> str:
        self.check()
        watched = self.realm if realm is None else check_realm(realm)
        self.presence.watch(watched)
        return watched

    def processStatus(
        self, process: str, *, realm: str | None = None, timeout: float | None = None
    ) -> ProcessStatus:
        """Return what a process that serves tells about itself and its servants, by the id of its session.

        That is `ServantInfo.server`. Raises ConnectionLostException when it is not there, does not answer
        within `timeout` s, by default the limit of calls, or access control denies it.
        """
        self.check()
        if not _SESSION_ID.fullmatch(process):
            raise ConfigurationException(f"{process!r} is no id of a session: those are ServantInfo.server")
        limit = self.check_timeout(self.settings.timeout if timeout is None else timeout)
        realm = self.realm if realm is None else check_realm(realm)
        return ask_process_status(self.session, realm, process, limit)

    def onClientLost(self, callback: Callable[[str], Any]) -> ClientWatch:
        """Call a function with the id of every client of the realm that ends or is lost, until closed.

        A client that dies is told of at once, one that hangs after the lease. The id is that of
        `Current.client`. The function runs on a thread of the communicator; its exceptions are logged.
        """
        self.check()
        return self._clients.watch(callback)

    def appear_in(self, realm: str) -> None:
        """Let the servants of a realm know that this communicator is there, and whose memory it can read."""
        with self._lock:
            if realm not in self._tokens:
                self._tokens[realm] = self._declare_token(realm)

    def _ask_for_the_network(self) -> None:
        """Let servants know that this communicator cannot read their memory after all."""
        with self._lock:
            # Beside the others, as the end of those would say that this client is gone.
            if not self.destroyed:
                self._more_tokens = [self._declare_token(realm) for realm in self._tokens]

    def _declare_token(self, realm: str) -> object:
        token = client_token(realm, self.client_id, self.shared_memory.readable_space)
        return self.session.liveliness().declare_token(token)

    # Time.

    @property
    def clock(self) -> Clock:
        """The component's clock, chosen by the setting `clock`; choosing may wait for the robot's server."""
        with self._clock_lock:  # of its own: choosing calls the robot's server
            self.check()
            if self._clock is None:
                from .clocks.robot_clock import choose_clock  # here: it needs proxies

                self._clock = choose_clock(self)
            return self._clock

    # Life.

    def shutdown(self) -> None:
        """Withdraw all servants and let `waitForShutdown` return; proxies go on working."""
        self._shutdown.begin()
        with self._lock:
            adapters = list(self._adapters)
        for adapter in adapters:
            adapter.deactivate()

    def waitForShutdown(self, timeout: float | None = None) -> bool:
        """Wait until `shutdown` or `destroy` is called, at most `timeout` s; return whether one was."""
        return self._shutdown.wait(timeout)

    def isShutdown(self) -> bool:
        """Return whether `shutdown` or `destroy` was called."""
        return self._shutdown.begun

    def destroy(self) -> None:
        """End everything: servants, streams, calls that wait, threads, the session.

        Any thread may call it, a servant's included, and more than once. Who waits for a call or a sample
        gets CommunicatorDestroyedException; who waits for room on a link that takes nothing, after the limit
        of calls. What runs may go on for some seconds.
        """
        with self._lock:
            first, self.destroyed = not self.destroyed, True
            adapters, self._adapters = self._adapters, []
            subscriptions = list(self._subscriptions)
        if not first:
            if not is_marked_thread():  # such a thread may be what the first caller waits for
                self._destroyed.wait(3 * _DESTROY_LIMIT)
            return
        self._shutdown.begin()
        # Run from the last to the first, each whatever the others raise, Ctrl-C included.
        with ExitStack() as steps:
            steps.callback(_live.discard, self)
            steps.callback(self._destroyed.set)
            steps.callback(self.dispatcher.close, _DESTROY_LIMIT)
            steps.callback(self.pulse.close)
            steps.callback(self._calls.close)
            steps.callback(self.shared_memory.close)
            steps.callback(close_session, self.session)
            steps.callback(self.process_status_server.close)
            steps.callback(self.coroutines.close, _DESTROY_LIMIT)
            steps.callback(self._close_clock)
            steps.callback(self._readers.close)
            for subscription in subscriptions:
                steps.callback(subscription.close)
            for adapter in adapters:
                steps.callback(adapter.destroy)
            steps.callback(self.presence.close)
            steps.callback(self._clients.close)
            steps.callback(self.neighbors.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.destroy()

    def __repr__(self) -> str:
        return f"<communicator {self.client_id} of realm {self.realm}>"

    def abandon(self) -> None:
        """Refuse all further use: in a forked child the session is broken and must not be touched."""
        self.destroyed = True
        self._shutdown.begin()
        self._destroyed.set()

    def _close_clock(self) -> None:
        if self._clock_lock.acquire(timeout=_DESTROY_LIMIT):
            try:
                close = getattr(self._clock, "close", None)
                if close is not None:
                    close()
            finally:
                self._clock_lock.release()


_live: Final[set[Communicator]] = set()


def _destroy_all() -> None:
    # Without this, a session with handlers in Python would keep the interpreter from ending.
    for communicator in tuple(_live):
        _logger.debug("%r was not destroyed before the end of the program", communicator)
        communicator.destroy()


def _abandon_all() -> None:
    for communicator in tuple(_live):
        communicator.abandon()
    _live.clear()


atexit.register(_destroy_all)
os.register_at_fork(after_in_child=_abandon_all)
