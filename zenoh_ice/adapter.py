"""Object adapters: what makes servants reachable under identities."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Final

from .exceptions import (
    AlreadyRegisteredException,
    CommunicatorDestroyedException,
    ObjectNotExistException,
)
from .identity import Target, stringToIdentity
from .incoming import Incoming
from .object import Object
from .proxy import ObjectPrx

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["ObjectAdapter"]

_DRAIN_LIMIT: Final = 1.0  # s for which calls that run may go on when their servants are withdrawn
_TOKEN_LIMIT: Final = 0.5  # s more in which the tokens of these servants go away


class ObjectAdapter:
    """Serve servants.

    Life cycle: `add` and `activate` in any order, `deactivate` and `activate` again at will.

    Servants that are added to an active adapter are served at once.
    """

    def __init__(self, communicator: Communicator, name: str) -> None:
        self._communicator: Final = communicator
        self._name: Final = name
        self._lock = threading.RLock()
        self._servants: dict[str, Object] = {}
        self._active: dict[str, Incoming] | None = None

    def getName(self) -> str:
        """Return the name, which only serves people."""
        return self._name

    def getCommunicator(self) -> Communicator:
        """Return the communicator that made the adapter."""
        return self._communicator

    def add(self, servant: Object, identity: str) -> ObjectPrx:
        """Serve a servant under an identity; return a proxy to it.

        Raises AlreadyRegisteredException when this process or, as far as it knows, another one of the realm
        serves the identity, ConfigurationException when it is no valid identity.
        """
        identity = str(stringToIdentity(identity))
        proxy = self._communicator.stringToProxy(identity)
        with self._lock:
            if identity in self._servants:
                raise AlreadyRegisteredException(f"adapter {self._name} serves {identity!r} already")
            if self._active is not None:
                self._activate(identity, servant, self._active)
            self._servants[identity] = servant
        return proxy

    def remove(self, identity: str) -> Object:
        """Withdraw a servant and return it; calls that run may go on for a second.

        Raises ObjectNotExistException when the adapter has no such servant.
        """
        removed = self.removeAll([identity])
        try:
            return removed[identity]
        except KeyError:
            raise ObjectNotExistException(f"adapter {self._name} has no servant {identity!r}") from None

    def removeAll(self, identities: Iterable[str] | None = None) -> dict[str, Object]:
        """Withdraw several servants at once, without `identities` all, and return those that there were.

        Calls of them that run may go on for a second altogether.
        """
        with self._lock:
            wanted = list(self._servants) if identities is None else identities
            removed = {name: self._servants.pop(name) for name in wanted if name in self._servants}
            active = self._active or {}
            withdrawn = [active.pop(name) for name in removed if name in active]
        self._deactivate(*withdrawn)
        return removed

    def find(self, identity: str) -> Object | None:
        """Return the servant of an identity, or None."""
        return self._servants.get(identity)

    def activate(self) -> None:
        """Serve the servants from now on.

        Raises AlreadyRegisteredException, as `add` does; nothing is served then.
        """
        with self._lock:
            if self._active is not None:
                return
            active: dict[str, Incoming] = {}
            try:
                for identity, servant in self._servants.items():
                    self._activate(identity, servant, active)
            except BaseException:
                self._deactivate(*active.values())
                raise
            self._active = active

    def deactivate(self) -> None:
        """Withdraw the servants; calls that run may go on for a second. Does nothing when not active."""
        with self._lock:
            active, self._active = self._active or {}, None
        self._deactivate(*active.values())

    def destroy(self) -> None:
        """Withdraw the servants and forget them."""
        self.deactivate()
        with self._lock:
            self._servants.clear()

    def _activate(self, identity: str, servant: Object, active: dict[str, Incoming]) -> None:
        communicator = self._communicator
        if communicator.destroyed:
            raise CommunicatorDestroyedException(f"adapter {self._name}: the communicator was destroyed")
        target = Target(communicator.realm, identity)
        if communicator.presence.interfaces(target):
            raise AlreadyRegisteredException(
                f"another process of realm {target.realm!r} serves {identity!r} already, and two would "
                "share what is meant for one: stop one, or give it another --realm"
            )
        incoming = Incoming(communicator, target, servant)
        if communicator.local_servants.setdefault(target, incoming) is not incoming:
            raise AlreadyRegisteredException(f"another adapter of this process serves {identity!r} already")
        active[identity] = incoming
        try:
            incoming.activate(communicator.session)
        except BaseException:
            del active[identity]
            self._deactivate(incoming)
            raise

    def _deactivate(self, *servants: Incoming) -> None:
        deadline = time.monotonic() + _DRAIN_LIMIT
        # Run from the last to the first, each whatever the others raise: first nobody is called any longer,
        # then those that run are waited for, all at once.
        with ExitStack() as steps:
            for incoming in servants:
                steps.callback(self._wait_for, incoming, deadline)
            for incoming in servants:
                self._communicator.local_servants.pop(incoming.target, None)
                steps.callback(incoming.withdraw)

    def _wait_for(self, incoming: Incoming, deadline: float) -> None:
        incoming.drain(max(0.0, deadline - time.monotonic()))
        # Our own token must not look like another process's when the identity is added again.
        left = deadline + _TOKEN_LIMIT - time.monotonic()
        self._communicator.presence.wait_until_gone(incoming.target, max(0.0, left))
