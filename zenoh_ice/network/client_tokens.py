"""The liveliness tokens of communicators: who is there, and whose memory each of them can read."""

from __future__ import annotations

import re
from typing import Final

__all__ = ["any_client", "client_token", "parse_client_token"]

_TOKEN: Final = re.compile(r"@client/[^/]+/([0-9a-f]{1,32})/([0-9a-f]{16}|-)")
_NO_SPACE: Final = "-"


def client_token(realm: str, client: str, memory_space: str = "") -> str:
    """Return the key of the token that a communicator holds; see `wire.memory_file` for the space."""
    return f"@client/{realm}/{client}/{memory_space or _NO_SPACE}"


def any_client(realm: str) -> str:
    """Return the key expression of the tokens of all communicators of a realm."""
    return f"@client/{realm}/*/*"


def parse_client_token(key: str) -> tuple[str, str] | None:
    """Return client and memory space of a token; None for a key that no communicator has."""
    match = _TOKEN.fullmatch(key)
    return match and (match[1], "" if match[2] == _NO_SPACE else match[2])
