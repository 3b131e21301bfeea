"""The servants that are there, and those that were, as tokens tell: bounded, whatever comes."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from typing import Final, NamedTuple

from ..identity import Target
from .servant_tokens import ServantToken

__all__ = ["ABSENT", "ServantInfo", "ServantTable"]

_MAX_SERVANTS: Final = 4096
_MAX_INTERFACES: Final = 64  # of one servant
_MAX_SERVERS: Final = 64  # of one identity
_MAX_TOKENS: Final = 1 << 14  # of all servants

_NEVER: Final = (-1.0, "")

_logger = logging.getLogger(__name__)

ABSENT: Final[dict[str, str]] = {}
"""The interfaces of a servant that is not there."""


class ServantInfo(NamedTuple):
    """A servant that is there, as its tokens tell."""

    identity: str
    """The identity as text."""
    facet: str
    interfaces: dict[str, str]
    """The fingerprint of each of its interfaces by type id."""
    server: str
    """Id of the session that serves it."""
    since: float
    """Wall time of the server's machine since when it does, in s since the epoch."""
    replicated: bool
    """Whether others may serve the identity beside it."""


class ServantTable:
    """Servants by target. Whoever changes it, or goes through it, holds a lock; looking one up needs none."""

    def __init__(self) -> None:
        self.interfaces: Final[dict[Target, dict[str, str]]] = {}
        """The fingerprints of the interfaces of each servant by type id."""
        self.servers: Final[dict[Target, dict[str, ServantInfo]]] = {}
        """Who serves each target, by the ids of their sessions."""
        self._lost: Final[dict[Target, tuple[float, str]]] = {}  # when, and who served it last
        self._came: Final[dict[Target, float]] = {}  # of those that are there
        self._tokens = 0

    def holds(self, realm: str) -> bool:
        """Return whether anything is served in a realm."""
        return any(target.realm == realm for target in self.interfaces)

    def serving(self, target: Target) -> Target:
        """Return what has the tokens: a target, or what stands for it where it has no servant of its own."""
        if target not in self.interfaces:
            for stand_in in target.stand_ins:
                if stand_in in self.interfaces:
                    return stand_in
        return target

    def reachable(self, target: Target) -> dict[str, str]:
        """Return the interfaces of whoever serves a target, a default servant perhaps."""
        return self.interfaces.get(target) or self.interfaces.get(self.serving(target), ABSENT)

    def serves(self, server: str) -> bool:
        """Return whether a session serves anything."""
        return any(server in servers for servers in self.servers.values())

    def lost_at(self, target: Target) -> float:
        """Return when a target, or what stands for it, was lost last; -1 when never."""
        return max(self._lost.get(each, _NEVER)[0] for each in (target, *target.stand_ins))

    def came_at(self, target: Target) -> float:
        """Return when whoever serves a target, or else what stands for it, came; -1 when nobody is there."""
        return self._came.get(self.serving(target), -1.0)

    def last_server(self, target: Target) -> str:
        """Return the id of the session that served what was lost; empty when nothing was."""
        servers = (self._lost.get(each, _NEVER)[1] for each in (target, *target.stand_ins))
        return next(filter(None, servers), "")

    def add(self, token: ServantToken) -> None:
        """Note a token that has come."""
        target = token.target
        if target not in self.servers and len(self.servers) >= _MAX_SERVANTS:
            return  # no robot has so many: somebody floods the realm
        servers = self.servers.get(target, {})
        if token.server not in servers and len(servers) >= _MAX_SERVERS:
            return
        info = servers.get(token.server)
        # Replaced rather than changed: readers take no lock.
        interfaces = {} if info is None else dict(info.interfaces)
        if token.type_id not in interfaces:
            if len(interfaces) >= _MAX_INTERFACES or self._tokens >= _MAX_TOKENS:
                return
            self._tokens += 1
        interfaces[token.type_id] = token.fingerprint
        servers[token.server] = ServantInfo(
            target.identity, target.facet, interfaces, token.server, token.since, token.replicated
        )
        self.servers[target] = servers
        if target not in self.interfaces:
            self._came[target] = time.monotonic()
            if target in self._lost:
                _logger.info("%s is back", target)
        self.interfaces[target] = _merged(servers)

    def remove(self, token: ServantToken) -> None:
        """Note a token that has gone."""
        target, server = token.target, token.server
        servers = self.servers.get(target, {})
        info = servers.get(server)
        if info is None or info.interfaces.get(token.type_id) != token.fingerprint:
            return
        self._tokens -= 1
        interfaces = {known: value for known, value in info.interfaces.items() if known != token.type_id}
        if interfaces:
            servers[server] = info._replace(interfaces=interfaces)
        else:
            del servers[server]
            if target not in self._lost and len(self._lost) >= _MAX_SERVANTS:
                del self._lost[next(iter(self._lost))]
            self._lost[target] = time.monotonic(), server
        if servers:
            self.interfaces[target] = _merged(servers)
        else:
            del self.servers[target], self.interfaces[target], self._came[target]
            _logger.info("%s is gone", target)


def _merged(servers: Mapping[str, ServantInfo]) -> dict[str, str]:
    """Return the interfaces that an identity has; where its servers differ, those of the first of them."""
    merged: dict[str, str] = {}
    for info in sorted(servers.values(), key=lambda info: (info.since, info.server), reverse=True):
        merged |= info.interfaces
    return merged
