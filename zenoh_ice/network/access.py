"""Who may do what: roles in the words of the object model, and Zenoh's access control made of them.

A role grants operations as `IDENTITY.OPERATION`, the identity being `[category/]name[+facet]`. In a name, a
category, a facet and an operation `*` stands for any characters; `**` alone is everything in the realm.
"""

from __future__ import annotations

import re
import string
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

__all__ = ["Role", "access_control", "parse_role"]

EVERYTHING: Final = "**"

_GLOB: Final = r"[A-Za-z0-9_.\-*]{1,128}"
_IDENTITY: Final = re.compile(rf"(?:(?P<category>{_GLOB})/)?(?P<name>{_GLOB})(?:\+(?P<facet>{_GLOB}))?")
_OPERATION: Final = re.compile(r"[A-Za-z0-9_*]{1,128}")
_REALM: Final = re.compile(r"[A-Za-z0-9_.\-*]{1,64}")
_FIRST: Final = string.ascii_letters + string.digits + "_.-"  # of a name
_MOST_PATTERNS: Final = 256  # of a list

# What tells what a servant is, and changes nothing: who may do anything with it may ask that.
_ABOUT: Final = "ice_*"


@dataclass(frozen=True, slots=True)
class Role:
    """What those who have the role may do; each list holds patterns."""

    call: tuple[str, ...] = ()
    """Operations to call and, of those that are streams, to read: `["Camera*.*", "*Encoders.*"]`."""
    read: tuple[str, ...] = ()
    """Streams to read, without calling anything: `["**"]` sees all and moves nothing."""
    oneway: tuple[str, ...] = ()
    """Operations to call oneway.

    Zenoh cannot tell such a call from a sample of a stream of that name: only who may be trusted to publish
    no false ones should have `oneway` on operations that are streams.
    """
    serve: tuple[str, ...] = ()
    """Identities to serve, without operations: `["*"]` for a robot, `["Hfsm.*"]` for who runs behaviors."""
    realms: tuple[str, ...] = ()
    """The realms in which all of that is granted; without any, that of the component that grants it."""


def parse_role(value: object) -> Role:
    """Return a role from a table of settings; raises ValueError with what to do."""
    names = [item.name for item in fields(Role)]
    if not isinstance(value, Mapping):
        raise ValueError(f"write a table with {', '.join(names)}")
    lists: dict[str, tuple[str, ...]] = {}
    for name, patterns in value.items():
        if name not in names:
            raise ValueError(f"there is no {name!r} in a role; there is {', '.join(names)}")
        if not isinstance(patterns, (list, tuple)) or not all(isinstance(item, str) for item in patterns):
            raise ValueError(f"{name}: write a list of texts")
        if len(patterns) > _MOST_PATTERNS:
            raise ValueError(f"{name}: at most {_MOST_PATTERNS} patterns")
        for pattern in patterns:
            try:
                _CHECKS[name](pattern)
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from None
        lists[name] = tuple(patterns)
    return Role(**lists)


def access_control(
    roles: Mapping[str, Role],
    users: Mapping[str, str],
    realm: str,
    *,
    certificates: bool,
    passwords: bool,
    everybody: str = "*",
) -> dict[str, Any]:
    """Return the section `access_control` of Zenoh's configuration: what no role grants is denied.

    `users` gives the role of each certificate, if these are asked for, and of each user with a password, if
    those are; that of `everybody` is granted to all who are let in.
    """
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    for name, role in roles.items():
        members = [user for user, role_name in users.items() if role_name == name and user != everybody]
        own: list[dict[str, Any]] = []
        if members and certificates:
            own.append({"id": f"{name} by certificate", "cert_common_names": members})
        if members and passwords:
            own.append({"id": f"{name} by password", "usernames": members})
        if users.get(everybody) == name:
            own.append({"id": f"{name} is everybody"})
        if not own:
            continue
        granted = [
            {"id": f"{name}: {number}", "permission": "allow", **rule}
            for number, rule in enumerate(_rules(role, role.realms or (realm,)), 1)
        ]
        rules += granted
        subjects += own
        policies.append(
            {"rules": [rule["id"] for rule in granted], "subjects": [subject["id"] for subject in own]}
        )
    # Zenoh takes no empty lists.
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules or None,
        "subjects": subjects or None,
        "policies": policies or None,
    }


