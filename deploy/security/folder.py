"""A folder with an authority, the certificates that it issued, and the settings that go with them."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Final

from deploy.security.certificates import (
    LOCAL_HOSTS,
    Authority,
    SecurityFilesError,
    common_name,
    hosts_of,
    load_certificate,
)
from zenoh_ice.endpoints import is_loopback
from zenoh_ice.settings import Settings, load_settings

__all__ = ["SecurityFolder"]

_AUTHORITY_VALID: Final = timedelta(days=3650)
_AUTHORITY: Final = "authority"
_ROUTER: Final = "router"
_ANYWHERE: Final = "0.0.0.0"  # noqa: S104 - the router is there to be reached by other machines

_CLIENT_ROLES: Final = ("robot", "operator", "student")
"""The roles that the file of a router begins with."""

_ROUTER_FILE: Final = """\
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

_CLIENT_FILE: Final = """\
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
        Raises ConfigurationException for a realm that is none, SecurityFilesError for such a host.
        """
        Settings(realm=realm)
        if (self.path / "authority.key").exists():
            raise SecurityFilesError(
                f"{self.path} has an authority already: `nao security add` makes certificates of it,"
                " or choose another folder"
            )
        authority = Authority.create(f"authority.{realm}"[:64], _AUTHORITY_VALID)
        files = _pair(_AUTHORITY, authority.files())
        files |= _pair(_ROUTER, authority.issue(_ROUTER, [*hosts, *LOCAL_HOSTS], valid))
        users = "".join(_user_line(role, role) for role in _CLIENT_ROLES)
        listen = json.dumps(f"tls/{_in_brackets(_listening_host(hosts))}:{port}")
        files["router.toml"] = _ROUTER_FILE.format(
            realm=json.dumps(realm), listen=listen, users=users
        ).encode()
        for role in _CLIENT_ROLES:
            connect = f"tls/{_in_brackets(hosts[0])}:{port}"
            files |= _client_files(authority, role, role, realm=realm, connect=connect, valid=valid)
        self._write(files)
        return [self.path / name for name in files if name.endswith(".toml")]

    def add(self, name: str, role: str, *, valid: timedelta) -> list[Path]:
        """Issue a certificate for another user, and let the router know the user's role; return the files.

        The files are those that the user needs. Raises SecurityFilesError for a role that the router does not
        know, and for a name that is taken.
        """
        router_file = self.path / "router.toml"
        router = load_settings(router_file, environment={})
        if role not in router.security.roles:
            raise SecurityFilesError(
                f"{router_file}: there is no role {role!r}; there is {', '.join(router.security.roles)}"
            )
        if name in router.security.users:
            raise SecurityFilesError(f"{router_file}: {name!r} is a user already")
        with_user = _with_user(router_file, name, role)
        client_file = self.path / f"{_CLIENT_ROLES[0]}.toml"
        connect = load_settings(client_file, environment={}).connect
        if not connect:
            raise SecurityFilesError(f"{client_file}: `connect` names no router")
        files = _client_files(
            self._authority(), name, role, realm=router.realm, connect=connect[0], valid=valid
        )
        self._write(files)
        router_file.write_text(with_user, encoding="utf-8")
        return [self.path / each for each in (f"{_AUTHORITY}.pem", *files)]

    def renew(self, name: str, *, valid: timedelta) -> None:
        """Issue a certificate anew, with a new key, in place of that of the same name."""
        if name == _AUTHORITY:
            raise SecurityFilesError(
                f"{self.path}: an authority is not renewed: make another folder, and all certificates anew"
            )
        old = load_certificate(self.path / f"{name}.pem")
        files = _pair(name, self._authority().issue(common_name(old), hosts_of(old), valid))
        self._write({f"new.{each}": content for each, content in files.items()})
        for each in files:
            (self.path / f"new.{each}").replace(self.path / each)

    def _authority(self) -> Authority:
        return Authority.load(self.path / f"{_AUTHORITY}.pem", self.path / f"{_AUTHORITY}.key")

    def _write(self, files: Mapping[str, bytes]) -> None:
        """Write new files; keys can be read by their owner alone. Raises SecurityFilesError if one exists."""
        path = self.path
        try:
            path.mkdir(parents=True, exist_ok=True)
            for name, content in files.items():
                path = self.path / name
                mode = 0o600 if path.suffix == ".key" else 0o666
                descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
                with os.fdopen(descriptor, "wb") as file:
                    file.write(content)
        except OSError as error:
            raise SecurityFilesError(f"{path}: cannot be written: {error.strerror}") from error


def _pair(name: str, made: tuple[bytes, bytes]) -> dict[str, bytes]:
    """Return the files of a certificate and its key."""
    return dict(zip((f"{name}.pem", f"{name}.key"), made, strict=True))


def _client_files(
    authority: Authority, name: str, role: str, *, realm: str, connect: str, valid: timedelta
) -> dict[str, bytes]:
    """Return the certificate, the key and the settings of a robot or a user."""
    settings = _CLIENT_FILE.format(name=name, role=role, realm=json.dumps(realm), connect=json.dumps(connect))
    return _pair(name, authority.issue(name, (), valid)) | {f"{name}.toml": settings.encode()}


def _listening_host(hosts: Sequence[str]) -> str:
    """Return where a router listens that others reach by some names: nowhere else if all are its own."""
    own = all(is_loopback(f"tls/{_in_brackets(host)}:0") for host in hosts)
    return hosts[0] if own else _ANYWHERE


def _in_brackets(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _user_line(name: str, role: str) -> str:
    return f"{json.dumps(name)} = {json.dumps(role)}\n"


def _with_user(file: Path, name: str, role: str) -> str:
    """Return the text of a router's file with one more user at its end; raises SecurityFilesError."""
    before = file.read_text(encoding="utf-8")
    after = f"{before.rstrip()}\n{_user_line(name, role)}"
    wanted = tomllib.loads(before)
    wanted["security"]["users"][name] = role
    if tomllib.loads(after) != wanted:
        raise SecurityFilesError(
            f"{file}: [security.users] is not its last table; move it to the end of the file"
        )
    return after
