"""A folder with an authority, the certificates that it issued, and the settings that go with them."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Final

from deploy.security.certificates import (
    LOCAL_HOSTS,
    Authority,
    SecurityFilesError,
    check_host,
    common_name,
    hosts_of,
    load_certificate,
    write_private,
    write_public,
)
from zenoh_ice.endpoints import host_and_port, is_loopback
from zenoh_ice.settings import Settings, load_settings

__all__ = ["SecurityFolder"]

_AUTHORITY_VALID: Final = timedelta(days=3650)
_AUTHORITY: Final = "authority"
_ANYWHERE: Final = "0.0.0.0"  # noqa: S104 - the router is there to be reached by other machines

_CLIENT_ROLES: Final = ("robot", "operator", "student")
"""The roles that the file of a router begins with."""

_ROUTER: Final = """\
# Settings of the router: nao router --config router.toml
realm = {realm}
mode = "router"
connect = []
listen = [{listen}]

[security]
authority = "authority.pem"
certificate = "router.pem"
key = "router.key"

# What each role may do. What no role grants is denied.
#   call   operations to call, and to read where they are streams, as IDENTITY.OPERATION
#   read   streams to read, without calling anything
#   serve  identities to serve
#   liveliness = false   robots are not told when its programs end, and it cannot flood them with tokens
# `*` stands for any characters of a name; `**` alone is everything.

[security.roles.robot]
serve = ["**"]

[security.roles.operator]
call = ["**"]
serve = ["Hfsm.*"]

[security.roles.student]
call = ["*.get*", "Safety.emergencyStop"]
read = ["**"]
liveliness = false

# The role of each certificate, by its common name; "*" is everybody who is let in.
[security.users]
{users}"""

_CLIENT: Final = """\
# Settings of {name}, who has the role {role} at the router: COMMAND --config {name}.toml
realm = {realm}
mode = "client"
connect = [{connect}]
listen = []