def _rules(role: Role, realms: Sequence[str]) -> Iterable[dict[str, Any]]:
    """Yield rules; "ingress" is what comes from whom the role belongs to, "egress" what is sent there."""
    served = [
        key for realm in realms for pattern in role.serve for key in _served_keys(_glob(realm), pattern)
    ]
    called = _keys(realms, role.call)
    readable = _unique([*called, *_keys(realms, role.read)])
    about = _unique(
        key
        for realm in realms
        for pattern in (*role.call, *role.read, *role.oneway)
        for key in _about_keys(_glob(realm), pattern)
    )
    processes = [f"@process/{_glob(realm)}/*/status" for realm in realms]
    servants = [f"@servant/{_glob(realm)}/**" for realm in realms]
    clients = [f"@client/{_glob(realm)}/*/*" for realm in realms]
    presence = [*servants, *clients]
    # Everybody may know who is there and how it is: an error message tells what is wrong from that.
    yield _rule(["liveliness_query", "declare_liveliness_subscriber"], ["ingress", "egress"], presence)
    yield _rule(["liveliness_token"], ["egress"], presence)
    yield _rule(["liveliness_token"], ["ingress"], clients)
    yield _rule(["query"], ["ingress"], processes)
    yield _rule(["reply"], ["egress"], processes)
    # Without, a querier believes that nobody is there.
    yield _rule(["declare_queryable"], ["egress"], [*(f"{_glob(realm)}/**" for realm in realms), *processes])
    called_or_about = _unique([*called, *about])
    if called_or_about:
        yield _rule(["query"], ["ingress"], called_or_about)
        yield _rule(["reply"], ["egress"], called_or_about)
    if readable:
        yield _rule(["declare_subscriber"], ["ingress"], readable)
        yield _rule(["put"], ["egress"], readable)
    if oneway := _keys(realms, role.oneway):
        yield _rule(["put"], ["ingress"], oneway)
        yield _rule(["declare_subscriber"], ["egress"], oneway)
    if served:
        tokens = [f"@servant/{key}" for key in served]
        yield _rule(["declare_queryable", "reply"], ["ingress"], [*served, *processes])
        yield _rule(["query"], ["egress"], [*served, *processes])
        yield _rule(["put", "declare_subscriber"], ["ingress", "egress"], served)
        yield _rule(["liveliness_token"], ["ingress"], tokens)


def _rule(messages: list[str], flows: list[str], keys: list[str]) -> dict[str, Any]:
    return {"messages": messages, "flows": flows, "key_exprs": keys}


def _keys(realms: Sequence[str], patterns: Sequence[str]) -> list[str]:
    return _unique(
        key for realm in realms for pattern in patterns for key in _operation_keys(_glob(realm), pattern)
    )


def _operation_keys(realm: str, pattern: str) -> list[str]:
    """Return the keys of operations, for a call of any servant and for one of a certain replica."""
    if pattern == EVERYTHING:
        return [f"{realm}/**"]
    identity, _, operation = pattern.rpartition(".")
    match = _IDENTITY.fullmatch(identity)
    assert match is not None  # it was checked
    facet = f"/+{_glob(match['facet'], marked=True)}" if match["facet"] else ""
    return [
        f"{prefix}{facet}{replica}/{_glob(operation)}"
        for prefix in _identity_keys(realm, match)
        for replica in ("", "/~$*")
    ]


def _served_keys(realm: str, pattern: str) -> list[str]:
    if pattern == EVERYTHING:
        return [f"{realm}/**"]
    match = _IDENTITY.fullmatch(pattern)
    assert match is not None  # it was checked
    category = f"{_glob(match['category'])}/" if match["category"] else ""
    return [f"{realm}/{category}{_glob(match['name'])}/**"]


def _identity_keys(realm: str, match: re.Match[str]) -> list[str]:
    category, name = match["category"], match["name"]
    if not category:
        return [f"{realm}/{_glob(name)}"]
    names = [name]
    if name.startswith("*"):
        # Not what follows an identity that is named as the category: `+` begins a facet of it, `~` a replica.
        names = [first + name for first in _FIRST]
        if name != "*":
            names.append(name.removeprefix("*"))
    return [f"{realm}/{_glob(category)}/{_glob(each)}" for each in names]


def _about_keys(realm: str, pattern: str) -> list[str]:
    if pattern == EVERYTHING:
        return [f"{realm}/**/{_glob(_ABOUT)}"]
    return _operation_keys(realm, f"{pattern.rpartition('.')[0]}.{_ABOUT}")


def _glob(text: str, *, marked: bool = False) -> str:
    """Return a chunk of a Zenoh key expression; of a `marked` one it is the end."""
    return text if text == "*" and not marked else text.replace("*", "$*")


def _unique(keys: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(keys))


# Each check raises ValueError with what to do.


def _check_operation(pattern: str) -> None:
    if pattern == EVERYTHING:
        return
    identity, dot, operation = pattern.rpartition(".")
    if not dot or not _IDENTITY.fullmatch(identity) or not _OPERATION.fullmatch(operation):
        raise ValueError(
            f"{pattern!r}: write IDENTITY.OPERATION, such as Head.getPose, Camera*.*, soccer/*.* or "
            f"Head+debug.*, or {EVERYTHING} for everything"
        )
    _check_stars(pattern)


def _check_identity(pattern: str) -> None:
    if pattern == EVERYTHING:
        return
    match = _IDENTITY.fullmatch(pattern)
    if match is None or match["facet"]:
        raise ValueError(
            f"{pattern!r}: write an identity with all its facets, such as Head, Hfsm.* or soccer/*, or "
            f"{EVERYTHING} for everything"
        )
    _check_stars(pattern)


def _check_realm(pattern: str) -> None:
    if not _REALM.fullmatch(pattern):
        raise ValueError(f"{pattern!r} is no realm: write letters, digits, '_', '-', '.' and '*'")
    _check_stars(pattern)


def _check_stars(pattern: str) -> None:
    if "**" in pattern:
        raise ValueError(f"{pattern!r}: write one * for any characters; {EVERYTHING} stands alone")


_CHECKS: Final = {
    "call": _check_operation,
    "read": _check_operation,
    "oneway": _check_operation,
    "serve": _check_identity,
    "realms": _check_realm,
}
