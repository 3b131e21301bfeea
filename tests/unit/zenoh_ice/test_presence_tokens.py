"""Liveliness tokens as text."""

from __future__ import annotations

import pytest

from zenoh_ice._presence import (
    ServantToken,
    any_client,
    client_token,
    parse_client_token,
    parse_servant_token,
    servant_token,
)
from zenoh_ice.transport import Target

HEAD = Target("nao", "Head")
SPACE = "0123456789abcdef"


def token(
    type_id: str = "::nao::PoseHead", fingerprint: str = "f", server: str = "a", since: float = 1.0
) -> ServantToken:
    return ServantToken(HEAD, type_id, fingerprint, server, since)


@pytest.mark.parametrize("fingerprint", ["c0ffee", ""])
def test_the_token_of_a_servant_says_what_it_was_made_of(fingerprint: str) -> None:
    made = token(fingerprint=fingerprint, server="abc", since=1.7e9)
    key = servant_token(*made)
    assert key.startswith("@servant/nao/Head/::nao::PoseHead/")
    assert parse_servant_token(key) == made


@pytest.mark.parametrize("space", [SPACE, ""])
def test_the_token_of_a_client_says_what_it_was_made_of(space: str) -> None:
    key = client_token("nao", "abc", space)
    assert parse_client_token(key) == ("abc", space)
    assert key.startswith(any_client("nao").partition("*")[0])


@pytest.mark.parametrize(
    "key",
    [
        "",
        "@servant/nao/Head/::nao::PoseHead/f/a",
        "@servant/nao/Head/::nao::PoseHead/f/a/1/more",
        "@servant/nao/He ad/::nao::PoseHead/f/a/1",
        f"@servant/nao/{'x' * 129}/::nao::PoseHead/f/a/1",
        "@servant/nao/Head/PoseHead/f/a/1",
        f"@servant/nao/Head/::{'x' * 300}/f/a/1",
        "@servant/nao/Head/::nao::PoseHead//a/1",
        "@servant/nao/Head/::nao::PoseHead/f/xyz/1",
        "@servant/nao/Head/::nao::PoseHead/f/a/-1",
        "@servant/nao/Head/::nao::PoseHead/f/a/1\n",
        f"@client/nao/abc/{SPACE}",
    ],
)
def test_what_no_servant_declares_is_no_token_of_one(key: str) -> None:
    assert parse_servant_token(key) is None


@pytest.mark.parametrize(
    "key", ["", "@client/nao/abc", "@client/nao/xyz/-", "@client/nao/abc/0", f"@client/nao/abc/{SPACE}0"]
)
def test_what_no_client_declares_is_no_token_of_one(key: str) -> None:
    assert parse_client_token(key) is None
