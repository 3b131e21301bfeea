"""Object adapters: what makes servants reachable under identities."""

from __future__ import annotations

import math
import re
import uuid
from collections.abc import Iterable
from typing import TYPE_CHECKING, Final, TypeVar

from .exceptions import (
    ConfigurationException,
    FacetNotExistException,
    ObjectNotExistException,
)
from .identity import NAME, Identity, Target, stringToIdentity
from .object import Object
from .proxy import ObjectPrx
from .serving.default_incoming import default_target
from .serving.servant_locator import ServantLocator
from .serving.servant_map import ServantMap, shown
from .serving.served import Served, ServedDefault, ServedLocator

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["ObjectAdapter"]

D = TypeVar("D", ServedDefault, ServedLocator)


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
        self._servants: Final = ServantMap(self)

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
        self._servants.add(target, Served(servant, replica))
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
        removed = self._servants.remove([target]).get(target)
        if isinstance(removed, Served):
            return removed.servant
        if self.findAllFacets(identity):
            raise FacetNotExistException(f"adapter {self._name} has no servant {target.object!r}")
        raise ObjectNotExistException(f"adapter {self._name} has no servant {target.object!r}")

    def removeAllFacets(self, identity: str | Identity) -> dict[str, Object]:
        """Withdraw all facets of an identity, itself among them as `""`, and return them.

        Raises ObjectNotExistException when the adapter has no such identity.
        """
        removed = self._servants.remove(
            [self._target(identity, facet) for facet in self.findAllFacets(identity)]
        )
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
        names = None if identities is None else {str(identity) for identity in identities}
        wanted = self._servants.where(lambda target: names is None or target.identity in names)
        return {
            target.identity: served.servant
            for target, served in self._servants.remove(wanted).items()
            if isinstance(served, Served) and not target.facet
        }

    def find(self, identity: str | Identity) -> Object | None:
        """Return the servant of an identity, or None."""
        return self.findFacet(identity, "")

    def findFacet(self, identity: str | Identity, facet: str) -> Object | None:
        """Return the servant that is a facet of an identity, or None."""
        served = self._servants.get(Target(self._communicator.realm, str(identity), facet))
        return served.servant if isinstance(served, Served) else None

    def findAllFacets(self, identity: str | Identity) -> dict[str, Object]:
        """Return the servants of an identity by facet, `""` for itself."""
        name = str(identity)
        return {
            target.facet: served.servant
            for target, served in self._servants.where(lambda target: target.identity == name).items()
            if isinstance(served, Served)
        }

    def findByProxy(self, proxy: ObjectPrx) -> Object | None:
        """Return the servant that a proxy stands for, or None, as of any proxy of another realm."""
        if proxy.ice_getRealm() != self._communicator.realm:
            return None
        return self.findFacet(proxy.ice_getIdentity(), proxy.ice_getFacet())

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
        self._servants.add(self._default(category), ServedDefault(servant, category))

    def removeDefaultServant(self, category: str = "") -> Object:
        """Withdraw the default servant of a category and return it; raises ObjectNotExistException."""
        return self._remove_default(category, ServedDefault).servant

    def findDefaultServant(self, category: str = "") -> Object | None:
        """Return the default servant of a category, or None."""
        served = self._servants.get(self._default(category))
        return served.servant if isinstance(served, ServedDefault) else None

    def addServantLocator(self, locator: ServantLocator, category: str = "") -> None:
        """Let a locator find the servants of all names of a category that have none of their own.

        Otherwise as `addDefaultServant`. Such servants take no oneway calls: which they could take shows only
        when they were located.
        """
        self._servants.add(self._default(category), ServedLocator(locator, category))

    def removeServantLocator(self, category: str = "") -> ServantLocator:
        """Withdraw the locator of a category and return it; raises ObjectNotExistException."""
        return self._remove_default(category, ServedLocator).locator

    def findServantLocator(self, category: str = "") -> ServantLocator | None:
        """Return the locator of a category, or None."""
        served = self._servants.get(self._default(category))
        return served.locator if isinstance(served, ServedLocator) else None

    # Life.

    def activate(self) -> None:
        """Serve the servants from now on.

        Raises AlreadyRegisteredException, as `add` does; nothing is served then.
        """
        self._servants.activate()

    def deactivate(self) -> None:
        """Withdraw the servants; calls that run may go on for a second. Does nothing when not active."""
        self._servants.deactivate()

    def waitForDeactivate(self, timeout: float | None = None) -> bool:
        """Wait for at most `timeout` s until it was deactivated and all calls ended; return whether so.

        Without a limit it waits for as long as that takes: a servant may never return.
        """
        return self._servants.wait_for_deactivate(math.inf if timeout is None else timeout)

    def isDeactivated(self) -> bool:
        """Return whether it was deactivated, and not activated since."""
        return self._servants.deactivated

    def destroy(self) -> None:
        """Withdraw the servants and forget them."""
        self.deactivate()
        self._servants.clear()

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

    def _remove_default(self, category: str, kind: type[D]) -> D:
        target = self._default(category)
        if isinstance(self._servants.get(target), kind):
            removed = self._servants.remove([target]).get(target)
            if isinstance(removed, kind):
                return removed
        raise ObjectNotExistException(f"adapter {self._name} has no such servant for {shown(target)}")


def _check_name(name: str, what: str) -> None:
    if not re.fullmatch(NAME, name):
        raise ConfigurationException(
            f"{name!r} is no {what}: write at most 128 letters, digits, '_', '-' and '.'"
        )
