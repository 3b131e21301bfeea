"""Liveliness tokens as text, and the servants that they show."""

from __future__ import annotations

import pytest

from zenoh_ice._tokens import (
    ServantTable,
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


class TestServantTable:
    def test_a_servant_has_the_interfaces_of_its_tokens(self) -> None:
        table = ServantTable()
        table.add(token("::nao::PoseHead", "f1"))
        table.add(token("::Ice::Object", ""))
        assert table.interfaces[HEAD] == {"::nao::PoseHead": "f1", "::Ice::Object": ""}
        (info,) = table.servers[HEAD].values()
        assert (info.identity, info.server, info.since) == ("Head", "a", 1.0)

    def test_it_is_there_until_the_last_token_goes(self) -> None:
        table = ServantTable()
        tokens = [token("::nao::PoseHead"), token("::Ice::Object")]
        for each in tokens:
            table.add(each)
        assert table.came_at(HEAD) > 0
        table.remove(tokens[0])
        assert table.interfaces[HEAD] == {"::Ice::Object": "f"}
        assert table.lost_at(HEAD) == -1
        table.remove(tokens[1])
        assert HEAD not in table.interfaces
        assert table.lost_at(HEAD) > 0
        assert table.last_server(HEAD) == "a"
        assert table.came_at(HEAD) == -1
        assert not table.holds("nao")

    def test_the_end_of_a_token_that_never_came_changes_nothing(self) -> None:
        table = ServantTable()
        table.add(token(fingerprint="f1"))
        table.remove(token(fingerprint="f2"))
        table.remove(token(server="b"))
        assert table.interfaces[HEAD] == {"::nao::PoseHead": "f1"}
        assert table.lost_at(HEAD) == -1

    def test_of_two_servers_the_first_counts_where_they_differ(self) -> None:
        table = ServantTable()
        table.add(token(fingerprint="late", server="b", since=2.0))
        table.add(token(fingerprint="early", server="a", since=1.0))
        table.add(token("::late::Alone", server="b", since=2.0))
        assert table.interfaces[HEAD] == {"::nao::PoseHead": "early", "::late::Alone": "f"}
        assert table.serves("a")
        table.remove(token(fingerprint="early", server="a", since=1.0))
        assert table.interfaces[HEAD] == {"::nao::PoseHead": "late", "::late::Alone": "f"}
        assert table.lost_at(HEAD) > 0  # one of both
        assert not table.serves("a")

    def test_a_token_that_comes_twice_goes_once(self) -> None:
        table = ServantTable()
        for _ in range(2):
            table.add(token())
        table.remove(token())
        assert HEAD not in table.interfaces
