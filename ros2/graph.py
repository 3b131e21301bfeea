"""The graph: the nodes that exist, and the topics and services that each uses."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable
from typing import Final

import zenoh
from zenoh.handlers import Callback

from .wire import SPACE, Entity, EntityKind

_MOST_ENTITIES: Final = 20_000

_logger = logging.getLogger(__name__)


class Graph:
    """The graph of a domain, according to its liveliness tokens."""

    def __init__(self, session: zenoh.Session, domain: int) -> None:
        """Read all tokens, and follow their changes."""
        self._changed: Final = threading.Condition()
        self._entities: dict[str, Entity] = {}
        self._subscriber = session.liveliness().declare_subscriber(
            f"{SPACE}/{domain}/**", Callback(self._receive, indirect=False), history=True
        )

    def close(self) -> None:
        """Stop following."""
        self._subscriber.undeclare()

    def wait(self, holds: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition on the graph holds; return whether it does within `timeout` s."""
        with self._changed:
            return self._changed.wait_for(holds, timeout)

    def entities(self, kind: EntityKind | None = None) -> list[Entity]:
        """Return all entities, or those of a kind."""
        with self._changed:
            found = [*self._entities.values()]
        return [each for each in found if kind is None or each.kind == kind]

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

    def publishers(self, topic: str) -> list[Entity]:
        """Return the publishers of a topic."""
        return [each for each in self.entities("MP") if each.name == topic]

    def subscriptions(self, topic: str) -> list[Entity]:
        """Return the subscriptions of a topic."""
        return [each for each in self.entities("MS") if each.name == topic]

    def servers(self, service: str) -> list[Entity]:
        """Return the servers of a service."""
        return [each for each in self.entities("SS") if each.name == service]

    def _receive(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        with self._changed:
            if sample.kind == zenoh.SampleKind.DELETE:
                self._entities.pop(token, None)
            elif (entity := Entity.parse(token)) is None:
                _logger.debug("a token that is none of rmw_zenoh: %.300s", token)
            elif len(self._entities) < _MOST_ENTITIES:
                self._entities[token] = entity
            self._changed.notify_all()


def _types(entities: Iterable[Entity]) -> dict[str, list[str]]:
    found: dict[str, set[str]] = {}
    for each in entities:
        if "/_action/" not in each.name:
            found.setdefault(each.name, set()).add(each.type_name)
    return {name: sorted(found[name]) for name in sorted(found)}
