"""The ways to targets: through the door of a neighbor, or over the network."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Final
from weakref import WeakSet

from .._given_up import OwnCalls
from .._pool import Pool
from .._token_keys import FORMAT, parse_servant_token
from ..limits import LIMITS, Limits
from ..transport import Target
from .channel import Channel
from .door import door_space
from .neighbors import Neighbor

_MOST_NEIGHBORS: Final = 256
_MOST_TOKENS: Final = 64  # of one target


class Route:
    """The way to one target: through the door of its only server, or over the network.

    Calls of one client stay in order: none takes another way than those before it that are not answered.
    """

    def __init__(self, neighborhood: Neighborhood, give_up: Callable[[int], object]) -> None:
        self.neighbor: Neighbor | None = None
        self.of_channel: Neighbor | None = None
        """The one to which the calls in the channel went."""
        self.changed: Final[set[Callable[[], object]]] = set()
        """Called, where they must not wait, whenever the neighbor is another one, or none."""
        self.in_channel: Final[set[int]] = set()
        """The numbers of calls in flight."""
        self.over_network: Final[dict[int, float]] = {}
        """The same, with the moments of the monotonic clock at which they end in any case."""
        self._neighborhood: Final = neighborhood
        self._give_up: Final = give_up
        self._doors: Final[dict[str, tuple[str, str]]] = {}

    def on_token(self, key: str, came: bool) -> None:
        """Note a token of the target: on the transport's thread."""
        if came and len(self._doors) < _MOST_TOKENS:
            token = parse_servant_token(key)
            if token is not None:
                self._doors[key] = token.server, token.door if token.format == FORMAT else ""
        elif not came:
            self._doors.pop(key, None)
        self.choose()

    def choose(self) -> None:
        """Choose the neighbor again."""
        doors = set(self._doors.values())
        before = self.neighbor
        self.neighbor = self._neighborhood.neighbor(*doors.pop()) if len(doors) == 1 else None
        if self.neighbor is not before:
            for changed in tuple(self.changed):
                changed()

    @property
    def way(self) -> Neighbor | None:
        """The neighbor that the next call goes to; None if it goes over the network."""
        if self.over_network:
            now = time.monotonic()
            for call, end in self.over_network.copy().items():
                if end <= now:
                    self._give_up(call)
                    self.over_network.pop(call, None)
            if self.over_network:
                return None
        return self.of_channel if self.in_channel else self.neighbor


class Neighborhood:
    """The neighbors of a process, and the routes to the targets that it calls."""

    def __init__(
        self,
        pool: Pool,
        watch: Callable[[str, Callable[[str, bool], object]], object],
        calls: OwnCalls,
        limits: Limits = LIMITS,
    ) -> None:
        self._pool: Final = pool
        self._calls: Final = calls
        self._limits: Final = limits
        self._watch: Final = watch
        self._space: Final = door_space()
        self._lock: Final = threading.Lock()
        self._routes: Final[dict[Target, Route]] = {}
        self._neighbors: Final[dict[str, Neighbor]] = {}
        self._ending: Final[WeakSet[Channel]] = WeakSet()  # of lost neighbors, while the pool has them
        self._closed = False

    def route(self, target: Target) -> Route:
        """Return the route to a target."""
        with self._lock:
            if (known := self._routes.get(target)) is not None:
                return known
            route = self._routes[target] = Route(self, partial(self._calls.give_up, target))
        self._watch(f"@servant/{target.prefix}/**", route.on_token)
        return route

    def neighbor(self, server: str, door: str) -> Neighbor | None:
        """Return the neighbor that serves at a door; None if it is none."""
        if not self._space or not door.startswith(self._space):
            return None
        with self._lock:
            if self._closed:
                return None
            known = self._neighbors.get(server)
            if known is None:
                if len(self._neighbors) >= _MOST_NEIGHBORS:
                    self._neighbors.pop(next(iter(self._neighbors))).close()
                known = self._neighbors[server] = Neighbor(self._pool, door, server, self._limits)
            return known

    def lost(self, server: str) -> None:
        """End the calls of a neighbor whose link was lost: it may be frozen."""
        with self._lock:
            neighbor = self._neighbors.pop(server, None)
            routes = list(self._routes.values())
        if neighbor is None:
            return
        # First: what it was sent and has not read must not be executed after later calls.
        if (channel := neighbor.shut()) is not None:
            self._pool.submit(partial(self._let_end, channel))
        for route in routes:
            if route.neighbor is neighbor:
                route.choose()

    def close(self) -> None:
        """End all calls."""
        with self._lock:
            self._closed = True
            neighbors = list(self._neighbors.values())
            ending = list(self._ending)
        for each in neighbors:
            each.close()
        for channel in ending:
            channel.close()

    def abandon(self) -> None:
        """Close all files in a forked child."""
        for each in self._neighbors.values():
            each.abandon()
        for channel in self._ending:
            channel.abandon()

    def _let_end(self, channel: Channel) -> None:
        with self._lock:
            self._ending.add(channel)
        if self._closed:
            channel.close()
