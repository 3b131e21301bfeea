"""The alarm that wakes threads one by one."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from hfsm_runtime._runtime import Alarm
from hfsm_runtime._timeline import Timeline
from tests.support.limits import EVENT_LIMIT
from zenoh_ice import WallClock


@pytest.fixture
def timeline() -> Timeline:
    return Timeline(WallClock())


@pytest.fixture
def alarm(timeline: Timeline) -> Iterator[Alarm]:
    alarm = Alarm(timeline)
    alarm.start()
    yield alarm
    alarm.stop()


def test_events_are_set_when_their_time_has_come(alarm: Alarm, timeline: Timeline) -> None:
    past, near, far = threading.Event(), threading.Event(), threading.Event()
    due = timeline.now() + 50_000_000
    alarm.set_at(due + 3600 * 10**9, far)
    alarm.set_at(due, near)
    alarm.set_at(0, past)
    assert past.wait(EVENT_LIMIT)
    assert near.wait(EVENT_LIMIT)
    assert timeline.now() >= due
    assert not far.is_set()


def test_an_earlier_time_that_comes_later_is_not_kept_waiting(alarm: Alarm, timeline: Timeline) -> None:
    late, early = threading.Event(), threading.Event()
    alarm.set_at(timeline.now() + 3600 * 10**9, late)
    alarm.set_at(timeline.now() + 1_000_000, early)
    assert early.wait(EVENT_LIMIT)


def test_an_alarm_that_was_stopped_has_no_thread(timeline: Timeline) -> None:
    alarm = Alarm(timeline)
    alarm.stop()  # it may end before it began
    alarm = Alarm(timeline)
    alarm.start()
    alarm.stop()
    assert "alarm" not in {thread.name for thread in threading.enumerate()}
