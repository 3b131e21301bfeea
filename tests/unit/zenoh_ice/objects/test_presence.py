"""What a process remembers of the servants of others, with any transport."""

from __future__ import annotations

import time
from collections.abc import Callable

import msgspec
import pytest

from tests.support.limits import FOREVER
from tests.support.waiting import at_once
from zenoh_ice import ConnectionLostException, SystemException
from zenoh_ice.data.keys import Target, servant_token
from zenoh_ice.data.status import own_version
from zenoh_ice.objects._presence import Presence
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import NoAnswer, Registration

HEAD = Target("nao", "Head")
OWN = own_version()

Announce = Callable[..., Registration]


def make_presence(
    submit: Callable[[Callable[[], object]], None] = lambda _: None,
    is_served: Callable[[Target, float], bool] = lambda *_: False,
    limits: Limits = LIMITS,
) -> tuple[Presence, InProcessTransport]:
    transport = InProcessTransport(Pool(0, "test"))
    presence = Presence(transport, submit, is_served=is_served, needs_links=True, limits=limits)
    presence.watch("nao")
    return presence, transport


def flood() -> list[str]:
    """Return 1,122 tokens, for each servant two more than are remembered."""
    return [
        servant_token(Target("nao", f"I{identity}"), f"::flood::T{kind}", "f", f"{server:x}", 1.0)
        for identity in range(17)
        for server in range(1, 7)
        for kind in range(11)
    ]


def test_a_flood_of_tokens_is_bounded_and_forgotten() -> None:
    presence, transport = make_presence(limits=Limits(tokens=1 << 10))
    tokens = flood()
    announced = [transport.announce(token) for token in tokens]
    known = [info for info in presence.servants("nao") for _ in info.interfaces]
    assert len(known) == 1 << 10 < len(tokens)
    for token in announced:
        token.close()
    assert not presence.servants("nao")
    transport.announce(servant_token(HEAD, "::nao::PoseHead", "f", "abc", 1.0))
    assert presence.interfaces(HEAD) == {"::nao::PoseHead": "f"}
    assert presence.identities("nao") == ["Head"]


def test_a_servant_of_too_many_interfaces_is_cut() -> None:
    presence, transport = make_presence()
    for number in range(200):
        transport.announce(servant_token(HEAD, f"::nao::I{number}", "f", "abc", 1.0))
    assert len(presence.interfaces(HEAD)) == 64


def test_listeners_are_called_once_for_all_that_comes_before_they_are() -> None:
    jobs: list[Callable[[], object]] = []
    calls: list[str] = []
    presence, transport = make_presence(jobs.append)
    presence.add_listener(lambda: calls.append("called"))
    for token in flood()[:100]:
        transport.announce(token)
    assert len(jobs) == 1
    jobs.pop()()
    assert calls == ["called"]
    transport.announce(servant_token(HEAD, "::nao::PoseHead", "f", "abc", 1.0))
    assert len(jobs) == 1


def explained(presence: Presence) -> SystemException:
    """Return why a call of the head that starts now and ends at once has no answer."""
    return presence.explain_no_answer(HEAD, "Head.stop", time.monotonic(), FOREVER, NoAnswer(timed_out=False))


@at_once
def test_a_call_with_a_long_limit_looks_little_longer_for_a_servant_that_is_not_there() -> None:
    presence, transport = make_presence(limits=Limits(longest_grace=0.02))
    transport.token_delay = 0.001
    assert not presence.wait_for(HEAD, None, 100 * FOREVER)


@at_once
def test_a_call_of_a_servant_that_is_away_is_explained_at_once() -> None:
    presence, transport = make_presence(limits=Limits(loss_notice=FOREVER))
    transport.announce(servant_token(HEAD, "::nao::PoseHead", "f", "abc", 1.0)).close()
    assert isinstance(explained(presence), ConnectionLostException)


def test_word_of_a_loss_that_comes_after_the_end_of_a_call_explains_it() -> None:
    tokens: list[Registration] = []

    def is_served(target: Target, timeout: float) -> bool:
        tokens[0].close()
        return False

    presence, transport = make_presence(is_served=is_served)
    tokens.append(transport.announce(servant_token(HEAD, "::nao::PoseHead", "f", "abc", 1.0)))
    error = explained(presence)
    assert isinstance(error, ConnectionLostException)
    assert "is offline" in str(error)


@pytest.mark.slow
@pytest.mark.parametrize("noticed", [True, False], ids=["first", "late"])
def test_a_call_whose_server_was_replaced_meanwhile_is_not_called_denied(noticed: bool) -> None:
    """The token of the new server may come before the end of the old one's."""
    presence, transport = make_presence(is_served=lambda *_: True)
    old = transport.announce(servant_token(HEAD, "::nao::PoseHead", "f", "abc", 1.0))
    started = time.monotonic()
    transport.announce(servant_token(HEAD, "::nao::PoseHead", "f", "def", 2.0))
    if noticed:
        old.close()
    error = presence.explain_no_answer(HEAD, "Head.stop", started, FOREVER, NoAnswer(timed_out=False))
    assert isinstance(error, ConnectionLostException)
    assert ("restarted during the call" if noticed else "missed it") in str(error)
    assert presence.came_since(HEAD, started)


def status_of(version: str) -> bytes:
    """Return the status that a process of another version sends: with a member that we do not know."""
    return msgspec.msgpack.encode({"version": version, "program": 1, "since": "yesterday"})


OLD_TOKEN = "@servant/nao/Head/::nao::PoseHead/c0ffee"


