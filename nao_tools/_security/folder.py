"""A folder with an authority, its certificates for mutual TLS, and the settings that go with them.

The authority serves a laboratory or a class: its key is a file beside the certificates. Anybody with
that key can impersonate anybody, so it must not be on a robot or a router.
"""

from __future__ import annotations

import ipaddress
import json
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from zenoh_ice import ZenohIceError
from zenoh_ice.data.text import printable
from zenoh_ice.settings import Settings, is_loopback, load_settings

_LOCAL_HOSTS: Final = ("localhost", "127.0.0.1", "::1")  # under which every machine reaches itself
_NAME: Final = re.compile(r"[A-Za-z0-9_.\-]{1,64}")
_HOST: Final = re.compile(r"(?=.{1,253}$)[A-Za-z0-9]([A-Za-z0-9\-]{0,62})(\.[A-Za-z0-9\-]{1,63})*")
_CLOCKS_APART: Final = timedelta(minutes=10)  # by which the clocks of two machines may differ
_AUTHORITY_VALID: Final = timedelta(days=3650)
_AUTHORITY: Final = "authority"
_ROUTER: Final = "router"
_ANYWHERE: Final = "0.0.0.0"  # noqa: S104 - other machines must reach the router

_STUDENT: Final = "student"
_GUESTS: Final = (_STUDENT, "agent")  # whom a firewall keeps from the endpoint of the others
_CLIENT_ROLES: Final = ("robot", "operator", "gateway", *_GUESTS)  # with which the file of a router begins

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

# What each role may do. Everything else is denied.
#   call   operations to call, and to read where they are streams, as IDENTITY.OPERATION
#   read   streams to read, without calling anything
#   serve  identities to serve
#   liveliness = false   robots do not notice when its programs end, and it cannot flood them with tokens
#   ros_call, ros_read, ros_serve   the same in ROS, by names; topics to publish are called by name: /cmd_vel
# `*` stands for any characters of a name; `**` alone is everything.

[security.roles.robot]
serve = ["**"]

[security.roles.operator]
call = ["**"]
serve = ["Hfsm.*"]
ros_call = ["**"]
ros_serve = ["**"]

[security.roles.gateway]
call = ["**"]
ros_serve = ["**"]

[security.roles.student]
call = ["*.get*", "Safety.emergencyStop"]
read = ["**"]
ros_call = ["/**/emergency_stop"]
ros_read = ["**"]
liveliness = false

# It reads, stops the robot, and its behaviors can be watched: add what they may move, such as "Head.*".
[security.roles.agent]
call = ["*.get*", "*.explain", "Safety.emergencyStop"]
serve = ["Hfsm.*"]

# The role of each certificate, by its common name; "*" is every accepted user.
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


class SecurityFilesError(ZenohIceError):
    """A certificate, a key or a file of settings cannot be made or read: the message names the file."""


