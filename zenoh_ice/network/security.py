"""What is wrong or dangerous about settings of security, found before a session is opened."""

from __future__ import annotations

import stat
from pathlib import Path
from typing import Final

from ..exceptions import ConfigurationException
from ..settings import PATHS, Security, Settings
from .endpoints import is_loopback, protocol

__all__ = ["check_security", "exposure"]

_PRIVATE: Final = ("key", "passwords")


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
