"""Liveliness tokens as text."""

from __future__ import annotations

import pytest

from zenoh_ice.data.keys import (
    ServantToken,
    Target,
    any_client,
    client_token,
    parse_client_token,
    parse_servant_token,
    servant_token,
    server_of_unknown_token,
)

HEAD = Target("nao", "Head")
SPACE = "0123456789abcdef"


@pytest.mark.parametrize("fingerprint", ["c0ffee", ""])
@pytest.mark.parametrize("address", [f"{SPACE}.4321.7", ""])
def test_the_token_of_a_servant_says_what_it_was_made_of(fingerprint: str, address: str) -> None:
    made = ServantToken(HEAD, "::nao::PoseHead", fingerprint, "abc", 1.7e9, address)
    key = servant_token(*made[:5], address=address)
    assert key.startswith("@servant/nao/Head/::nao::PoseHead/")
    assert parse_servant_token(key) == made


@pytest.mark.parametrize(
    ("rest", "format"),
    [("", 0), (f"/{SPACE}.4321.7", 0), ("/-/2", 2)],
    ids=["0.2.0", "first addresses", "newer"],
)
def test_a_token_of_another_version_says_its_format(rest: str, format: int) -> None:
    token = parse_servant_token(f"@servant/nao/Head/::nao::PoseHead/f/a/1{rest}")
    assert token is not None
    assert (token.target, token.server, token.format) == (HEAD, "a", format)


@pytest.mark.parametrize(
    ("rest", "server"), [("", ""), ("/abc/some/new/form", "abc"), ("/not hexadecimal", "")]
)
def test_a_token_of_another_form_is_known_as_a_servants(rest: str, server: str) -> None:
    assert server_of_unknown_token(f"@servant/nao/Head/::nao::PoseHead/c0ffee{rest}") == server


@pytest.mark.parametrize("key", ["@servant/nao", "@servant/nao/Head/text", "@servant/n o/Head/::A/f"])
def test_a_key_of_no_servant_names_none(key: str) -> None:
    assert server_of_unknown_token(key) is None


def test_the_token_of_a_client_says_what_it_was_made_of() -> None:
    key = client_token("nao", "abc")
    assert parse_client_token(key) == "abc"
    assert key.startswith(any_client("nao").partition("*")[0])


@pytest.mark.parametrize(
    "key",
    [
        "",
        "@servant/nao/Head/::nao::PoseHead/f/a",
        "@servant/nao/Head/::nao::PoseHead/f/a/1/more",
        "@servant/nao/Head/::nao::PoseHead/f/a/1/-/one",
        "@servant/nao/He ad/::nao::PoseHead/f/a/1",
        "@servant/nao/Head\x1b[2J/::nao::PoseHead/f/a/1",
        "@servant/nao/Head/::nao::Pose\x1b[2JHead/f/a/1",
        "@servant/nao/Head/::nao::PoseHead/c0\x1b[2Jffee/a/1",
        "@servant/nao/Head/::nao::PoseHead/" + "0" * 65 + "/a/1",
        "@servant/nao/Head/::nao::PoseHead/f/A/1",
        "@servant/nao/Head/::nao::PoseHead/f/a/" + "1" * 16,
        "@servant/nao/a/Head/::nao::PoseHead/f/a/1",
        f"@servant/nao/{'x' * 129}/::nao::PoseHead/f/a/1",
        "@servant/nao/Head/PoseHead/f/a/1",
        f"@servant/nao/Head/::{'x' * 300}/f/a/1",
        "@servant/nao/Head/::nao::PoseHead//a/1",
        "@servant/nao/Head/::nao::PoseHead/f/xyz/1",
        "@servant/nao/Head/::nao::PoseHead/f/a/-1",
        "@servant/nao/Head/::nao::PoseHead/f/a/1\n",
        f"@servant/nao/Head/::nao::PoseHead/f/a/1/{SPACE}",
        f"@servant/nao/Head/::nao::PoseHead/f/a/1/{SPACE}.1.-7",
        f"@servant/nao/Head/::nao::PoseHead/f/a/1/{SPACE}.1.{'7' * 11}",
        f"@servant/nao/Head/::nao::PoseHead/f/a/1/{SPACE}.../7",
        "@client/nao/abc",
    ],
)
def test_what_no_servant_declares_is_no_token_of_one(key: str) -> None:
    assert parse_servant_token(key) is None


@pytest.mark.parametrize(
    "key",
    ["", "@client/nao/", "@client/nao/xyz", "@client/nao/abc/0", "@client/abc", f"@client/nao/{'a' * 33}"],
)
def test_what_no_client_declares_is_no_token_of_one(key: str) -> None:
    assert not parse_client_token(key)
