"""The folder of an authority: what its certificates are good for, and that it changes as a whole or not at all."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, ed25519
from cryptography.x509.oid import ExtendedKeyUsageOID
from cryptography.x509.verification import PolicyBuilder, Store

from nao_tools._security.folder import (
    SecurityFilesError,
    SecurityFolder,
    common_name,
    hosts_of,
    load_certificate,
)
from zenoh_ice.settings import load_settings

DAY = timedelta(days=1)


@pytest.fixture
def folder(tmp_path: Path) -> SecurityFolder:
    folder = SecurityFolder(tmp_path / "keys")
    folder.create(realm="lab", hosts=["robot.lab", "192.168.1.5"], port=7447, valid=DAY)
    return folder


def certificate(folder: SecurityFolder, name: str) -> x509.Certificate:
    return load_certificate(folder.path / f"{name}.pem")


def content(folder: SecurityFolder) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.path.iterdir()}


def test_the_settings_are_returned_with_those_of_the_router_first(tmp_path: Path) -> None:
    files = SecurityFolder(tmp_path).create(realm="lab", hosts=["robot.lab"], port=7447, valid=DAY)
    names = ["router", "robot", "operator", "gateway", "student", "agent"]
    assert files == [tmp_path / f"{name}.toml" for name in names]
    ports = {load_settings(file, environment={}).connect for file in files[1:]}
    assert ports == {("tls/robot.lab:7447",)}  # everybody's, where the operator has no other


@pytest.mark.parametrize("name", ["router", "robot", "student"])
def test_a_key_belongs_to_its_certificate_which_the_authority_has_signed(
    folder: SecurityFolder, name: str
) -> None:
    issued = certificate(folder, name)
    key = serialization.load_pem_private_key((folder.path / f"{name}.key").read_bytes(), None)
    assert key.public_key() == issued.public_key()
    issued.verify_directly_issued_by(certificate(folder, "authority"))


def test_clients_of_tls_trust_the_router_by_each_of_its_names(folder: SecurityFolder) -> None:
    trust = PolicyBuilder().store(Store([certificate(folder, "authority")]))
    verifier = trust.build_server_verifier(x509.DNSName("robot.lab"))
    assert verifier.verify(certificate(folder, "router"), [])
    names = ["robot.lab", "192.168.1.5", "localhost", "127.0.0.1", "::1"]
    assert hosts_of(certificate(folder, "router")) == names


def test_who_has_the_certificate_of_a_user_cannot_be_taken_for_a_router(folder: SecurityFolder) -> None:
    def usages(name: str) -> list[x509.ObjectIdentifier]:
        return [*certificate(folder, name).extensions.get_extension_for_class(x509.ExtendedKeyUsage).value]

    assert usages("student") == [ExtendedKeyUsageOID.CLIENT_AUTH]
    assert hosts_of(certificate(folder, "student")) == []
    assert usages("router") == [ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH]


def test_a_user_can_issue_no_certificate_and_the_authority_none_that_can(folder: SecurityFolder) -> None:
    def limits(name: str) -> x509.BasicConstraints:
        return certificate(folder, name).extensions.get_extension_for_class(x509.BasicConstraints).value

    assert limits("student") == limits("router") == x509.BasicConstraints(ca=False, path_length=None)
    assert limits("authority") == x509.BasicConstraints(ca=True, path_length=0)


def test_a_certificate_is_valid_at_once_on_a_clock_that_is_late_and_not_longer_than_asked_for(
    folder: SecurityFolder,
) -> None:
    issued, now = certificate(folder, "robot"), datetime.now(UTC)
    assert issued.not_valid_before_utc < now - timedelta(minutes=9)
    assert now < issued.not_valid_after_utc <= now + DAY
    assert certificate(folder, "authority").not_valid_after_utc > now + 3000 * DAY


def test_a_user_is_known_by_the_common_name_and_has_the_role(folder: SecurityFolder) -> None:
    files = folder.add("ann", "operator", valid=DAY)
    assert [file.name for file in files] == ["authority.pem", "ann.pem", "ann.key", "ann.toml"]
    assert common_name(certificate(folder, "ann")) == "ann"
    router = load_settings(folder.path / "router.toml", environment={})
    assert router.security.users["ann"] == "operator"
    assert not [*folder.path.glob("new.*")]


def test_a_certificate_that_is_renewed_has_another_key_and_the_names_of_the_old_one(
    folder: SecurityFolder,
) -> None:
    old = certificate(folder, "router")
    folder.renew("router", valid=2 * DAY)
    new = certificate(folder, "router")
    assert new.public_key() != old.public_key()
    assert (common_name(new), hosts_of(new)) == (common_name(old), hosts_of(old))
    key = serialization.load_pem_private_key((folder.path / "router.key").read_bytes(), None)
    assert key.public_key() == new.public_key()


def test_a_folder_whose_files_cannot_all_be_written_gets_none(tmp_path: Path) -> None:
    folder = SecurityFolder(tmp_path)
    (tmp_path / "student.key").write_text("mine")  # among the last
    with pytest.raises(SecurityFilesError, match=r"student\.key: cannot be written: File exists"):
        folder.create(realm="lab", hosts=["robot.lab"], port=7447, valid=DAY)
    assert content(folder) == {"student.key": b"mine"}


@pytest.mark.parametrize(
    ("last", "name"),
    [
        ("", "ann"),
        ("[security.roles.guest]\nread = []\n", "ann"),
        ("[security.roles.guest]\nread = []\n", "read"),
    ],
    ids=["no users", "another table", "another table that has the name"],
)
def test_a_router_whose_users_are_not_at_the_end_of_its_file_stays_as_it_is(
    folder: SecurityFolder, last: str, name: str
) -> None:
    router = folder.path / "router.toml"
    router.write_text(router.read_text().partition("# The role of each certificate")[0] + last)
    before = content(folder)
    why = r"router\.toml: \[security\.users\] is not its last table; move it to the end of the file"
    with pytest.raises(SecurityFilesError, match=why):
        folder.add(name, "student", valid=DAY)
    assert content(folder) == before


@pytest.mark.parametrize(
    ("key", "why"),
    [
        (b"nothing", "not the key of an authority"),
        (ed25519.Ed25519PrivateKey.generate(), "not a key on an elliptic curve"),
        (None, "cannot be read: No such file or directory"),
    ],
    ids=["no key", "of another kind", "none"],
)
def test_an_authority_without_a_sound_key_issues_nothing(
    folder: SecurityFolder, key: bytes | ed25519.Ed25519PrivateKey | None, why: str
) -> None:
    file = folder.path / "authority.key"
    file.unlink()
    if isinstance(key, bytes):
        file.write_bytes(key)
    elif key is not None:
        form = serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        file.write_bytes(key.private_bytes(serialization.Encoding.PEM, *form))
    before = content(folder)
    with pytest.raises(SecurityFilesError, match=rf"authority\.key: {why}"):
        folder.add("ann", "student", valid=DAY)
    assert content(folder) == before


def test_what_is_no_certificate_is_named(folder: SecurityFolder) -> None:
    (folder.path / "robot.pem").write_text("nothing")
    with pytest.raises(SecurityFilesError, match=r"robot\.pem: no certificate in PEM"):
        folder.renew("robot", valid=DAY)


def test_a_certificate_of_others_without_a_name_grants_access_to_nobody(tmp_path: Path) -> None:
    key, now = ec.generate_private_key(ec.SECP256R1()), datetime.now(UTC)
    nameless = x509.Name([])
    built = (
        x509.CertificateBuilder()
        .subject_name(nameless)
        .issuer_name(nameless)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now)
        .not_valid_after(now + DAY)
    )
    issued = built.sign(key, hashes.SHA256())
    assert (common_name(issued), hosts_of(issued)) == ("", [])
