"""The transport between processes: over Zenoh, and on one machine through sockets and memory as well."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final

from zenoh_ice.carriers._in_process import InProcess, InProcessCalls
from zenoh_ice.carriers._local.server import LocalServer
from zenoh_ice.carriers.zenoh._network import Network, NetworkCalls
from zenoh_ice.carriers.zenoh._streams import NetworkOutlet
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.routes._calls import OwnCalls, Route, RoutedCaller, Routes
from zenoh_ice.routes._streams import BulkInlet, BulkOutlet
from zenoh_ice.settings import Security, Settings
from zenoh_ice.threads.clock import WALL, Clock
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Caller, Inlet, Outlet, Receiver, Registration, Relay

_MOST_CALLERS: Final = 256  # shared by proxies: each has a querier

_logger = logging.getLogger(__name__)


class RoutedTransport:
    """Join this process to others: `local` has its own servants and all tokens, `network` the session."""

    clock: Clock = WALL
    relay: Relay | None = None

    def __init__(self, settings: Settings, pool: Pool, limits: Limits = LIMITS) -> None:
        """Open the session; raises as `open_session` does."""
        self.local: Final = InProcess(pool, "")
        self.network: Final = Network(settings, pool, self.local.receivers)
        self.id = self.network.id
        self.endpoints = self.network.endpoints
        self.token_delay = limits.token_delay
        # Credentials mean that others decide who may call whom; they see nothing of a socket.
        is_local = settings.local_sockets and settings.security == Security()
        self.routes: Final = Routes(self.local.watch, limits) if is_local else None
        self._pool: Final = pool
        self._limits: Final = limits
        self._realm: Final = settings.realm
        self._calls: Final = OwnCalls(self.id)
        self._lock: Final = threading.Lock()
        self._local_server: LocalServer | None = None
        self._wants_local_server = is_local
        # Callers that it evicts live on in the calls that hold them.
        self.caller: Final = lru_cache(_MOST_CALLERS)(self._caller)
        # What has one way.
        self.announce: Final = self.network.announce
        self.serve_status: Final = self.network.serve_status
        self.ask_status: Final = self.network.ask_status
        self.explain_unreachable: Final = self.network.explain_unreachable

    @property
    def local_address(self) -> str:
        return "" if self._local_server is None else self._local_server.address

    def is_near(self, target: Target) -> bool:
        if target.prefix in self.local.receivers:
            return True
        channels = self._route(target).channels
        return channels is not None and not channels.is_absent

    def _caller(
        self,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,
    ) -> Caller:
        if target.realm != self._realm:
            self.network.appear(target.realm)
        return RoutedCaller(
            self._calls,
            target,
            operation,
            timeout=timeout,
            fingerprint=fingerprint,
            served_here=self.local.receivers,
            here=InProcessCalls(self.local, target.key(operation.name), timeout),
            route=self._route(target),
            network=NetworkCalls(self.network, target, operation, timeout),
        )

    def serve(self, target: Target, receiver: Receiver) -> Registration:
        here = self.local.serve(target, receiver)
        self._open_local_server()
        elsewhere = self.network.serve(target)

        def close() -> None:
            here.close()
            elsewhere.close()

        return Registration(close)

    def publish(self, target: Target, operation: Operation[..., Any]) -> Outlet:
        key, bulk = target.key(operation.name), operation.result.holds_bytes
        self._open_local_server()
        outlet = NetworkOutlet(self.network.session, key, bulk=bulk)
        server = self._local_server if bulk else None
        if server is None or (listeners := server.publish(key)) is None:
            return outlet
        return BulkOutlet(outlet, listeners, lambda: server.unpublish(key))

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:
        self.network.appear(target.realm)
        if operation.result.holds_bytes:
            return BulkInlet(self.network, self._route(target), target, operation, queue)
        return self.network.listen(target.key(operation.name), operation.result.size_limit, queue)

    def watch(self, pattern: str, changed: Callable[[str, bool], object]) -> Registration:
        watch = self.local.watch(pattern, changed)
        self.network.follow(pattern, self.local.notify)
        return watch

    def watch_links(self, changed: Callable[[str, bool], object]) -> Registration:
        def on_link(peer: str, up: bool) -> None:
            changed(peer, up)
            if not up and self.routes is not None:
                self.routes.lost(peer)

        return self.network.watch_links(on_link)

    def close(self) -> None:
        with self._lock:
            self._wants_local_server = False
        self.local.close()
        if self._local_server is not None:
            self._local_server.close()
        if self.routes is not None:
            self.routes.close()
        self.network.close()

    def _route(self, target: Target) -> Route:
        return Route() if self.routes is None else self.routes.route(target)

    def _open_local_server(self) -> None:
        with self._lock:
            if self._wants_local_server:
                self._wants_local_server = False
                try:
                    self._local_server = LocalServer(self._pool, self.local.receivers, self.id, self._limits)
                except OSError as error:
                    _logger.warning("others of this machine call over the network: no socket: %s", error)
