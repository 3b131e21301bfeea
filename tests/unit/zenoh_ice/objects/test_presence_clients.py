"""The clients of a realm: each is reported as lost once, at the end of the token with which it appeared."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from contextlib import closing
from typing import Final

import pytest

from zenoh_ice.data.keys import client_token
from zenoh_ice.objects._presence import ClientWatch
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads._starting import PULSE_PERIOD
from zenoh_ice.threads.pool import Pool

Jobs = deque[Callable[[], object]]
Watch = Callable[[Callable[[str], object]], ClientWatch]


@pytest.fixture
def transport() -> InProcessTransport:
    return InProcessTransport(Pool(0, "test"))


@pytest.fixture
def jobs() -> Jobs:
    """What is to run on other threads."""
    return deque()


@pytest.fixture
def watch(transport: InProcessTransport, jobs: Jobs) -> Watch:
    return lambda callback: ClientWatch(transport, "nao", callback, jobs.append, lambda _: None)


def run(jobs: Jobs) -> None:
    while jobs:
        jobs.popleft()()


@pytest.mark.slow
def test_clients_are_reported_one_after_the_other_and_bounded(
    transport: InProcessTransport, watch: Watch, jobs: Jobs
) -> None:
    lost: list[str] = []
    watch(lost.append)
    ids = [f"{number:x}" for number in range(20_000)]
    tokens = [transport.announce(client_token("nao", client)) for client in ids]
    for token in tokens:
        token.close()
    assert len(jobs) == 1
    run(jobs)
    assert lost == ids[: 1 << 14]
    transport.announce(client_token("nao", "c0ffee")).close()
    assert len(jobs) == 1


def test_a_callback_that_fails_keeps_no_client_from_being_reported(
    transport: InProcessTransport, watch: Watch, jobs: Jobs
) -> None:
    lost: list[str] = []

    def callback(client: str) -> None:
        lost.append(client)
        raise RuntimeError(client)

    watch(callback)
    for client in "ab":
        transport.announce(client_token("nao", client)).close()
    for _ in range(2):
        with pytest.raises(RuntimeError):
            jobs.popleft()()
    assert lost == ["a", "b"]


def test_clients_that_were_there_before_are_followed(
    transport: InProcessTransport, watch: Watch, jobs: Jobs
) -> None:
    genuine = transport.announce(client_token("nao", "a"))
    lost: list[str] = []
    watch(lost.append)
    genuine.close()
    run(jobs)
    assert lost == ["a"]


def test_a_client_of_an_impossible_id_is_not_lost(
    transport: InProcessTransport, watch: Watch, jobs: Jobs
) -> None:
    lost: list[str] = []
    watch(lost.append)
    for client in ("\x1b[2J", "c0ffee"):
        transport.announce(client_token("nao", client)).close()
    run(jobs)
    assert lost == ["c0ffee"]


def test_clients_of_another_realm_are_not_reported(
    transport: InProcessTransport, watch: Watch, jobs: Jobs
) -> None:
    watch(lambda client: pytest.fail(client))
    transport.announce(client_token("other", "a")).close()
    run(jobs)


def test_a_client_that_called_and_never_got_a_token_is_lost_after_two_seconds_of_looks(
    watch: Watch, jobs: Jobs
) -> None:
    lost: list[str] = []
    watched = watch(lost.append)
    watched.note_call("a")
    for _ in range(round(2.0 / PULSE_PERIOD)):
        assert not jobs
        watched.check()
    run(jobs)
    assert lost == ["a"]


def test_a_client_whose_token_comes_after_its_call_is_not_lost(
    transport: InProcessTransport, watch: Watch, jobs: Jobs
) -> None:
    watched = watch(lambda client: pytest.fail(client))
    watched.note_call("a")
    transport.announce(client_token("nao", "a"))
    for _ in range(round(3.0 / PULSE_PERIOD)):
        watched.check()
    run(jobs)


class LateToken(dict[str, str]):
    """The clients that are present; when somebody looks, another thread brings a token, if it may."""

    def __init__(self, bring: Callable[[], object]) -> None:
        super().__init__()
        self.bringing: Final = threading.Thread(target=bring)

    def __contains__(self, client: object) -> bool:
        found = super().__contains__(client)
        self.bringing.start()
        self.bringing.join(0.2)  # in which it comes, unless it has to wait
        return found


def test_a_client_whose_token_comes_in_the_moment_of_a_look_is_not_lost(
    transport: InProcessTransport, watch: Watch, jobs: Jobs, monkeypatch: pytest.MonkeyPatch
) -> None:
    watched = watch(lambda _: None)
    watched.note_call("a")
    for _ in range(round(2.0 / PULSE_PERIOD) - 1):
        watched.check()
    present = LateToken(lambda: transport.notify(client_token("nao", "a"), True))
    monkeypatch.setattr(watched, "present", present)
    watched.check()
    present.bringing.join()
    assert [*present] == ["a"]
    assert not watched.is_lost("a")


def test_a_closed_watch_is_called_no_more(transport: InProcessTransport, watch: Watch, jobs: Jobs) -> None:
    lost: list[str] = []
    with closing(watch(lost.append)):
        transport.announce(client_token("nao", "a")).close()
    transport.announce(client_token("nao", "b")).close()
    run(jobs)
    assert lost == []


def test_a_client_of_another_version_is_noted_once(
    transport: InProcessTransport, watch: Watch, jobs: Jobs, caplog: pytest.LogCaptureFixture
) -> None:
    lost: list[str] = []
    watch(lost.append)
    for client in ("c0ffee", "abc"):
        transport.announce(f"{client_token('nao', client)}/0123456789abcdef").close()
    run(jobs)
    (warning,) = caplog.messages
    assert "a client of another version of VisualHFSM" in warning
    assert not lost
