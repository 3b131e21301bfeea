"""Limits of a rate."""

from __future__ import annotations

import pytest

from zenoh_ice.transport import Pacer


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    return now


def test_without_a_rate_there_is_no_delay() -> None:
    pacer = Pacer(None)
    pacer.count()
    assert pacer.delay() == 0.0


def test_delays_keep_the_rate_on_average(now: list[float]) -> None:
    pacer = Pacer(10.0)
    count = 0
    while now[0] < 110.0:
        now[0] += pacer.delay() + 0.03  # each comes late
        pacer.count()
        count += 1
    assert 99 <= count <= 101


def test_a_pause_is_not_made_up_for(now: list[float]) -> None:
    pacer = Pacer(10.0)
    pacer.count()
    now[0] += 60.0
    assert pacer.delay() == 0.0
    pacer.count()
    now[0] += pacer.delay()
    pacer.count()
    assert pacer.delay() == pytest.approx(0.1)
