"""What a process remembers of the servants of others, whoever tells it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import pytest
import zenoh

from tests.support.wire_doors import SilentSession, tell
from zenoh_ice.identity import Target
from zenoh_ice.network.clients import ClientWatch
from zenoh_ice.network.presence import Presence
from zenoh_ice.network.servant_tokens import servant_token

PUT, DELETE = zenoh.SampleKind.PUT, zenoh.SampleKind.DELETE
HEAD = Target("nao", "Head")


def make_presence(notify: Callable[[Callable[[], None]], None] = lambda _: None) -> Presence:
    return Presence(SilentSession(), [], notify)  # type: ignore[arg-type]


def flood() -> list[str]:
    """Tokens of more servants, servers and interfaces than are remembered."""
    return [
        servant_token(Target("nao", f"I{identity}"), f"::flood::T{kind}", "f", f"{server:x}", 1.0)
        for identity in range(120)
        for server in range(1, 17)
        for kind in range(12)
    ]


def test_a_flood_of_tokens_is_bounded_and_forgotten() -> None:
    presence = make_presence()
    tokens = flood()
    for token in tokens:
        tell(presence, PUT, token)
    known = [info for info in presence.servants("nao") for _ in info.interfaces]
    assert len(known) == 1 << 14 < len(tokens)
    for token in tokens:
        tell(presence, DELETE, token)
    assert not presence.servants("nao")
    tell(presence, PUT, servant_token(HEAD, "::nao::PoseHead", "f", "abc", 1.0))
    assert presence.interfaces(HEAD) == {"::nao::PoseHead": "f"}
    assert presence.identities("nao") == ["Head"]


def test_listeners_are_told_once_of_what_comes_before_they_are() -> None:
    jobs: list[Callable[[], None]] = []
    told: list[str] = []
    presence = make_presence(jobs.append)
    presence.add_listener(lambda: told.append("told"))
    for token in flood()[:100]:
        tell(presence, PUT, token)
    assert len(jobs) == 1
    jobs.pop()()
    assert told == ["told"]
    tell(presence, PUT, servant_token(HEAD, "::nao::PoseHead", "f", "abc", 1.0))
    assert len(jobs) == 1


class TestClientWatch:
    def test_clients_are_told_one_after_the_other_and_bounded(self) -> None:
        jobs: deque[Callable[[], None]] = deque()
        told: list[str] = []
        watch = ClientWatch(told.append, jobs.append, lambda _: None)
        lost = [f"{number:x}" for number in range(20_000)]
        for client in lost:
            watch.lost(client)
        assert len(jobs) == 1
        while jobs:
            jobs.popleft()()
        assert told == lost[: 1 << 14]
        watch.lost("c0ffee")
        assert len(jobs) == 1

    def test_a_callback_that_fails_keeps_nobody_from_being_told(self) -> None:
        jobs: deque[Callable[[], None]] = deque()
        told: list[str] = []

        def callback(client: str) -> None:
            told.append(client)
            raise RuntimeError(client)

        watch = ClientWatch(callback, jobs.append, lambda _: None)
        watch.lost("a")
        watch.lost("b")
        for _ in range(2):
            with pytest.raises(RuntimeError):
                jobs.popleft()()
        assert told == ["a", "b"]
