"""The graph: the nodes that exist, and the topics and services that each uses.

A node asks only for the tokens that it needs, up to some hundreds, and handles them on a separate thread:
anybody may declare thousands.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Iterable
from typing import Final

import zenoh

from zenoh_ice.carriers.zenoh.tokens import Tokens

from ._limits import LIMITS, NodeLimits
from ._wire import SPACE, Entity, EntityKind, gid_of, tokens_of
from ._workers import Job

MOST_OF_A_NAME: Final = 256
"""Maximum entities of one kind that are counted of one topic or service."""
MOST_ENTITIES: Final = 2000
"""Maximum entities that are counted of a whole graph."""
_UNANNOUNCED: Final = 0.8
"""Seconds in which the token of an entity that sent something arrives."""
_CHECK_PERIOD: Final = 0.5
"""Seconds after which a waiting caller looks again: only then are tokens asked for again."""

_logger = logging.getLogger(__name__)


class Discovery:
    """What following tokens needs: a session, a thread that handles them, and waiting for changes."""

    def __init__(
        self,
        session: zenoh.Session,
        domain: int,
        submit: Callable[[Job], object],
        limits: NodeLimits = LIMITS,
    ) -> None:
        """Follow tokens of a domain; `submit` runs a job on a thread that is none of Zenoh's."""
        self.session: Final = session
        self.domain: Final = domain
        self.submit: Final = submit
        self.limits: Final = limits
        self.changed: Final = threading.Condition()

    def wait(self, holds: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition on tokens holds; return whether it does within `timeout` s."""
        deadline = time.monotonic() + timeout
        with self.changed:
            while not self.changed.wait_for(holds, min(_CHECK_PERIOD, max(0.0, deadline - time.monotonic()))):
                if time.monotonic() >= deadline:
                    return False
            return True


class Entities:
    """The entities whose tokens match a key expression, up to a number. Thread-safe.

    If more exist, it stops following them, because thousands would keep Zenoh busy, and asks again later.
    """

    def __init__(
        self,
        discovery: Discovery,
        tokens: str,
        what: str,
        most: int,
        came: Callable[[Entity], object] | None = None,
    ) -> None:
        """Follow the tokens until `close`; `what` names the entities in the log.

        `came` gets each entity that comes, on the thread of the discovery.
        """
        self._discovery: Final = discovery
        self._tokens: Final = tokens
        self._what: Final = what
        self._most: Final = most
        self._came: Final = came
        self._lock: Final = threading.Lock()
        self._news: dict[str, bool] = {}
        """Whether a token exists, for those that changed and were not handled yet."""
        self._known: dict[str, Entity] = {}
        self._full = False
        """Whether some tokens were left out."""
        self._warned = False
        self._closed = False
        self._pause = discovery.limits.query_delay
        self._again = math.inf
        """When to ask again, by the monotonic clock."""
        self._following: Tokens | None = None
        self._ask()

    def all(self) -> list[Entity]:
        """Return the entities that exist."""
        with self._lock:
            self._ask_if_due()
            return [*self._known.values()]

    def __len__(self) -> int:
        """Return how many entities exist, as far as they are counted."""
        with self._lock:
            self._ask_if_due()
            return len(self._known)

    def has(self, gid: bytes) -> bool:
        """Return whether the entity with an id is known to exist, by the ids in attachments."""
        with self._lock:
            self._ask_if_due()
            tokens = [] if self._full else [*self._known]
        return any(gid_of(token) == gid for token in tokens)

    def close(self) -> None:
        """Stop following."""
        with self._lock:
            self._closed = True
            following, self._following = self._following, None
        if following is not None:
            following.close()

    def _note(self, token: str, exists: bool) -> None:
        """Keep a change, if it is one, until `_handle`."""
        with self._lock:
            is_news = exists is not self._news.get(token, token in self._known)
            if self._closed or self._full or not is_news:
                return
            is_first = not self._news
            self._news[token] = exists
            self._full = len(self._news) > self._most
        if is_first:
            self._discovery.submit(self._handle)

    def _handle(self) -> None:
        """Handle all changes since the last time."""
        came: list[Entity] = []
        with self._lock:
            news, self._news = self._news, {}
            for token, exists in news.items():
                if not exists:
                    self._known.pop(token, None)
                elif len(self._known) >= self._most:
                    self._full = True
                elif (entity := Entity.parse(token)) is not None:
                    self._known[token] = entity
                    came.append(entity)
                else:
                    _logger.debug("a token that is none of rmw_zenoh: %.300s", token)
            following = self._following if self._full else None
            warns = self._full and not self._warned
            if following is not None:
                self._following, self._warned = None, True
                self._again = time.monotonic() + self._pause
                self._pause = min(2 * self._pause, self._discovery.limits.longest_query_delay)
        if following is not None:
            following.close()
        if warns:
            most = f"more than {self._most} exist; the others are not counted, and each counts as gone"
            _logger.warning("%s: %s, until fewer exist", self._what, most)
        if self._came is not None:
            for entity in came:
                self._came(entity)
        with self._discovery.changed:
            self._discovery.changed.notify_all()

    def _ask_if_due(self) -> None:
        if time.monotonic() >= self._again:
            self._again = math.inf
            self._discovery.submit(self._ask)

    def _ask(self) -> None:
        """Ask for all tokens, and follow their changes."""
        with self._lock:
            self._known.clear()
            self._full = False
        discovery = self._discovery
        following = Tokens(discovery.session, self._tokens, self._note, discovery.submit)
        with self._lock:
            closed, full = self._closed, self._full
            if not closed:
                self._following = following
        if closed:
            following.close()
        elif full:
            discovery.submit(self._handle)


class EndpointsOf(Entities):
    """The entities of one kind that use a topic or a service."""

    def __init__(
        self,
        discovery: Discovery,
        kind: EntityKind,
        name: str,
        came: Callable[[Entity], object] | None = None,
    ) -> None:
        tokens, what = tokens_of(discovery.domain, kind, name), f"{name}: its {_KINDS[kind]}"
        super().__init__(discovery, tokens, what, MOST_OF_A_NAME, came)


class Sender:
    """The entity that sent a message or a request: what obeys it may have to stop at its end."""

    def __init__(self, others: Entities, gid: bytes) -> None:
        """Follow the entity with an id, one of some others."""
        self._others: Final = others
        self._gid: Final = gid
        self._begun: Final = time.monotonic()
        self._seen = False

    @property
    def gone(self) -> bool:
        """Return whether it does not exist: it has ended, or it was not announced in time."""
        if self._others.has(self._gid):
            self._seen = True
            return False
        return self._seen or time.monotonic() - self._begun > _UNANNOUNCED


_KINDS: Final[dict[EntityKind, str]] = {
    "MP": "publishers",
    "MS": "subscriptions",
    "SS": "servers",
    "SC": "clients",
}


class Graph(Entities):
    """All entities of a domain. For tools: to use some names, `EndpointsOf` is enough."""

    def __init__(self, discovery: Discovery) -> None:
        """Ask for all tokens, and follow their changes."""
        super().__init__(discovery, f"{SPACE}/{discovery.domain}/**", "the graph of ROS", MOST_ENTITIES)

    def wait(self, holds: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition on the graph holds; return whether it does within `timeout` s."""
        return self._discovery.wait(holds, timeout)

    def entities(self, kind: EntityKind | None = None, name: str | None = None) -> list[Entity]:
        """Return all entities, or those of a kind, or of the topic or service of a name."""
        return [each for each in self.all() if kind in (None, each.kind) and name in (None, each.name)]

    def nodes(self) -> list[str]:
        """Return the full names of all nodes, sorted."""
        return sorted({each.node_name for each in self.entities("NN")})

    def topics(self) -> dict[str, list[str]]:
        """Return the types of each topic, without those of actions."""
        return _types(each for each in self.entities() if each.kind in ("MP", "MS"))

    def services(self) -> dict[str, list[str]]:
        """Return the types of each service that is served, without those of actions."""
        return _types(self.entities("SS"))

    def actions(self) -> dict[str, list[str]]:
        """Return the types of each action that is served."""
        goals = [each for each in self.entities("SS") if each.name.endswith("/_action/send_goal")]
        found: dict[str, set[str]] = {}
        for each in goals:
            name = each.name.removesuffix("/_action/send_goal")
            found.setdefault(name, set()).add(each.type_name.removesuffix("_SendGoal"))
        return {name: sorted(found[name]) for name in sorted(found)}


def _types(entities: Iterable[Entity]) -> dict[str, list[str]]:
    found: dict[str, set[str]] = {}
    for each in entities:
        if "/_action/" not in each.name:
            found.setdefault(each.name, set()).add(each.type_name)
    return {name: sorted(found[name]) for name in sorted(found)}
