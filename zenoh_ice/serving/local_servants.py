"""What this process serves, for its own proxies: their calls need not leave it."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Final

from ..identity import Target
from .default_incoming import BoundIncoming, DefaultServantIncoming
from .incoming import Incoming
from .locator_incoming import LocatorIncoming

if TYPE_CHECKING:
    from .served import AnyIncoming

__all__ = ["LocalServants"]


class LocalServants:
    """All that is served here, by target. Readers take no lock."""

    def __init__(self) -> None:
        self._lock: Final = threading.Lock()
        self._own: Final[dict[Target, Incoming]] = {}
        self._defaults: Final[dict[Target, DefaultServantIncoming | LocatorIncoming]] = {}

    def add(self, incoming: AnyIncoming) -> bool:
        """Note what takes the calls of its target; return False when something does already."""
        with self._lock:
            if incoming.target in self._own or incoming.target in self._defaults:
                return False
            if isinstance(incoming, Incoming):
                self._own[incoming.target] = incoming
            else:
                self._defaults[incoming.target] = incoming
            return True

    def remove(self, incoming: AnyIncoming) -> None:
        """Forget what takes the calls of its target."""
        with self._lock:
            for served in (self._own, self._defaults):
                if served.get(incoming.target) is incoming:
                    del served[incoming.target]

    def get(self, target: Target) -> Incoming | BoundIncoming | None:
        """Return who serves a target here: its own servant, or the default of its category or of all."""
        own = self._own.get(target)
        if own is not None or not self._defaults:
            return own
        for stand_in in target.stand_ins:
            default = self._defaults.get(stand_in)
            if default is not None and default.serves(target):
                return BoundIncoming(default, target)
        return None

    def __contains__(self, target: Target) -> bool:
        """Return whether a target, or all names of a category, have a servant of their own here."""
        return target in self._own or target in self._defaults

    def all(self) -> list[AnyIncoming]:
        """Return all that is served."""
        with self._lock:
            return [*self._own.values(), *self._defaults.values()]
