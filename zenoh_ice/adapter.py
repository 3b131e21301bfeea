"""Object adapters: what makes servants reachable under identities."""

from __future__ import annotations

import math
import re
import threading
import time
import uuid
from collections.abc import Iterable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Final, TypeVar

from .exceptions import (
    AlreadyRegisteredException,
    CommunicatorDestroyedException,
    ConfigurationException,
    FacetNotExistException,
    ObjectNotExistException,
)
from .identity import ANY_NAME, NAME, Identity, Target, stringToIdentity
from .object import Object
from .proxy import ObjectPrx
from .serving.default_incoming import default_target
from .serving.registration import Registration
from .serving.servant_locator import ServantLocator
from .serving.served import AnyIncoming, AnyServed, Served, ServedDefault, ServedLocator

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["ObjectAdapter"]

D = TypeVar("D", ServedDefault, ServedLocator)

_DRAIN_LIMIT: Final = 1.0  # s for which calls that run may go on when their servants are withdrawn
_TOKEN_LIMIT: Final = 0.5  # s more in which the tokens of these servants go away


class ObjectAdapter:
    """Serve servants.

    Life cycle: `add` and `activate` in any order, `deactivate` and `activate` again at will.

    Servants that are added to an active adapter are served at once.

    An identity is `name` or `category/name`, as text or as an Identity. A servant that is withdrawn gets no
    more calls; those that run, and those that it answers later, may go on for a second.
    """

    def __init__(self, communicator: Communicator, name: str) -> None:
        self._communicator: Final = communicator
        self._name: Final = name
        self._lock: Final = threading.RLock()
        self._changed: Final = threading.Condition()
        self._served: dict[Target, AnyServed] = {}
        self._active: dict[Target, AnyIncoming] | None = None
        self._deactivated = False
        self._ending: list[Registration] = []

    def getName(self) -> str:
        """Return the name, which only serves people."""
        return self._name

    def getCommunicator(self) -> Communicator:
        """Return the communicator that made the adapter."""
        return self._communicator

    # Servants.

    def add(self, servant: Object, identity: str | Identity, *, replica: bool = False) -> ObjectPrx:
        """Serve a servant under an identity; return a proxy to it.

        Of a `replica` other processes may serve the same identity, as replicas, too; proxies choose one.

        Raises AlreadyRegisteredException when this process or, as far as it knows, another one of the realm
        serves the identity, ConfigurationException when it is no valid identity.
        """
        return self.addFacet(servant, identity, "", replica=replica)

    def addWithUUID(self, servant: Object) -> ObjectPrx:
        """Serve a servant under an identity that nobody else has; return a proxy to it."""
        return self.add(servant, str(uuid.uuid4()))

    def addFacet(
        self, servant: Object, identity: str | Identity, facet: str, *, replica: bool = False
    ) -> ObjectPrx:
        """Serve a servant as a facet of an identity; return a proxy to it. Otherwise as `add`."""
        target = self._target(identity, facet)
        self._add(target, Served(servant, replica))
        return self._communicator.stringToProxy(target.object)

    def remove(self, identity: str | Identity) -> Object:
        """Withdraw a servant and return it; its facets stay.

        Raises ObjectNotExistException when the adapter has no such servant.
        """
        return self.removeFacet(identity, "")

    def removeFacet(self, identity: str | Identity, facet: str) -> Object:
        """Withdraw a servant that is a facet and return it.

        Raises FacetNotExistException, or ObjectNotExistException when the adapter has no such identity.
        """
        target = self._target(identity, facet)
        removed = self._remove([target]).get(target)
        if isinstance(removed, Served):
            return removed.servant
        if self.findAllFacets(identity):
            raise FacetNotExistException(f"adapter {self._name} has no servant {target.object!r}")
        raise ObjectNotExistException(f"adapter {self._name} has no servant {target.object!r}")

    def removeAllFacets(self, identity: str | Identity) -> dict[str, Object]:
        """Withdraw all facets of an identity, itself among them as `""`, and return them.

        Raises ObjectNotExistException when the adapter has no such identity.
        """
        with self._lock:
            wanted = [self._target(identity, facet) for facet in self.findAllFacets(identity)]
        removed = self._remove(wanted)
        if not removed:
            raise ObjectNotExistException(f"adapter {self._name} has no servant {str(identity)!r}")
        return {
            target.facet: served.servant for target, served in removed.items() if isinstance(served, Served)
        }

    def removeAll(self, identities: Iterable[str | Identity] | None = None) -> dict[str, Object]:
        """Withdraw several servants at once, with their facets, and return those that there were by identity.

        Without `identities` all are withdrawn, default servants and locators included. Calls of them that run
        may go on for a second altogether.
        """
        with self._lock:
            names = None if identities is None else {str(identity) for identity in identities}
            wanted = [target for target in self._served if names is None or target.identity in names]
        return {
            target.identity: served.servant
            for target, served in self._remove(wanted).items()
            if isinstance(served, Served) and not target.facet
        }

    def find(self, identity: str | Identity) -> Object | None:
        """Return the servant of an identity, or None."""
        return self.findFacet(identity, "")

    def findFacet(self, identity: str | Identity, facet: str) -> Object | None:
        """Return the servant that is a facet of an identity, or None."""
        served = self._served.get(Target(self._communicator.realm, str(identity), facet))
        return served.servant if isinstance(served, Served) else None

    def findAllFacets(self, identity: str | Identity) -> dict[str, Object]:
        """Return the servants of an identity by facet, `""` for itself."""
        with self._lock:
            return {
                target.facet: served.servant
                for target, served in self._served.items()
                if target.identity == str(identity) and isinstance(served, Served)
            }

    def findByProxy(self, proxy: ObjectPrx) -> Object | None:
        """Return the servant of the identity and facet of a proxy, or None."""
        target = self._communicator.stringToProxy(proxy.ice_toString())._target
        return self.findFacet(target.identity, target.facet)

    def createProxy(self, identity: str | Identity) -> ObjectPrx:
        """Return a proxy of an identity, whether it is served or not."""
        return self._communicator.stringToProxy(self._target(identity).object)

    # Default servants and locators.

    def addDefaultServant(self, servant: Object, category: str = "") -> None:
        """Serve all names of a category that have no servant of their own, in any process of the realm.

        Of the empty category those of all categories that have no default servant. It serves any facet;
        `Current` has both. To say that there is no such object it raises ObjectNotExistException. It has
        no streams: a sample could not tell whose it is.

        Raises AlreadyRegisteredException when the category has a default servant or a locator.
        """
        self._add(self._default(category), ServedDefault(servant, category))

    def removeDefaultServant(self, category: str = "") -> Object:
        """Withdraw the default servant of a category and return it; raises ObjectNotExistException."""
        return self._remove_default(category, ServedDefault).servant

    def findDefaultServant(self, category: str = "") -> Object | None:
        """Return the default servant of a category, or None."""
        served = self._served.get(self._default(category))
        return served.servant if isinstance(served, ServedDefault) else None

    def addServantLocator(self, locator: ServantLocator, category: str = "") -> None:
        """Let a locator find the servants of all names of a category that have none of their own.

        Otherwise as `addDefaultServant`. Such servants take no oneway calls: which they could take shows only
        when they were located.
        """
        self._add(self._default(category), ServedLocator(locator, category))

    def removeServantLocator(self, category: str = "") -> ServantLocator:
        """Withdraw the locator of a category and return it; raises ObjectNotExistException."""
        return self._remove_default(category, ServedLocator).locator

    def findServantLocator(self, category: str = "") -> ServantLocator | None:
        """Return the locator of a category, or None."""
        served = self._served.get(self._default(category))
        return served.locator if isinstance(served, ServedLocator) else None

    # Life.

    def activate(self) -> None:
        """Serve the servants from now on.

        Raises AlreadyRegisteredException, as `add` does; nothing is served then.
        """
        with self._lock:
            if self._active is not None:
                return
            active: dict[Target, AnyIncoming] = {}
            try:
                for target, served in self._served.items():
                    self._activate(target, served, active)
            except BaseException:
                self._deactivate(*active.values())
                raise
            self._active = active
            self._deactivated = False

    def deactivate(self) -> None:
        """Withdraw the servants; calls that run may go on for a second. Does nothing when not active."""
        with self._lock:
            active, self._active = self._active or {}, None
        self._deactivate(*active.values())
        with self._changed:
            self._deactivated = True
            self._changed.notify_all()

    def waitForDeactivate(self, timeout: float | None = None) -> bool:
        """Wait for at most `timeout` s until it was deactivated and all calls ended; return whether so.

        Without a limit it waits for as long as that takes: a servant may never return.
        """
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        with self._changed:
            if not self._changed.wait_for(lambda: self._deactivated, _left(deadline)):
                return False
        while True:
            with self._lock:
                if not self._ending:
                    return True
                first = self._ending[0]
            if not first.wait_until_idle(_left(deadline)):
                return False
            with self._lock:
                if first in self._ending:
                    self._ending.remove(first)

    def isDeactivated(self) -> bool:
        """Return whether it was deactivated, and not activated since."""
        return self._deactivated

    def destroy(self) -> None:
        """Withdraw the servants and forget them."""
        self.deactivate()
        with self._lock:
            self._served.clear()

    def _target(self, identity: str | Identity, facet: str = "") -> Target:
        """Return what a call is addressed to; raises ConfigurationException."""
        name = stringToIdentity(str(identity))
        if facet:
            _check_name(facet, "facet")
        return Target(self._communicator.realm, str(name), facet)

    def _default(self, category: str) -> Target:
        if category:
            _check_name(category, "category")
        return default_target(self._communicator.realm, category)

    def _add(self, target: Target, served: AnyServed) -> None:
        with self._lock:
            if target in self._served:
                raise AlreadyRegisteredException(f"adapter {self._name} serves {_shown(target)} already")
            if self._active is not None:
                self._activate(target, served, self._active)
            self._served[target] = served

    def _remove(self, targets: Iterable[Target]) -> dict[Target, AnyServed]:
        with self._lock:
            removed = {target: self._served.pop(target) for target in targets if target in self._served}
            active = self._active or {}
            withdrawn = [active.pop(target) for target in removed if target in active]
        self._deactivate(*withdrawn)
        return removed

    def _remove_default(self, category: str, kind: type[D]) -> D:
        target = self._default(category)
        with self._lock:
            served = self._served.get(target)
            if isinstance(served, kind):
                self._remove([target])
                return served
        raise ObjectNotExistException(f"adapter {self._name} has no such servant for {_shown(target)}")

    def _activate(self, target: Target, served: AnyServed, active: dict[Target, AnyIncoming]) -> None:
        communicator = self._communicator
        if communicator.destroyed:
            raise CommunicatorDestroyedException(f"adapter {self._name}: the communicator was destroyed")
        others = communicator.presence.servers(target)
        if not (served.replica and all(other.replicated for other in others)) and others:
            raise AlreadyRegisteredException(
                f"another process of realm {target.realm!r} serves {_shown(target)} already, and two would "
                "share what is meant for one: stop one, or give it another --realm"
            )
        incoming = served.incoming(self, target)
        if not communicator.local_servants.add(incoming):
            incoming.drain(0.0)  # ends its threads
            raise AlreadyRegisteredException(
                f"another adapter of this process serves {_shown(target)} already"
            )
        active[target] = incoming
        try:
            communicator.process_status_server.open()
            incoming.activate(communicator.session)
        except BaseException:
            del active[target]
            self._deactivate(incoming)
            raise

    def _deactivate(self, *servants: AnyIncoming) -> None:
        deadline = time.monotonic() + _DRAIN_LIMIT
        # Run from the last to the first, each whatever the others raise: first nobody is called any longer,
        # then those that run are waited for, all at once.
        with ExitStack() as steps:
            for incoming in servants:
                steps.callback(self._wait_for, incoming, deadline)
            for incoming in servants:
                self._communicator.local_servants.remove(incoming)
                steps.callback(incoming.withdraw)

    def _wait_for(self, incoming: AnyIncoming, deadline: float) -> None:
        if not incoming.drain(_left(deadline)):
            with self._lock:
                self._ending = [other for other in self._ending if not other.wait_until_idle(0.0)]
                self._ending.append(incoming)
        # Our own token must not look like another process's when the identity is added again.
        communicator = self._communicator
        communicator.presence.wait_until_gone(
            incoming.target, _left(deadline + _TOKEN_LIMIT), communicator.client_id
        )


def _left(deadline: float) -> float:
    return min(max(0.0, deadline - time.monotonic()), threading.TIMEOUT_MAX)


def _check_name(name: str, what: str) -> None:
    if not re.fullmatch(NAME, name):
        raise ConfigurationException(
            f"{name!r} is no {what}: write at most 128 letters, digits, '_', '-' and '.'"
        )


def _shown(target: Target) -> str:
    category, _, name = target.identity.rpartition("/")
    if name != ANY_NAME:
        return repr(target.object)
    return f"the names of category {category!r}"
