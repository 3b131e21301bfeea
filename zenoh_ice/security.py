"""Roles as Zenoh's access control, and what is wrong or dangerous about settings of security.

A role grants operations as `IDENTITY.OPERATION`. In both `*` stands for any characters; `**` alone is
everything in the realm.
"""

from __future__ import annotations

import stat
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from .endpoints import is_loopback, protocol
from .exceptions import ConfigurationException
from .settings import EVERYBODY, PATHS, Role, Security, Settings

__all__ = ["access_control", "check_security", "exposure"]

_EVERYTHING: Final = "**"
_ABOUT: Final = "ice_*"
"""These describe a servant and change nothing: a role that may do anything with it may ask them."""
_PRIVATE: Final = ("key", "passwords")


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
    # Everybody may know who is there and how it is: error messages are made of that.
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


def check_security(security: Security) -> list[str]:
    """Check that settings belong together, and what the files hold; return what is dangerous.

    Raises ConfigurationException, naming the setting and what to do.
    """
    _check_together(security)
    for name in PATHS:
        if path := getattr(security, name):
            _check_readable(f"security.{name}", Path(path))
    if security.passwords:
        _check_passwords(Path(security.passwords))
    if security.authority:
        _check_tls(security)
    return [
        f"{path} can be read by others on this machine: chmod 600 it"
        for path in (getattr(security, name) for name in _PRIVATE)
        if path and Path(path).stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO)
    ]


def exposure(settings: Settings) -> list[str]:
    """Return a sentence for each danger in where, and to whom, a component listens."""
    if settings.mode == "client":
        return []
    security = settings.security
    dangers: list[str] = []
    for endpoint in settings.listen:
        if is_loopback(endpoint):
            continue
        if not protocol(endpoint).uses_tls:
            dangers.append(
                f"listening on {endpoint} without TLS: anyone on that network can "
                + (
                    "read and change"
                    if security.passwords
                    else "see through the cameras, move the robot and read"
                )
                + " everything that is said; listen on tls/... with [security] (make its files with "
                "`nao security init`), or on 127.0.0.1 alone"
            )
        elif not security.mutual and not security.passwords:
            dangers.append(
                f"listening on {endpoint}, where security.mutual is false and there are no passwords: anyone "
                "on that network can see through the cameras and move the robot"
            )
        elif not security.roles:
            dangers.append(
                f"listening on {endpoint} without security.roles: everybody who is let in may do everything"
            )
    return dangers


def _check_together(security: Security) -> None:
    if bool(security.certificate) != bool(security.key):
        missing, present = ("key", "certificate") if security.certificate else ("certificate", "key")
        raise ConfigurationException(f"security.{present} without security.{missing}: name both files")
    if security.certificate and not security.authority:
        raise ConfigurationException(
            "security.certificate without security.authority: name the file of who vouches for others"
        )
    if bool(security.user) != bool(security.password):
        raise ConfigurationException("security.user and security.password belong together: give both")
    if security.roles and not security.passwords and not (security.authority and security.mutual):
        raise ConfigurationException(
            "security.roles without security.authority or security.passwords: nobody could tell who "
            "somebody is; name the file of the authority, or that of the passwords"
        )


def _check_tls(security: Security) -> None:
    import ssl  # here: it takes long to load, and few need it

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    try:
        context.load_verify_locations(security.authority)
    except ssl.SSLError as error:
        raise ConfigurationException(
            f"security.authority = {security.authority!r}: no certificate in PEM"
        ) from error
    if not security.certificate:
        return
    try:
        # Without a password for the key: who runs unattended cannot be asked for one.
        context.load_cert_chain(security.certificate, security.key, password="")
    except ssl.SSLError as error:
        mismatch = error.reason == "KEY_VALUES_MISMATCH"
        what = (
            "the key is not that of the certificate" if mismatch else "not a certificate and its key in PEM"
        )
        raise ConfigurationException(
            f"security.certificate = {security.certificate!r}, security.key = {security.key!r}: {what}"
        ) from error


def _check_readable(setting: str, path: Path) -> None:
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        hint = "" if setting == "security.passwords" else "; `nao security init` makes such files"
        raise ConfigurationException(
            f"{setting} = {str(path)!r}: cannot be read: {error.strerror}{hint}"
        ) from error


def _check_passwords(path: Path) -> None:
    """Raise ConfigurationException for a file without users: by such a one Zenoh lets everybody in."""
    listed = 0
    for number, line in enumerate(path.read_bytes().splitlines(), 1):
        if not line.strip():
            continue
        name, _, password = line.partition(b":")
        if not name.strip() or not password.strip():  # without the line: it may be a password
            raise ConfigurationException(
                f"security.passwords = {str(path)!r}: line {number} is not NAME:PASSWORD"
            )
        listed += 1
    if not listed:
        raise ConfigurationException(
            f"security.passwords = {str(path)!r} lists nobody, so everybody would be let in: write a line "
            "NAME:PASSWORD for each user"
        )
