"""The key by which a page comes in again after a restart, and the file that keeps it."""

from __future__ import annotations

import hashlib
import hmac
import logging
from pathlib import Path

import pytest

from visualhfsm._editor.resumption import Resumption, kept_key

KEY = bytes(range(32))


def signed(text: str, key: bytes = KEY) -> str:
    return hmac.new(key, text.encode(), hashlib.sha256).hexdigest()


def test_both_sides_prove_that_they_have_the_key() -> None:
    resumption = Resumption(KEY)
    offer = resumption.prove("nonce")
    assert offer["proof"] == signed(f"server:nonce:{offer['challenge']}")
    assert resumption.accepts(offer["challenge"], signed(f"page:{offer['challenge']}"))


def test_a_challenge_is_answered_once_and_only_with_the_key() -> None:
    resumption = Resumption(KEY)
    challenge = resumption.prove("")["challenge"]
    answer = signed(f"page:{challenge}")
    assert not resumption.accepts(challenge, signed(f"page:{challenge}", bytes(32)))
    assert not resumption.accepts(challenge, answer)
    challenge = resumption.prove("")["challenge"]
    assert resumption.accepts(challenge, signed(f"page:{challenge}"))
    assert not resumption.accepts(challenge, signed(f"page:{challenge}"))
    assert not resumption.accepts("own", signed("page:own"))


def test_the_servers_own_proof_is_no_answer() -> None:
    resumption = Resumption(KEY)
    challenge = resumption.prove("")["challenge"]
    assert not resumption.accepts(challenge, resumption.prove(f"page:{challenge}")["proof"])


def test_only_the_newest_challenges_count() -> None:
    resumption = Resumption(KEY)
    first = resumption.prove("")["challenge"]
    for _ in range(64):
        resumption.prove("")
    assert not resumption.accepts(first, signed(f"page:{first}"))


def test_the_key_of_a_root_and_port_is_kept_for_its_owner_alone(tmp_path: Path) -> None:
    keys = tmp_path / "state" / "keys"
    key = kept_key(keys, tmp_path, 8800)
    assert len(key) == 32
    assert kept_key(keys, tmp_path, 8800) == key
    assert kept_key(keys, tmp_path, 8801) != key
    assert kept_key(keys, keys, 8800) != key
    assert {file.stat().st_mode & 0o777 for file in keys.iterdir()} == {0o600}
    assert keys.stat().st_mode & 0o777 == 0o700


def spoil_rights(file: Path) -> None:
    file.chmod(0o644)


def spoil_content(file: Path) -> None:
    file.write_bytes(b"")


def spoil_link(file: Path) -> None:
    file.rename(file.with_suffix(".moved"))
    file.symlink_to(file.with_suffix(".moved"))


@pytest.mark.parametrize("spoil", [spoil_rights, spoil_content, spoil_link])
def test_a_key_that_others_may_know_is_not_used(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, spoil
) -> None:
    key = kept_key(tmp_path / "keys", tmp_path, 8800)
    (file,) = (tmp_path / "keys").iterdir()
    spoil(file)
    with caplog.at_level(logging.WARNING):
        other = kept_key(tmp_path / "keys", tmp_path, 8800)
    assert (len(other), other == key) == (32, False)
    assert "open the page again after a restart" in caplog.text


def test_a_directory_that_cannot_be_written_is_reported(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").touch()
    with caplog.at_level(logging.WARNING):
        assert len(kept_key(tmp_path / "file" / "keys", tmp_path, 8800)) == 32
    assert "open the page again after a restart" in caplog.text
