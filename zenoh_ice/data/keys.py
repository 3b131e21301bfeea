"""The keys of operations, and those of liveliness tokens, by which servants and clients are announced."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.data.values import NAME

FORMAT: Final = 1
"""Of calls, samples and tokens: one more with each change that older programs cannot read."""

# The characters of our tokens; other names could not be called, and would reach error messages and logs.
_SERVANT: Final = re.compile(
    rf"@servant/({NAME})/({NAME})/(?=[^/]{{1,256}}/)((?:::[A-Za-z_][A-Za-z0-9_]*)+)/([0-9A-Za-z]{{1,64}}|-)/"
    r"([0-9a-f]{1,32})/([0-9]{1,15})(?:/(-|[0-9a-f]{16}\.[0-9]{1,10}\.[0-9]{1,10})(?:/([0-9]{1,4}))?)?"
)
_CLIENT: Final = re.compile(r"@client/[^/]+/([0-9a-f]{1,32})")
# What tokens of all versions have in common; the last part names the server in those that say it.
_ANY_SERVANT: Final = re.compile(
    rf"@servant/({NAME})/{NAME}/(?:::[A-Za-z_][A-Za-z0-9_]*)+/[0-9A-Za-z-]{{1,64}}(?:/([0-9a-f]{{1,32}}))?(?:/.*)?"
)


class Target(NamedTuple):
    """The address of a call; as text `identity@realm`."""

    realm: str
    identity: str

    def __str__(self) -> str:
        return f"{self.identity}@{self.realm}"

    @property
    def prefix(self) -> str:
        """Prefix of the keys of its operations."""
        return f"{self.realm}/{self.identity}"

    def key(self, operation: str) -> str:
        """Return the key of an operation."""
        return f"{self.realm}/{self.identity}/{operation}"


def check_name(name: str, what: str) -> str:
    """Return the name of a realm or an identity; raises ConfigurationException for a text that is none."""
    if not re.fullmatch(NAME, name):
        raise ConfigurationException(
            f"{name!r} is not a valid {what}: write at most 128 letters, digits, '_', '-' and '.'"
        )
    return name


class ServantToken(NamedTuple):
    """A token of a servant: a session serves a target with an interface."""

    target: Target
    type_id: str
    fingerprint: str  # of the interface; empty for one that has none
    server: str  # id of the session
    since: float  # wall time of the server's machine when it began to, in s since the epoch
    address: str = ""  # where processes of its machine reach it; empty if they do not
    format: int = FORMAT  # that its server understands; 0 for one that does not say it: until 0.3.0


def servant_token(
    target: Target, type_id: str, fingerprint: str, server: str, since: float, *, address: str = ""
) -> str:
    """Return the key of the token that a servant holds for one of its interfaces."""
    # A dash for an interface without a fingerprint, and for no address: an empty chunk is no key.
    name = f"{target.realm}/{target.identity}"
    moment = round(since * 1000)
    return f"@servant/{name}/{type_id}/{fingerprint or '-'}/{server}/{moment}/{address or '-'}/{FORMAT}"


def parse_servant_token(key: str) -> ServantToken | None:
    """Return the token that a key describes; None for a key that no servant of ours uses."""
    match = _SERVANT.fullmatch(key)
    if match is None:
        return None
    realm, identity, type_id, fingerprint, server, since, address, form = match.groups()
    address, fingerprint = (address or "").strip("-"), fingerprint.strip("-")
    target = Target(realm, identity)
    return ServantToken(target, type_id, fingerprint, server, int(since) / 1000, address, int(form or 0))


def server_of_unknown_token(key: str) -> str | None:
    """Return the server of a servant whose token has the form of another version of VisualHFSM.

    It is empty in a token that does not name it, and None for a key that is no servant's in any version.
    """
    match = _ANY_SERVANT.fullmatch(key)
    return match and (match[2] or "")


def client_token(realm: str, client: str) -> str:
    """Return the key of the token that a client holds."""
    return f"@client/{realm}/{client}"


def any_client(realm: str) -> str:
    """Return the pattern of the tokens of all clients of a realm, those of other versions included."""
    return f"@client/{realm}/**"


def parse_client_token(key: str) -> str:
    """Return the client of a token; nothing for a key that no client has."""
    match = _CLIENT.fullmatch(key)
    return match[1] if match else ""