@pytest.mark.parametrize(
    ("form", "version", "named"),
    [
        ("", None, "in another version"),
        ("/{id}/of/another/form", None, "in another version"),
        ("/{id}/of/another/form", "0.2.0", "0.2.0"),
        ("/{id}/of/another/form", OWN, "in another version"),
    ],
    ids=["0.1.0", "silent", "says it", "of a day between two versions"],
)
def test_a_realm_of_another_version_is_called_so(form: str, version: str | None, named: str) -> None:
    presence, transport = make_presence()
    if version is not None:
        transport.serve_status("nao", lambda: status_of(version))
    announced = transport.announce(OLD_TOKEN + form.format(id=transport.id))
    expected = f"VisualHFSM {named}, this is {OWN}: install the same version on both sides"
    assert str(presence.explain_absence(HEAD)) == (
        f"no servant 'Head' in realm 'nao'; the realm has servants of {expected}"
    )
    assert not presence.servants("nao")
    announced.close()
    assert "the realm has no servants: no robot is here" in str(presence.explain_absence(HEAD))


@pytest.mark.parametrize(
    ("rest", "version", "other"),
    [
        ("/-/1", OWN, ""),
        ("/-/1", None, ""),
        ("/-/1", "0.2.0", "0.2.0"),
        ("/-/2", "0.9.0", "0.9.0"),
        ("", None, "in another version"),
    ],
)
def test_a_server_of_another_version_is_told_from_ours(rest: str, version: str | None, other: str) -> None:
    presence, transport = make_presence()
    if version is not None:
        transport.serve_status("nao", lambda: status_of(version))
    transport.announce(f"{OLD_TOKEN}/{transport.id}/1{rest}")
    text = f"its server has VisualHFSM {other}, this is {OWN}: install the same version on both sides"
    assert presence.other_version(HEAD, FOREVER) == (text if other else "")
    assert presence.has_other_format(HEAD) is (rest != "/-/1")


@pytest.fixture
def realm() -> tuple[Presence, Announce]:
    """What follows the servants of a realm, and what announces a token of the head."""
    presence, transport = make_presence()

    def announce(
        type_id: str = "::nao::PoseHead", fingerprint: str = "f", server: str = "a", since: float = 1.0
    ) -> Registration:
        return transport.announce(servant_token(HEAD, type_id, fingerprint, server, since))

    return presence, announce


class TestTokens:
    def test_a_servant_has_the_interfaces_of_its_tokens(self, realm: tuple[Presence, Announce]) -> None:
        presence, announce = realm
        announce("::nao::PoseHead", "f1")
        announce("::Ice::Object", "")
        assert presence.interfaces(HEAD) == {"::nao::PoseHead": "f1", "::Ice::Object": ""}
        (info,) = presence.servers(HEAD)
        assert (info.identity, info.server, info.since) == ("Head", "a", 1.0)
        assert info.interfaces == presence.interfaces(HEAD)

    def test_it_is_there_until_the_last_token_goes(self, realm: tuple[Presence, Announce]) -> None:
        presence, announce = realm
        tokens = [announce("::nao::PoseHead"), announce("::Ice::Object")]
        tokens[0].close()
        assert presence.interfaces(HEAD) == {"::Ice::Object": "f"}
        assert not presence.is_lost(HEAD)
        assert not presence.lost_since(HEAD, 0.0)
        tokens[1].close()
        assert not presence.interfaces(HEAD)
        assert presence.is_lost(HEAD)
        assert presence.lost_since(HEAD, 0.0)
        assert not presence.servers(HEAD)
        assert not presence.identities("nao")

    def test_the_end_of_another_token_changes_nothing(self, realm: tuple[Presence, Announce]) -> None:
        presence, announce = realm
        announce(fingerprint="f1")
        announce(fingerprint="f2", since=0.5).close()
        announce(server="b").close()
        assert presence.interfaces(HEAD) == {"::nao::PoseHead": "f1"}
        assert [info.server for info in presence.servers(HEAD)] == ["a"]

    def test_of_two_servers_the_first_counts_where_they_differ(
        self, realm: tuple[Presence, Announce]
    ) -> None:
        presence, announce = realm
        announce(fingerprint="late", server="b", since=2.0)
        early = announce(fingerprint="early", server="a", since=1.0)
        announce("::late::Alone", server="b", since=2.0)
        assert presence.interfaces(HEAD) == {"::nao::PoseHead": "early", "::late::Alone": "f"}
        assert [info.server for info in presence.servers(HEAD)] == ["a", "b"]
        early.close()
        assert presence.interfaces(HEAD) == {"::nao::PoseHead": "late", "::late::Alone": "f"}
        assert presence.lost_since(HEAD, 0.0)  # one of both
        assert [info.server for info in presence.servers(HEAD)] == ["b"]

    def test_a_token_that_comes_twice_goes_once(self, realm: tuple[Presence, Announce]) -> None:
        presence, announce = realm
        announced = [announce() for _ in range(2)]
        announced[0].close()
        assert not presence.interfaces(HEAD)
        other = announce("::Ice::Object")
        announced[1].close()  # the end of a token that is not there
        assert presence.interfaces(HEAD) == {"::Ice::Object": "f"}
        other.close()
        assert not presence.interfaces(HEAD)

    def test_one_that_comes_again_and_again_leaves_room_for_others(
        self, realm: tuple[Presence, Announce]
    ) -> None:
        presence, announce = realm
        for _ in range(1 << 14):
            announce()
        announce("::Ice::Object")
        assert set(presence.interfaces(HEAD)) == {"::nao::PoseHead", "::Ice::Object"}
