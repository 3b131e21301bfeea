"""Liveliness tokens of servants and of clients, as text."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from ._values import NAME
from .transport import Target

__all__ = [
    "ServantInfo",
    "ServantToken",
    "any_client",
    "client_token",
    "parse_client_token",
    "parse_servant_token",
    "servant_token",
]


# What we make tokens of; anything else could not be called, and would reach error messages and logs.
_SERVANT: Final = re.compile(
    rf"@servant/({NAME})/({NAME})/(?=[^/]{{1,256}}/)((?:::[A-Za-z_][A-Za-z0-9_]*)+)/([0-9A-Za-z]{{1,64}}|-)/"
    r"([0-9a-f]{1,32})/([0-9]{1,15})"
)
_CLIENT: Final = re.compile(r"@client/[^/]+/([0-9a-f]{1,32})/([0-9a-f]{16}|-)")
_NO_SPACE: Final = "-"


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
    if match is None:
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