@dataclass(frozen=True, slots=True)
class SecurityFolder:
    """The folder of an authority; every method raises SecurityFilesError for a file that is in the way."""

    path: Path

    def create(
        self,
        *,
        realm: str,
        hosts: Sequence[str],
        port: int,
        operator_port: int | None = None,
        valid: timedelta,
    ) -> list[Path]:
        """Make everything for a router, a robot and its users; return the files of settings.

        `hosts` are the names and addresses by which others reach the router; they connect to the first.
        All but students and agents use `operator_port`, an endpoint that a firewall can keep for them; by
        default the same as everybody. Raises ConfigurationException for an invalid realm, SecurityFilesError
        for an invalid host.
        """
        Settings(realm=realm)
        if (self.path / "authority.key").exists():
            raise SecurityFilesError(
                f"{self.path} has an authority already: `nao security add` makes certificates of it,"
                " or choose another folder"
            )
        authority = _Authority.create(f"authority.{realm}"[:64], _AUTHORITY_VALID)
        files = _pem(_AUTHORITY, authority.certificate, authority.key)
        files |= _pem(_ROUTER, *authority.issue(_ROUTER, [*hosts, *_LOCAL_HOSTS], valid))
        users = "".join(_user_line(role, role) for role in _CLIENT_ROLES)
        ports = dict.fromkeys(_CLIENT_ROLES, operator_port or port) | dict.fromkeys(_GUESTS, port)
        here = _in_brackets(_listening_host(hosts))
        listen = [json.dumps(f"tls/{here}:{each}") for each in sorted({*ports.values()})]
        files["router.toml"] = _ROUTER_FILE.format(
            realm=json.dumps(realm), listen=", ".join(listen), users=users
        ).encode()
        for role in _CLIENT_ROLES:
            connect = f"tls/{_in_brackets(hosts[0])}:{ports[role]}"
            files |= _client_files(authority, role, role, realm=realm, connect=connect, valid=valid)
        self._write(files)
        return [self.path / name for name in files if name.endswith(".toml")]

    def add(self, name: str, role: str, *, valid: timedelta) -> list[Path]:
        """Issue a certificate for another user, and let the router know the user's role; return the files.

        Returns the files that the user needs. Raises SecurityFilesError for a role that the router does not
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
        client_file = self.path / f"{role if role in _CLIENT_ROLES else _STUDENT}.toml"
        connect = load_settings(client_file, environment={}).connect
        if not connect:
            raise SecurityFilesError(f"{client_file}: `connect` names no router")
        files = _client_files(
            self._authority(), name, role, realm=router.realm, connect=connect[0], valid=valid
        )
        self._write(files | {"new.router.toml": with_user.encode()})
        self._renew("router.toml")
        return [self.path / each for each in (f"{_AUTHORITY}.pem", *files)]

    def renew(self, name: str, *, valid: timedelta) -> None:
        """Replace the certificate of a name by a new one with a new key."""
        if name == _AUTHORITY:
            raise SecurityFilesError(
                f"{self.path}: an authority cannot be renewed: create another folder with new certificates"
            )
        old = load_certificate(self.path / f"{name}.pem")
        files = _pem(name, *self._authority().issue(common_name(old), hosts_of(old), valid))
        self._write({f"new.{each}": content for each, content in files.items()})
        self._renew(*files)

    def _authority(self) -> _Authority:
        return _Authority.load(self.path / f"{_AUTHORITY}.pem", self.path / f"{_AUTHORITY}.key")

    def _renew(self, *names: str) -> None:
        """Put new files in the place of old ones."""
        for name in names:
            (self.path / f"new.{name}").replace(self.path / name)

    def _write(self, files: Mapping[str, bytes]) -> None:
        """Write new files, all or none; keys can be read by their owner alone.

        Raises SecurityFilesError if one exists.
        """
        path = self.path
        with ExitStack() as undo:
            try:
                path.mkdir(parents=True, exist_ok=True)
                for name, content in files.items():
                    path = self.path / name
                    mode = 0o600 if path.suffix == ".key" else 0o666
                    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
                    undo.callback(path.unlink, missing_ok=True)
                    with os.fdopen(descriptor, "wb") as file:
                        file.write(content)
            except OSError as error:
                raise SecurityFilesError(f"{path}: cannot be written: {error.strerror}") from error
            undo.pop_all()


def _client_files(
    authority: _Authority, name: str, role: str, *, realm: str, connect: str, valid: timedelta
) -> dict[str, bytes]:
    """Return the certificate, the key and the settings of a robot or a user."""
    settings = _CLIENT_FILE.format(name=name, role=role, realm=json.dumps(realm), connect=json.dumps(connect))
    return _pem(name, *authority.issue(name, (), valid)) | {f"{name}.toml": settings.encode()}


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
    wanted["security"].setdefault("users", {})[name] = role
    with suppress(tomllib.TOMLDecodeError):  # another table has this name already
        if tomllib.loads(after) == wanted:
            return after
    raise SecurityFilesError(
        f"{file}: [security.users] is not its last table; move it to the end of the file"
    )


@dataclass(frozen=True, slots=True)
class _Authority:
    """An authority: its certificate, and the key that signs."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @classmethod
    def create(cls, name: str, valid: timedelta) -> _Authority:
        """Return a new authority."""
        key = ec.generate_private_key(ec.SECP256R1())
        subject = _subject(name)
        usage = x509.KeyUsage(
            key_cert_sign=True,
            crl_sign=True,
            digital_signature=False,
            content_commitment=False,
            key_encipherment=False,
            data_encipherment=False,
            key_agreement=False,
            encipher_only=False,
            decipher_only=False,
        )
        builder = (
            _builder(subject, subject, key.public_key(), valid)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(usage, critical=True)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        )
        return cls(builder.sign(key, hashes.SHA256()), key)

    @classmethod
    def load(cls, certificate: Path, key: Path) -> _Authority:
        """Read an authority from its two files; raises SecurityFilesError."""
        try:
            loaded = serialization.load_pem_private_key(key.read_bytes(), password=None)
        except OSError as error:
            raise SecurityFilesError(f"{key}: cannot be read: {error.strerror}") from error
        except (TypeError, ValueError) as error:
            raise SecurityFilesError(f"{key}: not the key of an authority: {error}") from error
        if not isinstance(loaded, ec.EllipticCurvePrivateKey):
            raise SecurityFilesError(f"{key}: not a key on an elliptic curve")
        return cls(load_certificate(certificate), loaded)

    def issue(
        self, name: str, hosts: Sequence[str], valid: timedelta
    ) -> tuple[x509.Certificate, ec.EllipticCurvePrivateKey]:
        """Return a certificate and its key.

        `name` is the common name, by which access is granted. With `hosts`, the names and addresses under
        which others reach it, the certificate is also valid for a listener; without, only for a client.
        Raises SecurityFilesError for an invalid name or host.
        """
        key = ec.generate_private_key(ec.SECP256R1())
        usages = [ExtendedKeyUsageOID.CLIENT_AUTH]
        if hosts:
            usages.append(ExtendedKeyUsageOID.SERVER_AUTH)
        builder = (
            _builder(_subject(name), self.certificate.subject, key.public_key(), valid)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(x509.ExtendedKeyUsage(usages), critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_public_key(self.key.public_key()), critical=False
            )
        )
        if hosts:
            names = x509.SubjectAlternativeName([_host(host) for host in dict.fromkeys(hosts)])
            builder = builder.add_extension(names, critical=False)
        return builder.sign(self.key, hashes.SHA256()), key


