"""What an adapter serves: servants under identities and facets, default servants, and servant locators."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..object import Object
from .default_incoming import DefaultServantIncoming
from .incoming import Incoming
from .locator_incoming import LocatorIncoming
from .servant_locator import ServantLocator

if TYPE_CHECKING:
    from ..adapter import ObjectAdapter
    from ..identity import Target

__all__ = ["AnyIncoming", "AnyServed", "Served", "ServedDefault", "ServedLocator"]

AnyIncoming = Incoming | DefaultServantIncoming | LocatorIncoming


@dataclass(frozen=True, slots=True)
class Served:
    """A servant of one identity and facet."""

    servant: Object
    replica: bool = False

    def incoming(self, adapter: ObjectAdapter, target: Target) -> AnyIncoming:
        """Return what takes its calls."""
        communicator = adapter.getCommunicator()
        return Incoming(communicator, target, self.servant, adapter, replica=self.replica)


@dataclass(frozen=True, slots=True)
class ServedDefault:
    """A servant of all names of a category that have none of their own."""

    servant: Object
    category: str
    replica: bool = False

    def incoming(self, adapter: ObjectAdapter, target: Target) -> AnyIncoming:  # noqa: ARG002
        """Return what takes its calls."""
        return DefaultServantIncoming(adapter.getCommunicator(), self.category, self.servant, adapter)


@dataclass(frozen=True, slots=True)
class ServedLocator:
    """A locator of servants of all names of a category that have none of their own."""

    locator: ServantLocator
    category: str
    replica: bool = False

    def incoming(self, adapter: ObjectAdapter, target: Target) -> AnyIncoming:  # noqa: ARG002
        """Return what takes its calls."""
        return LocatorIncoming(adapter.getCommunicator(), self.category, self.locator, adapter)


AnyServed = Served | ServedDefault | ServedLocator
