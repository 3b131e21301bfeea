"""Names of servants: identities with their categories, facets, and what a call is addressed to."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from .exceptions import ConfigurationException

__all__ = [
    "ANY_NAME",
    "NAME",
    "PROXY_TEXT",
    "Identity",
    "Target",
    "check_facet",
    "check_realm",
    "identityToString",
    "stringToIdentity",
]

NAME: Final = r"[A-Za-z0-9_.\-]{1,128}"
"""Pattern of a realm, of a category, of a name and of a facet: chunks of a Zenoh key that are no marks."""

ANY_NAME: Final = "="
"""The name, in keys and tokens alone, that stands for every name which has no servant of its own."""

PROXY_TEXT: Final = rf"\A(?:({NAME})/)?({NAME})(?: -f ({NAME}))?(?: -([toO]))?(?:@({NAME}))?\Z"
"""Pattern of a proxy as text: category, name, facet, mode (twoway, oneway or batch oneway) and realm."""

_FACET_MARK: Final = "+"
_NAME: Final = re.compile(NAME)
_IDENTITY: Final = re.compile(rf"(?:({NAME})/)?({NAME})")


class Identity(NamedTuple):
    """The name of a servant in its realm; as text `name`, or `category/name`."""

    name: str
    category: str = ""

    def __str__(self) -> str:
        return f"{self.category}/{self.name}" if self.category else self.name


class Target(NamedTuple):
    """What a call is addressed to; as text `category/name -f facet@realm`."""

    realm: str
    identity: str
    """The identity as text."""
    facet: str = ""

    def __str__(self) -> str:
        return f"{self.object}@{self.realm}"

    @property
    def object(self) -> str:
        """Identity and facet as text."""
        return f"{self.identity} -f {self.facet}" if self.facet else self.identity

    @property
    def stand_ins(self) -> tuple[Target, ...]:
        """What stands for it where it has no servant of its own: its category, then all categories."""
        category = self.identity.rpartition("/")[0]
        everything = Target(self.realm, ANY_NAME)
        return (Target(self.realm, f"{category}/{ANY_NAME}"), everything) if category else (everything,)

    @property
    def prefix(self) -> str:
        """What the keys of its operations begin with, up to and including the last separator."""
        facet = f"{_FACET_MARK}{self.facet}/" if self.facet else ""
        return f"{self.realm}/{self.identity}/{facet}"


def stringToIdentity(text: str) -> Identity:
    """Return the identity of a text, `name` or `category/name`.

    Raises ConfigurationException when it is none.
    """
    match = _IDENTITY.fullmatch(text)
    if match is None:
        raise ConfigurationException(
            f"{text!r} is no identity: write NAME or CATEGORY/NAME, each of at most 128 letters, digits, "
            "'_', '-' and '.'"
        )
    return Identity(match[2], match[1] or "")


def identityToString(identity: Identity) -> str:
    """Return an identity as text that `stringToIdentity` takes."""
    return str(identity)


def check_facet(facet: str) -> str:
    """Return the name of a facet, empty for the servant itself; raises ConfigurationException for no name."""
    return _check(facet, "facet") if facet else facet


def check_realm(realm: str) -> str:
    """Return the name of a realm; raises ConfigurationException for no name."""
    return _check(realm, "realm")


def _check(name: str, what: str) -> str:
    if not _NAME.fullmatch(name):
        raise ConfigurationException(
            f"{name!r} is no {what}: write at most 128 letters, digits, '_', '-' and '.'"
        )
    return name
