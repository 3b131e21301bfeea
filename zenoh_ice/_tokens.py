"""Liveliness tokens: their syntax, and the servants that are there, and those that were, as tokens show.

All is bounded, whatever tokens a stranger declares.
"""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Mapping
from typing import Final, NamedTuple

from ._values import NAME
from .transport import Target

__all__ = [
    "ABSENT",
    "ServantInfo",
    "ServantTable",
    "ServantToken",
    "any_client",
    "client_token",
    "parse_client_token",
    "parse_servant_token",
    "servant_token",
]

_MAX_SERVANTS: Final = 4096
_MAX_INTERFACES: Final = 64  # of one servant
_MAX_SERVERS: Final = 64  # of one identity
_MAX_TOKENS: Final = 1 << 14  # of all servants
_LONGEST_TYPE_ID: Final = 256

# What we make tokens of; anything else could not be called, and would reach error messages and logs.
_SERVANT: Final = re.compile(
    rf"@servant/({NAME})/({NAME})/((?:::[A-Za-z_][A-Za-z0-9_]*)+)/([0-9A-Za-z]{{1,64}}|-)/"
    r"([0-9a-f]{1,32})/([0-9]{1,15})"
)
_CLIENT: Final = re.compile(r"@client/[^/]+/([0-9a-f]{1,32})/([0-9a-f]{16}|-)")
_NO_SPACE: Final = "-"
_NEVER: Final = (-1.0, "")

_logger = logging.getLogger(__name__)

ABSENT: Final[Mapping[str, str]] = {}
"""The interfaces of a servant that is not there."""


class ServantToken(NamedTuple):
    """A token of a servant: a session serves a target with an interface."""

    target: Target
    type_id: str
    fingerprint: str
    """Of the interface; empty for one that has none."""
    server: str
    """Id of the session."""
    since: float
    """Wall time of the server's machine since when it does, in s since the epoch."""


def servant_token(target: Target, type_id: str, fingerprint: str, server: str, since: float) -> str:
    """Return the key of the token that a servant holds for one of its interfaces."""
    # An empty chunk is no key: an interface without a fingerprint gives a dash.
    who = f"{target.realm}/{target.identity}"
    return f"@servant/{who}/{type_id}/{fingerprint or '-'}/{server}/{round(since * 1000)}"


def parse_servant_token(key: str) -> ServantToken | None:
    """Return what the key of a token says; None for one that no servant of ours has."""
    match = _SERVANT.fullmatch(key)
    if match is None or len(match[3]) > _LONGEST_TYPE_ID:
        return None
    realm, identity, type_id, fingerprint, server, since = match.groups()
    fingerprint = "" if fingerprint == "-" else fingerprint
    return ServantToken(Target(realm, identity), type_id, fingerprint, server, int(since) / 1000)


def client_token(realm: str, client: str, memory_space: str = "") -> str:
    """Return the key of the token that a client holds; the space says whose memory it can read."""
    return f"@client/{realm}/{client}/{memory_space or _NO_SPACE}"


def any_client(realm: str) -> str:
    """Return the pattern of the tokens of all clients of a realm."""
    return f"@client/{realm}/*/*"


def parse_client_token(key: str) -> tuple[str, str] | None:
    """Return client and memory space of a token; None for a key that no client has."""
    match = _CLIENT.fullmatch(key)
    return match and (match[1], "" if match[2] == _NO_SPACE else match[2])


class ServantInfo(NamedTuple):
    """A servant that is there, as its tokens show."""

    identity: str
    interfaces: dict[str, str]
    """The fingerprint of each of its interfaces by type id."""
    server: str
    """Id of the session that serves it."""
    since: float
    """Wall time of the server's machine since when it does, in s since the epoch."""


class ServantTable:
    """Servants by target. A lock is held to change it or go through it; looking one up needs none."""

    def __init__(self) -> None:
        self.interfaces: Final[dict[Target, Mapping[str, str]]] = {}
        """The fingerprints of the interfaces of each servant by type id."""
        self.servers: Final[dict[Target, dict[str, ServantInfo]]] = {}
        """Who serves each target, by the ids of their sessions."""
        self._lost: Final[dict[Target, tuple[float, str]]] = {}  # when, and who served it last
        self._came: Final[dict[Target, float]] = {}  # of those that are there
        self._tokens = 0

    def holds(self, realm: str) -> bool:
        """Return whether anything is served in a realm."""
        return any(target.realm == realm for target in self.interfaces)

    def serves(self, server: str) -> bool:
        """Return whether a session serves anything."""
        return any(server in servers for servers in self.servers.values())

    def lost_at(self, target: Target) -> float:
        """Return when a target, or one of several servers of it, was lost last; -1 when never."""
        return self._lost.get(target, _NEVER)[0]

    def came_at(self, target: Target) -> float:
        """Return when a target came that is there; -1 for one that is not."""
        return self._came.get(target, -1.0)

    def last_server(self, target: Target) -> str:
        """Return the id of the session that served what was lost; empty when nothing was."""
        return self._lost.get(target, _NEVER)[1]

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
        servers[token.server] = ServantInfo(target.identity, interfaces, token.server, token.since)
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
