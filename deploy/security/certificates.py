"""Make an authority and the certificates that it vouches for, for mutual TLS.

The authority is one for a laboratory or a class: its key lies in a file beside the certificates. Whoever has
that key can become anybody, so it belongs on no robot and on no router.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from zenoh_ice import ZenohIceError
from zenoh_ice.text import printable

__all__ = ["LOCAL_HOSTS", "Authority", "SecurityFilesError", "common_name", "hosts_of", "load_certificate"]

LOCAL_HOSTS: Final = ("localhost", "127.0.0.1", "::1")
"""Names under which every machine reaches itself."""

_NAME: Final = re.compile(r"[A-Za-z0-9_.\-]{1,64}")
_HOST: Final = re.compile(r"(?=.{1,253}$)[A-Za-z0-9]([A-Za-z0-9\-]{0,62})(\.[A-Za-z0-9\-]{1,63})*")
_CLOCKS_APART: Final = timedelta(minutes=10)  # by which the clocks of two machines may differ


class SecurityFilesError(ZenohIceError):
    """A certificate, a key or a file of settings cannot be made or read: the message names the file."""


@dataclass(frozen=True, slots=True)
class Authority:
    """Who vouches for certificates: its own certificate, and the key that signs."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @classmethod
    def create(cls, name: str, valid: timedelta) -> Authority:
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
        certificate = (
            _builder(subject, subject, key.public_key(), valid)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(usage, critical=True)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
            .sign(key, hashes.SHA256())
        )
        return cls(certificate, key)

    @classmethod
    def load(cls, certificate: Path, key: Path) -> Authority:
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

    def files(self) -> tuple[bytes, bytes]:
        """Return its certificate and its key in PEM."""
        return _pem(self.certificate, self.key)

    def issue(self, name: str, hosts: Sequence[str], valid: timedelta) -> tuple[bytes, bytes]:
        """Return a certificate and its key in PEM.

        `name` is the common name, by which access is granted. With `hosts`, the names and addresses under
        which others reach it, the certificate serves whoever listens too; without, only who connects.
        Raises SecurityFilesError for a name or a host that is none.
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
        return _pem(builder.sign(self.key, hashes.SHA256()), key)


def load_certificate(path: Path) -> x509.Certificate:
    """Read a certificate in PEM; raises SecurityFilesError."""
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except OSError as error:
        raise SecurityFilesError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise SecurityFilesError(f"{path}: no certificate in PEM") from error


def common_name(certificate: x509.Certificate) -> str:
    """Return the name by which access is granted to who shows a certificate; empty if it has none."""
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return printable(str(names[0].value)) if names else ""


def hosts_of(certificate: x509.Certificate) -> list[str]:
    """Return the names and addresses for which a certificate serves whoever listens."""
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
        raise SecurityFilesError(f"{name!r} is no name: write 1 to 64 letters, digits, '_', '-' or '.'")
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _host(text: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(text))
    except ValueError:
        pass
    if not _HOST.fullmatch(text):
        raise SecurityFilesError(f"{text!r} is neither the name nor the address of a machine")
    return x509.DNSName(text)


def _pem(certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> tuple[bytes, bytes]:
    """Return a certificate and its key as they are written."""
    encoded = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    return certificate.public_bytes(serialization.Encoding.PEM), encoded