def load_certificate(path: Path) -> x509.Certificate:
    """Read a certificate in PEM; raises SecurityFilesError."""
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except OSError as error:
        raise SecurityFilesError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise SecurityFilesError(f"{path}: no certificate in PEM") from error


def common_name(certificate: x509.Certificate) -> str:
    """Return the name that a certificate grants access to; empty if it has none."""
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return printable(str(names[0].value)) if names else ""


def hosts_of(certificate: x509.Certificate) -> list[str]:
    """Return the names and addresses at which a certificate is valid for a listener."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [str(name.value) for name in names]


def _builder(
    subject: x509.Name, issuer: x509.Name, public_key: ec.EllipticCurvePublicKey, valid: timedelta
) -> x509.CertificateBuilder:
    now = datetime.now(UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public_key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _CLOCKS_APART)
        .not_valid_after(now + valid)
    )


def _subject(name: str) -> x509.Name:
    if not _NAME.fullmatch(name):
        raise SecurityFilesError(
            f"{name!r} is not a valid name: write 1 to 64 letters, digits, '_', '-' or '.'"
        )
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _host(text: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(text))
    except ValueError:
        pass
    if not _HOST.fullmatch(text):
        raise SecurityFilesError(f"{text!r} is neither the name nor the address of a machine")
    return x509.DNSName(text)


def _pem(name: str, certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> dict[str, bytes]:
    """Return the files of a certificate and its key."""
    encoded = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    return {f"{name}.pem": certificate.public_bytes(serialization.Encoding.PEM), f"{name}.key": encoded}
