"""What a component knows of security: its own certificate and password, and what others may do through it."""

from __future__ import annotations

import stat
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final

from ..exceptions import ConfigurationException
from .access import Role, parse_role

__all__ = ["EVERYBODY", "PATHS", "Security", "resolved"]

EVERYBODY: Final = "*"
"""The user that stands for everybody who is let in at all."""

PATHS: Final = ("authority", "certificate", "key", "passwords")
"""The settings that name files."""

_OWN: Final = ("authority", "certificate", "key", "user", "password")
_TEXTS: Final = (*_OWN, "passwords")
_LONGEST_NAME: Final = 64


@dataclass(frozen=True, slots=True)
class Security:
    """The settings of `[security]`; all of them are empty where everybody may do everything.

    Each field is checked by itself when the object is made, and a bad one raises ValueError with what to do;
    `check` looks at all of them together, when all their sources are known.
    """

    authority: str = ""
    """File (PEM) of the certificate of the authority that vouches for everybody else."""
    certificate: str = ""
    """File (PEM) of the component's own certificate, which it shows to others."""
    key: str = ""
    """File (PEM) of the key of the certificate."""
    user: str = ""
    """Name under which the component logs in, where whoever listens asks for one."""
    password: str = field(default="", repr=False)
    """Password of that user."""
    passwords: str = ""
    """File of the users who may connect: a line `NAME:PASSWORD` for each."""
    mutual: bool = True
    """Whether those that connect by TLS must show a certificate of the authority."""
    roles: Mapping[str, Role] = field(default_factory=dict, hash=False)
    """What may be done through this component, by the name of the role; without any, everything."""
    users: Mapping[str, str] = field(default_factory=dict, hash=False)
    """The role of each certificate, by its common name, and of each user; `*` is everybody who is let in."""

    def __post_init__(self) -> None:
        for name in _TEXTS:
            value = getattr(self, name)
            if isinstance(value, Path):
                value = str(value)
            if not isinstance(value, str) or "\0" in value:
                raise ValueError(f"{name}: write text")
            object.__setattr__(self, name, _absolute(name, value) if name in PATHS and value else value)
        if not isinstance(self.mutual, bool):
            raise ValueError("mutual: write true or false")
        object.__setattr__(self, "roles", _parse_roles(self.roles))
        object.__setattr__(self, "users", _parse_users(self.users, self.roles))

    @property
    def has_tls(self) -> bool:
        """Whether the component can tell by TLS whom it talks to."""
        return bool(self.authority)

    def merged(self, changes: object) -> Security:
        """Return a copy with some fields changed; raises ValueError for an unknown one or a bad value."""
        if isinstance(changes, Security):
            return changes
        if not isinstance(changes, Mapping):
            raise ValueError("write a table, such as [security]")
        known = [item.name for item in fields(Security)]
        for name in changes:
            if name not in known:
                raise ValueError(f"there is no setting {name!r} in it; there is {', '.join(known)}")
        return replace(self, **changes)

    def texts(self) -> dict[str, str]:
        """Return what a component needs to be known by others: the settings that are texts and are given."""
        return {name: getattr(self, name) for name in _OWN if getattr(self, name)}

    def describe(self) -> dict[str, str]:
        """Return every setting that differs from its default as text, passwords hidden."""
        rows: dict[str, str] = {}
        for item in fields(Security):
            value = getattr(self, item.name)
            if item.name == "password" and value:
                rows[item.name] = "(hidden)"
            elif item.name == "mutual":
                if not value:
                    rows[item.name] = "false"
            elif item.name == "users":
                if value:
                    rows[item.name] = ", ".join(f"{user}: {role}" for user, role in value.items())
            elif value:
                rows[item.name] = value if isinstance(value, str) else ", ".join(value)
        return rows

    def check(self) -> list[str]:
        """Check that the settings belong together, and what the files hold; return what is dangerous.

        Raises ConfigurationException, naming the setting and what to do.
        """
        self._check_together()
        for name in PATHS:
            path = getattr(self, name)
            if path:
                _check_readable(f"security.{name}", Path(path))
        if self.passwords:
            _check_passwords(Path(self.passwords))
        if self.authority:
            self._check_tls()
        return [
            f"{getattr(self, name)} can be read by others on this machine: chmod 600 it"
            for name in ("key", "passwords")
            if getattr(self, name) and _is_open(Path(getattr(self, name)))
        ]

    def _check_tls(self) -> None:
        import ssl  # here: it takes long to load, and few need it

        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        try:
            context.load_verify_locations(self.authority)
        except ssl.SSLError as error:
            raise ConfigurationException(
                f"security.authority = {self.authority!r}: no certificate in PEM"
            ) from error
        if not self.certificate:
            return
        try:
            # Without a password for the key: who runs unattended cannot be asked for one.
            context.load_cert_chain(self.certificate, self.key, password="")
        except ssl.SSLError as error:
            mismatch = error.reason == "KEY_VALUES_MISMATCH"
            what = (
                "the key is not that of the certificate"
                if mismatch
                else "not a certificate and its key in PEM"
            )
            raise ConfigurationException(
                f"security.certificate = {self.certificate!r}, security.key = {self.key!r}: {what}"
            ) from error

    def _check_together(self) -> None:
        if bool(self.certificate) != bool(self.key):
            missing, present = ("key", "certificate") if self.certificate else ("certificate", "key")
            raise ConfigurationException(f"security.{present} without security.{missing}: name both files")
        if self.certificate and not self.authority:
            raise ConfigurationException(
                "security.certificate without security.authority: name the file of who vouches for others"
            )
        if bool(self.user) != bool(self.password):
            raise ConfigurationException("security.user and security.password belong together: give both")
        if self.roles and not self.passwords and not (self.authority and self.mutual):
            raise ConfigurationException(
                "security.roles without security.authority or security.passwords: nobody could tell who "
                "somebody is; name the file of the authority, or that of the passwords"
            )


def resolved(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the table `[security]` of a file with the files that it names as seen from its folder."""
    return {
        name: str(folder / value)
        if name in PATHS and isinstance(value, str) and value and not value.startswith("~")
        else value
        for name, value in table.items()
    }


def _absolute(name: str, path: str) -> str:
    # Another process that is told of the file may run in another directory.
    try:
        return str(Path(path).expanduser().absolute())
    except (OSError, RuntimeError) as error:
        raise ValueError(f"{name}: {path!r}: {error}") from None


def _parse_roles(value: object) -> dict[str, Role]:
    if not isinstance(value, Mapping):
        raise ValueError("roles: write a table for each, such as [security.roles.student]")
    roles: dict[str, Role] = {}
    for name, role in value.items():
        _check_name("roles", name)
        try:
            roles[name] = role if isinstance(role, Role) else parse_role(role)
        except ValueError as error:
            raise ValueError(f"roles.{name}: {error}") from None
    return roles


def _parse_users(value: object, roles: Mapping[str, Any]) -> dict[str, str]:
    if not isinstance(value, Mapping):
        raise ValueError('users: write a table of NAME = "ROLE"')
    for user, role in value.items():
        _check_name("users", user)
        if not isinstance(role, str) or role not in roles:
            known = f"there is {', '.join(roles)}" if roles else "there is none"
            raise ValueError(f"users.{user}: there is no role {role!r}; {known}")
    return dict(value)


def _check_name(table: str, name: object) -> None:
    if not isinstance(name, str) or not 0 < len(name) <= _LONGEST_NAME or not name.isprintable():
        raise ValueError(f"{table}: {name!r} is no name of 1 to {_LONGEST_NAME} characters")


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


def _is_open(path: Path) -> bool:
    return bool(path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO))
