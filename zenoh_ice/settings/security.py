"""Translate roles into Zenoh's access control, and find wrong or dangerous security settings."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.settings import EVERYBODY, PATHS, Role, Security, Settings, is_loopback, uses_tls


def access_control(security: Security, realm: str) -> dict[str, Any]:
    """Return the section `access_control` of Zenoh's configuration: what no role grants is denied.

    A user gets the role by a certificate if these are required, and by a password if those are; the role of
    EVERYBODY is granted to every accepted user.
    """
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    for name, role in security.roles.items():
        members = [user for user, its in security.users.items() if its == name and user != EVERYBODY]
        own: list[dict[str, Any]] = []
        if members and security.authority and security.mutual:
            own.append({"id": f"{name} by certificate", "cert_common_names": members})
        if members and security.passwords:
            own.append({"id": f"{name} by password", "usernames": members})
        if security.users.get(EVERYBODY) == name:
            own.append({"id": f"{name} is everybody"})
        if not own:
            continue
        granted = [
            {
                "id": f"{name}: {number}",
                "permission": "allow",
                "messages": messages.split(),
                "flows": flows.split(),
                "key_exprs": list(dict.fromkeys(keys)),
            }
            for number, (messages, flows, keys) in enumerate(
                [*_rules(role, role.realms or (realm,)), *_ros_rules(role)], 1
            )
            if keys
        ]
        rules += granted
        subjects += own
        policies.append(
            {"rules": [rule["id"] for rule in granted], "subjects": [subject["id"] for subject in own]}
        )
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules or None,  # Zenoh takes no empty lists
        "subjects": subjects or None,
        "policies": policies or None,
    }


def _rules(role: Role, patterns: Sequence[str]) -> list[tuple[str, str, list[str]]]:
    """Return messages, flows and keys of what a role may do in some realms.

    "ingress" is traffic from a user of the role, "egress" traffic to it.
    """

    def keys(names: Sequence[str]) -> list[str]:
        return [f"{realm}/{'/'.join(map(_glob, name.rsplit('.', 1)))}" for realm in realms for name in names]

    realms = [_glob(pattern) for pattern in patterns]
    called = keys(role.call)
    readable = [*called, *keys(role.read)]
    # These describe a servant and change nothing: any access to it includes them.
    about = [f"{key if key.endswith('/**') else key.rpartition('/')[0]}/ice_$*" for key in readable]
    identities = [f"{realm}/{_glob(pattern)}" for realm in realms for pattern in role.serve]
    served = [key if key.endswith("/**") else f"{key}/*" for key in identities]
    processes = [f"@process/{realm}/*/status" for realm in realms]
    clients = [f"@client/{realm}/*" for realm in realms]
    presence = [f"@{kind}/{realm}/**" for kind in ("servant", "client") for realm in realms]
    return [
        # Everybody may see presence and status: error messages need them. Who asks for the servants of
        # all realms gets those of the role's.
        ("liveliness_query declare_liveliness_subscriber", "ingress egress", [*presence, "@servant/**"]),
        ("liveliness_token", "egress", presence),
        ("liveliness_token", "ingress", clients if role.liveliness else []),
        ("query", "ingress", processes),
        ("reply", "egress", processes),
        # Without it, a querier believes that there is no servant.
        ("declare_queryable", "egress", [*(f"{realm}/**" for realm in realms), *processes]),
        ("query", "ingress", [*called, *about]),
        ("reply", "egress", [*called, *about]),
        ("declare_subscriber", "ingress", readable),
        ("put", "egress", readable),
        ("declare_queryable reply", "ingress", [*served, *processes] if served else []),
        ("query", "egress", [*served, *processes] if served else []),
        ("put declare_subscriber", "ingress egress", served),
        ("liveliness_token", "ingress", [f"@servant/{key.removesuffix('/**')}/**" for key in identities]),
    ]


def _ros_rules(role: Role) -> list[tuple[str, str, list[str]]]:
    """Return messages, flows and keys of what a role may do in the graph of ROS, as rmw_zenoh lays it out.

    A message, a request or a goal has the key DOMAIN/NAME/TYPE/HASH. The `::` in the type divides it from all
    keys of ours. Below it are the messages that latched topics keep for late joiners. By the end of a token a
    gateway notices that a commander is gone, and of a name with too many it counts none. So a role declares
    the tokens of what it may do, and of nodes, which move nothing.
    """

    def keys(names: Sequence[str]) -> list[str]:
        chunks = ["/".join(map(_glob, name.strip("/").split("/"))) for name in names]
        return [f"{domain}/{name}/$*::$*/*" for domain in role.ros_domains for name in chunks]

    def kept(keys: Sequence[str]) -> list[str]:
        return [f"{key}/@adv/**" for key in keys]

    def tokens(names: Sequence[str], *kinds: str) -> list[str]:
        ends = [f"{kind}/*/*/*/{name}/**" for kind in kinds for each in names for name in _mangled(each)]
        return [f"@ros2_lv/{domain}/*/*/*/{end}" for domain in role.ros_domains for end in ends]

    commands = [name for name in role.ros_call if "*" not in name.rpartition("/")[2]]
    called, commanded, served = keys(role.ros_call), keys(commands), keys(role.ros_serve)
    heard = [*called, *keys(role.ros_read)]
    if not (heard or served):
        return []
    graph = [f"@ros2_lv/{domain}/**" for domain in role.ros_domains]
    offered = [*served, *kept(served)]
    published = [*commanded, *kept(commanded)]
    presence = [*graph, *kept(heard), *offered]
    announced = [
        *(f"@ros2_lv/{domain}/*/*/*/NN/*/*/*" for domain in role.ros_domains),
        *tokens(commands, "MP"),
        *tokens(role.ros_call, "MS", "SC"),
        *tokens(role.ros_read, "MS"),
        *tokens(role.ros_serve, "MP", "MS", "SC", "SS"),
    ]
    return [
        # Everybody who uses ROS may see the graph.
        ("liveliness_query declare_liveliness_subscriber", "ingress egress", presence),
        ("liveliness_token", "egress", presence),
        ("liveliness_token", "ingress", [*announced, *published, *offered] if role.liveliness else []),
        ("query", "ingress", [*called, *kept(called)]),
        ("reply declare_queryable declare_subscriber", "egress", [*called, *kept(called)]),
        # Who may command everything of a robot does not speak for it: topics to publish are called by name.
        ("put", "ingress", published),
        ("reply declare_queryable", "ingress", kept(commanded)),
        ("query", "egress", kept(commanded)),
        # A kept message has the key of its topic.
        ("reply", "ingress", commanded),
        ("reply", "egress", heard),
        ("declare_subscriber", "ingress", [*heard, *kept(heard)]),
        ("put", "egress", [*heard, *kept(heard)]),
        ("query", "ingress", kept(heard)),
        ("reply declare_queryable", "egress", kept(heard)),
        ("put query reply declare_subscriber declare_queryable", "ingress egress", offered),
    ]


def _glob(text: str) -> str:
    """Return a chunk of a Zenoh key expression."""
    return text if text in ("*", "**") else text.replace("*", "$*")


def _mangled(name: str) -> list[str]:
    """Return the patterns that a pattern of names of ROS has in tokens: one chunk, where `%` stands for `/`.

    `**` is no part or some, which are two patterns. To Zenoh `%` is like any other character, so that `*` may
    be several parts.
    """
    found = [""]
    for part in name.strip("/").split("/"):
        ends = ("", "%$*") if part == "**" else (f"%{part.replace('*', '$*')}",)
        found = [f"{begin}{end}" for begin in found for end in ends]
    return [each for each in found if each]


def check_security(settings: Settings) -> list[str]:
    """Check that settings are consistent, and the files of `[security]`; return the dangers.

    Raises ConfigurationException, naming the setting and what to do.
    """
    for fault in _faults(settings):
        raise ConfigurationException(fault)
    security = settings.security
    dangers: list[str] = []
    for name in PATHS:
        if not (path := getattr(security, name)):
            continue
        setting = f"security.{name} = {path!r}"
        try:
            with Path(path).open("rb") as file:
                mode, content = os.fstat(file.fileno()).st_mode, file.read()
        except OSError as error:
            hint = "see `nao security init`"
            raise ConfigurationException(f"{setting}: cannot be read: {error.strerror}; {hint}") from error
        if name in ("key", "passwords") and mode & 0o077:
            dangers.append(f"{path} can be read by others on this machine: chmod 600 it")
        if name == "passwords":
            for number, line in enumerate(content.splitlines(), 1):
                if line.strip() and not all(part.strip() for part in line.partition(b":")):
                    # The error does not show the line: it may hold a password.
                    raise ConfigurationException(f"{setting}: line {number} is not NAME:PASSWORD")
            if not content.strip():
                raise ConfigurationException(
                    f"{setting} lists nobody, so everybody would be accepted: write lines NAME:PASSWORD"
                )
    if security.authority:
        _check_tls(security)
    return dangers


def exposure(settings: Settings) -> list[str]:
    """Return a sentence for each danger of the endpoints and access rules of a component."""
    security = settings.security
    anyone = "anyone on that network can see through the cameras and move the robot"
    dangers: list[str] = []
    for endpoint in () if settings.mode == "client" else settings.listen:
        why = ""
        if is_loopback(endpoint):
            continue
        if not uses_tls(endpoint):
            why = f"without TLS: {anyone}; listen on tls/... (see `nao security init`), or on 127.0.0.1"
        elif not security.mutual and not security.passwords:
            why = f"with security.mutual = false and without passwords: {anyone}"
        elif not security.roles:
            why = "without security.roles: every accepted user may do everything"
        if why:
            dangers.append(f"listening on {endpoint} {why}")
    return dangers


def _faults(settings: Settings) -> Iterator[str]:
    """Yield contradictions between settings, and what to do about each."""
    security, client = settings.security, settings.mode == "client"
    listen = [] if client else [each for each in settings.listen if uses_tls(each)]
    if bool(security.certificate) != bool(security.key):
        yield "security.certificate and security.key belong together: name both files"
    if bool(security.user) != bool(security.password):
        yield "security.user and security.password belong together: give both"
    if not security.authority:
        if security.certificate:
            yield "security.certificate without security.authority: name the file of the authority"
        for endpoint in (*filter(uses_tls, settings.connect), *listen):
            yield f"{endpoint} needs security.authority: the certificate of the authority of the other side"
    if listen and not security.certificate:
        yield f"to listen on {listen[0]} needs security.certificate and security.key: name both files"
    if security.roles and client:
        yield "security.roles in a client: they belong to the router, or the server, that others connect to"
    if security.roles and not security.passwords and not (security.authority and security.mutual):
        yield "security.roles without security.authority or security.passwords, by which users are known"


def _check_tls(security: Security) -> None:
    import ssl  # here: it takes long to load, and few need it

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    why = f"security.authority = {security.authority!r}: no certificate in PEM"
    try:
        context.load_verify_locations(security.authority)
        if security.certificate:
            why = (
                f"security.certificate = {security.certificate!r}: not in PEM, or security.key is not its key"
            )
            # Without a password for the key: an unattended process cannot be asked for one.
            context.load_cert_chain(security.certificate, security.key, password="")
    except ssl.SSLError as error:
        raise ConfigurationException(f"{why} ({error.reason})") from error
