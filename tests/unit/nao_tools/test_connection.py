"""How long commands wait until they know all servants of a realm."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from nao_tools import _connection
from nao_tools._connection import servants
from zenoh_ice import ServantInfo, Settings

NAMES = ("Body", "Head", "Safety")
INFOS = [ServantInfo(name, {}, "1", 0.0) for name in NAMES]


class Realm:
    """A realm whose servants are heard of at some moments; the time goes on where somebody sleeps."""

    def __init__(self, timeout: float, linked: float, *moments: float) -> None:
        self.settings = Settings(timeout=timeout, connect=())
        self.now = 0.0
        self.presence = SimpleNamespace(linked=lambda: self.now >= linked)
        self._moments = moments

    def servants(self) -> list[ServantInfo]:
        return [info for info, moment in zip(INFOS, self._moments, strict=False) if self.now >= moment]

    def sleep(self, seconds: float) -> None:
        self.now += seconds


def heard(realm: Any, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    clock = SimpleNamespace(monotonic=lambda: realm.now, sleep=realm.sleep)
    monkeypatch.setattr(_connection, "time", clock)
    return [info.identity for info in servants(realm)]


def test_all_that_are_heard_of_shortly_after_each_other_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    assert heard(Realm(2.0, 0.0, 0.3, 0.35, 0.4), monkeypatch) == [*NAMES]


@pytest.mark.parametrize(("timeout", "known"), [(2.0, NAMES[:1]), (30.0, NAMES)])
def test_who_lets_calls_take_long_waits_longer_for_the_next_servant(
    monkeypatch: pytest.MonkeyPatch, timeout: float, known: tuple[str, ...]
) -> None:
    assert heard(Realm(timeout, 0.0, 0.1, 0.35, 0.6), monkeypatch) == [*known]


@pytest.mark.parametrize(("timeout", "known"), [(2.0, ()), (30.0, NAMES)])
def test_who_lets_calls_take_long_waits_longer_for_the_first_one_and_for_a_link(
    monkeypatch: pytest.MonkeyPatch, timeout: float, known: tuple[str, ...]
) -> None:
    assert heard(Realm(timeout, 0.0, 1.5, 1.5, 1.5), monkeypatch) == [*known]
    assert heard(Realm(timeout, 5.0, 5.1, 5.1, 5.1), monkeypatch) == [*known]
