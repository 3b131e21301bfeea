"""The route of each call: within the process, through a channel on this machine, or over the network.

`RoutedCaller` alone chooses it. docs/decisions/0033-local-calls.md says what goes through channels, and why.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Container
from typing import Any, Final, Protocol
from weakref import WeakValueDictionary, ref

from zenoh_ice.carriers._local.channels import Channels, NotSent, Outgoing
from zenoh_ice.carriers._local.server import local_space
from zenoh_ice.data.exceptions import SystemException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import FORMAT, Target, parse_servant_token
from zenoh_ice.routes._given_up import OwnCalls
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.transport import NoAnswer, Outcome, Registration

_MOST_SERVERS: Final = 256
_MOST_TOKENS: Final = 64  # of one target


class Carrier(Protocol):
    """Carries the calls of one operation, over one route."""

    def call(self, payload: bytes, attachment: bytes) -> Outcome:
        """Call and wait for the answer, as `Caller.call` does."""

    def begin(
        self, payload: bytes, attachment: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        """Call without waiting, as `Caller.begin` does; return a function that forgets it."""


class Route:
    """How one target is reached from here: through channels to its only server, or over the network."""

    def __init__(self, find: Callable[[str, str], Channels | None] | None = None) -> None:
        """Make a route that stays with the network unless a function finds the channels to a server."""
        self.channels: Channels | None = None
        self.changed: Final[set[Callable[[], object]]] = set()
        """Called, where they must not wait, whenever the channels are others, or none."""
        self._find: Final = find
        self._servers: Final[dict[str, tuple[str, str]]] = {}  # and their addresses, by token

    def on_token(self, key: str, came: bool) -> None:
        """Note a token of the target: on the transport's thread."""
        if came and len(self._servers) < _MOST_TOKENS:
            token = parse_servant_token(key)
            if token is not None:
                self._servers[key] = token.server, token.address if token.format == FORMAT else ""
        elif not came:
            self._servers.pop(key, None)
        self.choose()

    def choose(self) -> None:
        """Choose again."""
        servers = set(self._servers.values())
        before = self.channels
        self.channels = self._find(*servers.pop()) if self._find and len(servers) == 1 else None
        if self.channels is not before:
            for changed in tuple(self.changed):
                changed()


class Routes:
    """The routes to the targets that a process calls, and its channels to other processes of its machine.

    A route exists as long as somebody uses it: targets come and go.
    """

    def __init__(
        self, watch: Callable[[str, Callable[[str, bool], object]], Registration], limits: Limits = LIMITS
    ) -> None:
        self._limits: Final = limits
        self._watch: Final = watch
        self._space: Final = local_space()
        self._lock: Final = threading.Lock()
        self._routes: Final[WeakValueDictionary[Target, Route]] = WeakValueDictionary()
        self._watches: Final[dict[ref[Route], Registration]] = {}
        self._channels: Final[dict[str, Channels]] = {}  # by server
        self._closed = False

    def route(self, target: Target) -> Route:
        """Return the route to a target."""
        with self._lock:
            if (known := self._routes.get(target)) is not None:
                return known
            route = self._routes[target] = Route(self.channels)
        used = ref(route)

        def note(key: str, came: bool) -> None:
            if (told := used()) is not None:
                told.on_token(key, came)

        watch = self._watch(f"@servant/{target.prefix}/**", note)
        with self._lock:
            self._watches[used] = watch
            # Only here: a route may end anywhere, whatever locks are held there.
            unused = [self._watches.pop(each) for each in tuple(self._watches) if each() is None]
        for each in unused:
            each.close()
        return route

    def channels(self, server: str, address: str) -> Channels | None:
        """Return the channels to a server of an address; None if it is not near."""
        if not self._space or not address.startswith(self._space):
            return None
        with self._lock:
            if self._closed:
                return None
            known = self._channels.get(server)
            if known is None:
                if len(self._channels) >= _MOST_SERVERS:
                    self._channels.pop(next(iter(self._channels))).close()
                known = self._channels[server] = Channels(address, server, self._limits)
            return known

    def lost(self, server: str) -> None:
        """End the calls of a server whose link was lost: it may be frozen."""
        with self._lock:
            channels = self._channels.pop(server, None)
            routes = list(self._routes.values())
        if channels is None:
            return
        # First: what it was sent and has not read must not be executed after later calls.
        channels.close()
        for route in routes:
            if route.channels is channels:
                route.choose()

    def close(self) -> None:
        """End all calls."""
        with self._lock:
            self._closed = True
            all_channels = list(self._channels.values())
        for channels in all_channels:
            channels.close()


class RoutedCaller:
    """Call one operation of one target, each time over the fastest route that keeps their order."""

    def __init__(
        self,
        calls: OwnCalls,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None,
        served_here: Container[str],
        here: Carrier,
        route: Route,
        network: Carrier,
    ) -> None:
        self.timeout: Final = timeout
        self._calls: Final = calls
        self._target: Final = target
        self._prefix: Final = target.prefix
        self._fingerprint: Final = fingerprint
        self._served_here: Final = served_here
        self._here: Final = here
        self._route: Final = route
        self._network: Final = network
        what = f"reply of {target.identity}.{operation.name}"
        self._outgoing: Final = Outgoing(
            self._prefix, operation.name, timeout, operation.result.size_limit, what
        )

    def call(self, payload: bytes) -> Outcome:
        """Call as `Caller.call` says."""
        calls, target = self._calls, self._target
        number = next(calls.numbers)
        # The route first: calls that took another one were answered by then, or are named as given up.
        here = self._prefix in self._served_here
        channels = None if here or target in calls.unanswered else self._route.channels
        try:
            attachment, named = calls.attach(target, number, self._fingerprint, self.timeout)
            if channels is not None:
                try:
                    outcome = channels.call(self._outgoing, payload, attachment)
                except NotSent:
                    attachment, named = calls.attach(target, number, self._fingerprint, self.timeout)
                    outcome = self._network.call(payload, attachment)
            else:
                outcome = (self._here if here else self._network).call(payload, attachment)
        except BaseException:  # an interrupt, too
            calls.give_up(target, number)
            raise
        if named and outcome[0]:  # a refused one may not have been read
            calls.heard(target, named)
        return outcome

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        """Begin a call as `Caller.begin` says: over the network, which keeps the order of what it carries."""
        calls, target = self._calls, self._target
        number = next(calls.numbers)
        calls.begin(target, number)

        def end(outcome: Outcome | SystemException) -> None:  # on a thread of the pool
            # Before others may take another route: they are to name it.
            if isinstance(outcome, NoAnswer):
                calls.give_up(target, number)
            elif named and not isinstance(outcome, SystemException) and outcome[0]:
                calls.heard(target, named)
            calls.end(target, number)
            done(outcome)

        try:
            attachment, named = calls.attach(target, number, self._fingerprint, self.timeout)
            cancel = self._network.begin(payload, attachment, end)
        except BaseException:  # an interrupt, too
            calls.give_up(target, number)
            calls.end(target, number)
            raise

        def give_up() -> None:
            calls.give_up(target, number)
            cancel()

        return give_up
