"""Who may do what: Zenoh's access control, made of the roles of the settings.

A role grants operations as `IDENTITY.OPERATION`. In both `*` stands for any characters; `**` alone is
everything in the realm.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from ..settings import EVERYBODY, Role

__all__ = ["access_control"]

_EVERYTHING: Final = "**"
_ABOUT: Final = "ice_*"
"""What tells what a servant is, and changes nothing: who may do anything with it may ask that."""


def access_control(
    roles: Mapping[str, Role],
    users: Mapping[str, str],
    realm: str,
    *,
    certificates: bool,
    passwords: bool,
) -> dict[str, Any]:
    """Return the section `access_control` of Zenoh's configuration: what no role grants is denied.

    `users` gives the role of each certificate, if these are asked for, and of each user with a password, if
    those are; that of EVERYBODY is granted to all who are let in.
    """
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    for name, role in roles.items():
        members = [user for user, role_name in users.items() if role_name == name and user != EVERYBODY]
        own: list[dict[str, Any]] = []
        if members and certificates:
            own.append({"id": f"{name} by certificate", "cert_common_names": members})
        if members and passwords:
            own.append({"id": f"{name} by password", "usernames": members})
        if users.get(EVERYBODY) == name:
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
    identities = [_identity_key(_glob(realm), pattern) for realm in realms for pattern in role.serve]
    called = _keys(realms, role.call)
    readable = _unique([*called, *_keys(realms, role.read)])
    about = _unique(
        _about_key(_glob(realm), pattern) for realm in realms for pattern in (*role.call, *role.read)
    )
    processes = [f"@process/{_glob(realm)}/*/status" for realm in realms]
    servants = [f"@servant/{_glob(realm)}/**" for realm in realms]
    clients = [f"@client/{_glob(realm)}/*/*" for realm in realms]
    presence = [*servants, *clients]
    # Everybody may know who is there and how it is: an error message tells what is wrong from that.
    yield _rule(["liveliness_query", "declare_liveliness_subscriber"], ["ingress", "egress"], presence)
    yield _rule(["liveliness_token"], ["egress"], presence)
    if role.liveliness:
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
    if identities:
        served = [key if key.endswith("/**") else f"{key}/*" for key in identities]
        tokens = [f"@servant/{key.removesuffix('/**')}/**" for key in identities]
        yield _rule(["declare_queryable", "reply"], ["ingress"], [*served, *processes])
        yield _rule(["query"], ["egress"], [*served, *processes])
        yield _rule(["put", "declare_subscriber"], ["ingress", "egress"], served)
        yield _rule(["liveliness_token"], ["ingress"], tokens)


def _rule(messages: list[str], flows: list[str], keys: list[str]) -> dict[str, Any]:
    return {"messages": messages, "flows": flows, "key_exprs": keys}


def _keys(realms: Sequence[str], patterns: Sequence[str]) -> list[str]:
    return _unique(_operation_key(_glob(realm), pattern) for realm in realms for pattern in patterns)


def _operation_key(realm: str, pattern: str) -> str:
    if pattern == _EVERYTHING:
        return f"{realm}/**"
    identity, _, operation = pattern.rpartition(".")
    return f"{_identity_key(realm, identity)}/{_glob(operation)}"


def _about_key(realm: str, pattern: str) -> str:
    return f"{_identity_key(realm, pattern.rpartition('.')[0] or pattern)}/{_glob(_ABOUT)}"


def _identity_key(realm: str, identity: str) -> str:
    return f"{realm}/{identity if identity == _EVERYTHING else _glob(identity)}"


def _glob(text: str) -> str:
    """Return a chunk of a Zenoh key expression."""
    return text if text == "*" else text.replace("*", "$*")


def _unique(keys: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(keys))