[security]
authority = "authority.pem"
certificate = "{name}.pem"
key = "{name}.key"
"""


@dataclass(frozen=True, slots=True)
class SecurityFolder:
    """The folder of an authority; every method raises SecurityFilesError for a file that is in the way."""

    path: Path

    def create(self, *, realm: str, hosts: Sequence[str], port: int, valid: timedelta) -> list[Path]:
        """Make everything for a router, a robot, an operator and students; return the files of settings.

        `hosts` are the names and addresses by which others reach the router; they connect to the first.
        """
        Settings(realm=realm)  # before anything is written
        host = check_host(hosts[0])
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SecurityFilesError(f"{self.path}: cannot be made: {error.strerror}") from error
        if self._key(_AUTHORITY).exists():
            raise SecurityFilesError(
                f"{self.path} has an authority already: `nao security add` makes certificates of it,"
                " or choose another folder"
            )
        endpoint = f"tls/{_in_brackets(_listening_host(hosts))}:{port}"
        authority = Authority.create(f"authority.{realm}"[:64], _AUTHORITY_VALID)
        authority.save(self._certificate(_AUTHORITY), self._key(_AUTHORITY))
        self._issue(authority, "router", [*hosts, *LOCAL_HOSTS], valid)
        settings = [self._settings("router")]
        write_public(
            settings[0],
            _router_settings(realm, endpoint, {role: role for role in _CLIENT_ROLES}).encode(),
        )
        for role in _CLIENT_ROLES:
            self._issue(authority, role, (), valid)
            settings.append(self._settings(role))
            text = _client_settings(role, role, realm, f"tls/{_in_brackets(host)}:{port}")
            write_public(settings[-1], text.encode())
        return settings

    def add(self, name: str, role: str, *, valid: timedelta) -> list[Path]:
        """Issue a certificate for another user, and let the router know the user's role; return the files.

        The files are those that the user needs. Raises SecurityFilesError for a role that the router does not
        know, and for a name that is taken.
        """
        router_file = self._settings("router")
        router = load_settings(router_file, environment={})
        if role not in router.security.roles:
            raise SecurityFilesError(
                f"{router_file}: there is no role {role!r}; there is {', '.join(router.security.roles)}"
            )
        if name in router.security.users:
            raise SecurityFilesError(f"{router_file}: {name!r} is a user already")
        with_user = _with_user(router_file, name, role)
        connect = self._endpoint_of_clients()
        authority = Authority.load(self._certificate(_AUTHORITY), self._key(_AUTHORITY))
        self._issue(authority, name, (), valid)
        own = self._settings(name)
        write_public(own, _client_settings(name, role, router.realm, connect).encode())
        router_file.write_text(with_user, encoding="utf-8")
        return [self._certificate(_AUTHORITY), self._certificate(name), self._key(name), own]

    def renew(self, name: str, *, valid: timedelta) -> None:
        """Issue a certificate anew, with a new key, in place of that of the same name."""
        if name == _AUTHORITY:
            raise SecurityFilesError(
                f"{self.path}: an authority is not renewed: make another folder, and all certificates anew"
            )
        old = load_certificate(self._certificate(name))
        authority = Authority.load(self._certificate(_AUTHORITY), self._key(_AUTHORITY))
        certificate, key = authority.issue(common_name(old), hosts_of(old), valid)
        fresh = [(self._key(name), key, write_private), (self._certificate(name), certificate, write_public)]
        for path, content, write in fresh:
            write(path.with_suffix(f"{path.suffix}.new"), content)
        for path, _, _ in fresh:
            path.with_suffix(f"{path.suffix}.new").replace(path)

    def _issue(self, authority: Authority, name: str, hosts: Sequence[str], valid: timedelta) -> None:
        certificate, key = authority.issue(name, hosts, valid)
        write_private(self._key(name), key)
        write_public(self._certificate(name), certificate)

    def _endpoint_of_clients(self) -> str:
        file = self._settings(_CLIENT_ROLES[0])
        connect = load_settings(file, environment={}).connect
        if not connect or host_and_port(connect[0]) is None:
            raise SecurityFilesError(f"{file}: `connect` names no router")
        return connect[0]

    def _certificate(self, name: str) -> Path:
        return self.path / f"{name}.pem"

    def _key(self, name: str) -> Path:
        return self.path / f"{name}.key"

    def _settings(self, name: str) -> Path:
        return self.path / f"{name}.toml"


def _listening_host(hosts: Sequence[str]) -> str:
    """Return where a router listens that others reach by some names: nowhere else if all are its own."""
    own = all(is_loopback(f"tls/{_in_brackets(host)}:0") for host in hosts)
    return hosts[0] if own else _ANYWHERE


def _in_brackets(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _with_user(file: Path, name: str, role: str) -> str:
    """Return the text of a router's file with one more user at its end; raises SecurityFilesError."""
    line = f"{json.dumps(name)} = {json.dumps(role)}"
    before = file.read_text(encoding="utf-8")
    after = f"{before.rstrip()}\n{line}\n"
    wanted = tomllib.loads(before)
    wanted["security"]["users"][name] = role
    if tomllib.loads(after) != wanted:
        raise SecurityFilesError(
            f"{file}: [security.users] is not its last table; move it to the end of the file"
        )
    return after


def _router_settings(realm: str, listen: str, users: dict[str, str]) -> str:
    """Return the text of the router's file; `users` gives the role of each."""
    lines = "".join(f"{json.dumps(user)} = {json.dumps(role)}\n" for user, role in users.items())
    return _ROUTER.format(realm=json.dumps(realm), listen=json.dumps(listen), users=lines)


def _client_settings(name: str, role: str, realm: str, connect: str) -> str:
    """Return the text of the file of a robot or a user."""
    return _CLIENT.format(name=name, role=role, realm=json.dumps(realm), connect=json.dumps(connect))
