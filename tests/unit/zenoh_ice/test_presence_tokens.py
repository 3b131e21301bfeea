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


@pytest.mark.parametrize("fingerprint", ["c0ffee", ""])
@pytest.mark.parametrize("door", [f"{SPACE}.4321.7", ""])
def test_the_token_of_a_servant_says_what_it_was_made_of(fingerprint: str, door: str) -> None:
    made = ServantToken(HEAD, "::nao::PoseHead", fingerprint, "abc", 1.7e9, door)
    key = servant_token(*made[:5], door=door)
    assert key.startswith("@servant/nao/Head/::nao::PoseHead/")
    assert parse_servant_token(key) == made


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
        "@servant/nao/He ad/::nao::PoseHead/f/a/1",
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
