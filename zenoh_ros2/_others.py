"""The other ends of a topic or a service, and warnings of those that nothing passes to or from.

In Zenoh the type of messages and its hash are part of the key: ends that differ in them never hear each
other, and do not know it.
"""

from __future__ import annotations

import threading
from collections.abc import Collection
from typing import Final

from ._graph import Discovery, EndpointsOf
from ._refusals import Refusals
from ._wire import Entity, EntityKind
from ._workers import join_all

_MOST_NAMED: Final = 1024
_OPPOSITE: Final[dict[EntityKind, EntityKind]] = {"MP": "MS", "MS": "MP", "SS": "SC", "SC": "SS"}
_WORDS: Final[dict[EntityKind, tuple[str, str, str]]] = {
    "MP": ("a publisher is not heard", "publishes", "expected"),
    "MS": ("a subscription hears nothing", "subscribes to", "published"),
    "SS": ("a server is not called", "serves", "called"),
    "SC": ("a client is not answered", "calls", "served"),
}


class OtherEnds(EndpointsOf):
    """The ends of the opposite kind; those that do not fit are named in the log, once each."""

    def __init__(self, discovery: Discovery, own: Entity, besides: Collection[str] = ()) -> None:
        """Follow the other ends of an end's topic or service until `close`.

        Those of the types `besides` are left to other ends of its node.
        """
        self._own: Final = own
        self._delay: Final = discovery.limits.announcement
        self._besides: Final = frozenset(besides) - {own.type_name}
        kind = _OPPOSITE[own.kind]
        what, self._does, self._done = _WORDS[kind]
        self._unheard: Final = Refusals(own.name, what)
        self._named: set[Entity] = set()
        self._timing: Final = threading.Lock()
        self._timer: threading.Timer | None = None
        self._ended = False
        super().__init__(discovery, kind, own.name, self._meet)

    def fitting(self) -> list[Entity]:
        """Return those that messages pass to or from."""
        return [each for each in self.all() if self._own.fits(each)]

    def close(self) -> None:
        """Stop following, and name no more."""
        super().close()
        with self._timing:
            self._ended, timer = True, self._timer
        if timer is not None:
            timer.cancel()
            join_all([timer])

    def _meet(self, other: Entity) -> None:
        """Look soon, when the other ends of its node are known, whether one that came is heard."""
        if self._own.fits(other) or other.type_name in self._besides:
            return
        with self._timing:
            if self._timer is not None or self._ended:
                return
            timer = threading.Timer(self._delay, self._name_strangers)
            timer.daemon = True
            try:
                timer.start()
            except RuntimeError as error:  # at a limit of threads
                self._unheard.add(error)
            else:
                self._timer = timer

    def _name_strangers(self) -> None:
        with self._timing:
            self._timer = None
        others = {*self.all()}
        fitting = {each for each in others if self._own.fits(each)}
        hearing = {(each.session, each.node_id) for each in fitting if each.kind == "MS"}
        strangers = [
            each
            for each in others - fitting - self._named
            if each.type_name not in self._besides and (each.session, each.node_id) not in hearing
        ]
        if len(self._named) >= _MOST_NAMED:
            self._named.clear()
        self._named.update(strangers)
        if strangers:
            self._unheard.add("; ".join(map(self._difference, strangers)))

    def _difference(self, other: Entity) -> str:
        own = self._own.type_name
        if other.type_name != own:
            return f"{other.node_name} {self._does} {other.type_name}, {own} is {self._done}"
        version = f"{other.node_name} {self._does} {own} with the hash {other.type_hash}"
        return f"{version}, of another definition or distribution (ROS_DISTRO)"
