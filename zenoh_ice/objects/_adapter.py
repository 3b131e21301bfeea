"""Adapters, which serve servants."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Iterable
from contextlib import ExitStack
from typing import Final

from zenoh_ice.data import exceptions
from zenoh_ice.data.keys import Target
from zenoh_ice.objects._servant import Object, ServedObject
from zenoh_ice.objects.home import Home
from zenoh_ice.objects.proxy import ObjectPrx
from zenoh_ice.routes.failing import FailingLink


class ObjectAdapter:
    """Serve servants.

    Life cycle: `add` and `activate` in any order, `deactivate` and `activate` repeatedly. Servants that
    are added to an active adapter are served at once. A withdrawn servant gets no more calls; running calls
    may continue for a second.
    """

    def __init__(
        self,
        communicator: Home,
        name: str,
        served: dict[Target, ServedObject],
        keep: Callable[[ObjectAdapter, bool], object],
    ) -> None:
        """Make an adapter that notes what it serves beside others; `keep` learns when it is active."""
        self._communicator: Final = communicator
        self._name: Final = name
        self._served: Final = served
        self._keep: Final = keep
        self._lock: Final = threading.RLock()
        self._servants: Final[dict[str, Object]] = {}
        self._active: dict[str, ServedObject] | None = None

    def getCommunicator(self) -> Home:
        """Return the communicator that made the adapter."""
        return self._communicator

    def add(self, servant: Object, identity: str) -> ObjectPrx:
        """Serve a servant under an identity; return a proxy to it.

        Raises AlreadyRegisteredException when this process or, as far as it can see, another one of the realm
        serves the identity, ConfigurationException when it is no valid identity or a method is a coroutine.
        """
        target = self._communicator.target(identity)
        with self._lock:
            if identity in self._servants:
                raise exceptions.AlreadyRegisteredException(
                    f"adapter {self._name} serves {identity!r} already"
                )
            if self._active is not None:
                self._active |= self._open({identity: servant})
            self._servants[identity] = servant
        return ObjectPrx(self._communicator, target, self._communicator.settings.timeout)

    def removeAll(self, identities: Iterable[str] | None = None) -> dict[str, Object]:
        """Withdraw several servants at once, all by default, and return them by identity.

        Their running calls may continue for a second altogether.
        """
        with self._lock:
            names = list(self._servants) if identities is None else list(identities)
            removed = {name: self._servants.pop(name) for name in names if name in self._servants}
            active = self._active or {}
            withdrawn = [active.pop(name) for name in removed if name in active]
        self._withdraw(withdrawn)
        return removed

    def find(self, identity: str) -> Object | None:
        """Return the servant of an identity, or None."""
        return self._servants.get(identity)

    def impair(self, link: FailingLink | None, identities: Collection[str]) -> None:
        """Let what passes between some of the active servants and others pass a failing link.

        Without a link all passes freely, as it does for its other servants, and for those added later.
        """
        with self._lock:
            for identity, served in (self._active or {}).items():
                served.impair(link if identity in identities else None)

    def activate(self) -> None:
        """Serve the servants from now on.

        Raises AlreadyRegisteredException, as `add` does; nothing is served then.
        """
        with self._lock:
            if self._active is None:
                self._keep(self, True)
                try:
                    self._active = self._open(self._servants)
                finally:
                    if self._active is None:
                        self._keep(self, False)

    def deactivate(self) -> None:
        """Withdraw the servants; running calls may continue for a second. Does nothing when not active."""
        with self._lock:
            active, self._active = self._active or {}, None
            self._keep(self, False)
        self._withdraw(list(active.values()))

    def destroy(self) -> None:
        """Withdraw the servants and forget them."""
        self.deactivate()
        with self._lock:
            self._servants.clear()

    def _open(self, wanted: dict[str, Object]) -> dict[str, ServedObject]:
        """Serve some servants, all or none."""
        communicator = self._communicator
        begun: dict[str, ServedObject] = {}
        try:
            for identity, servant in wanted.items():
                begun[identity] = self._begin(communicator.target(identity), servant)
                begun[identity].open()
            # Together, once all accept calls: a client that learns of one of them finds the others.
            for served in begun.values():
                served.announce()
        except BaseException:
            self._withdraw(list(begun.values()))
            raise
        return begun

    def _begin(self, target: Target, servant: Object) -> ServedObject:
        communicator = self._communicator
        communicator.check()
        if communicator.presence.servers(target):
            raise exceptions.AlreadyRegisteredException(
                f"another process of realm {target.realm!r} serves {target.identity!r} already, and two "
                "would share its calls: stop one, or give it another --realm"
            )
        served = ServedObject(communicator, target, servant)
        if self._served.setdefault(target, served) is not served:
            raise exceptions.AlreadyRegisteredException(
                f"another adapter of this process serves {target.identity!r} already"
            )
        return served

    def _withdraw(self, withdrawn: list[ServedObject]) -> None:
        deadline = time.monotonic() + self._communicator.limits.drain
        # Run from the last to the first, each whatever the others raise: first calls are refused,
        # then all running calls are awaited at once.
        with ExitStack() as steps:
            for served in withdrawn:
                steps.callback(served.drain, deadline)
            for served in withdrawn:
                steps.callback(served.close)
                steps.callback(self._served.pop, served.target, None)
