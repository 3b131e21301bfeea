"""The liveliness tokens by which servants are known: their keys, made and read."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from ..identity import ANY_NAME, NAME, Target

__all__ = ["ServantToken", "parse_token", "servant_token"]

# What we make tokens of; anything else could not be called, and would reach error messages and logs.
_KEY: Final = re.compile(
    rf"@servant/({NAME})/((?:{NAME}/)?(?:{NAME}|{ANY_NAME}))(?:/\+({NAME}))?/"
    r"((?:::[A-Za-z_][A-Za-z0-9_]*)+)/([0-9A-Za-z]{1,64}|-)/(~?)([0-9a-f]{1,32})/([0-9]{1,15})"
)
_LONGEST_TYPE_ID: Final = 256


class ServantToken(NamedTuple):
    """What a token tells: that a session serves a target with an interface."""

    target: Target
    type_id: str
    fingerprint: str
    """Of the interface; empty for one that has none."""
    server: str
    """Id of the session."""
    since: float
    """Wall time of the server's machine since when it does, in s since the epoch."""
    replicated: bool
    """Whether others may serve the target beside it."""


def servant_token(
    target: Target,
    type_id: str,
    fingerprint: str,
    server: str,
    since: float,
    *,
    replicated: bool = False,
) -> str:
    """Return the key of the token that a servant holds for one of its interfaces.

    `server` is the id of its session, `since` the wall time in s since when it is served.
    """
    # An empty chunk is no key: an interface without a fingerprint gives a dash.
    who = f"~{server}" if replicated else server
    return f"@servant/{target.prefix}{type_id}/{fingerprint or '-'}/{who}/{round(since * 1000)}"


def parse_token(key: str) -> ServantToken | None:
    """Return what the key of a token tells; None for one that no servant of ours has."""
    match = _KEY.fullmatch(key)
    if match is None or len(match[4]) > _LONGEST_TYPE_ID:
        return None
    realm, identity, facet, type_id, fingerprint, replicated, server, since = match.groups()
    return ServantToken(
        Target(realm, identity, facet or ""),
        type_id,
        "" if fingerprint == "-" else fingerprint,
        server,
        int(since) / 1000,
        bool(replicated),
    )
