"""Component time continues, whatever its clock does."""

from __future__ import annotations

import threading

import pytest

from hfsm_runtime._timeline import Timeline, delay_in_slot, slot_after, slot_at, slot_from
from zenoh_ice import VirtualClock


class SettableClock(VirtualClock):
    """A clock that a test may put back, as a simulation does that is restarted."""

    def __init__(self) -> None:
        super().__init__()
        self.time = 100.0

    def now(self) -> float:
        return self.time


def test_time_counts_from_the_start() -> None:
    clock = SettableClock()
    timeline = Timeline(clock)
    clock.time = 105.0
    timeline.restart()
    clock.time = 107.5
    assert timeline.now() == 2_500_000_000


def test_time_stands_still_while_paused_and_steps() -> None:
    clock = SettableClock()
    timeline = Timeline(clock)
    clock.time = 101.0
    timeline.pause()
    clock.time = 150.0
    assert timeline.now() == 1_000_000_000
    timeline.step(500_000_000)
    assert timeline.now() == 1_500_000_000
    timeline.resume()
    clock.time = 151.0
    assert timeline.now() == 2_500_000_000
    timeline.step(1)
    assert timeline.now() == 2_500_000_000


def test_time_goes_on_when_the_simulation_is_restarted() -> None:
    clock = SettableClock()
    timeline = Timeline(clock)
    clock.time = 160.0
    assert timeline.now() == 60_000_000_000
    clock.time = 0.0
    assert timeline.now() == 60_000_000_000
    clock.time = 2.0
    assert timeline.now() == 62_000_000_000


def test_time_goes_on_when_the_simulation_is_restarted_during_a_pause() -> None:
    clock = SettableClock()
    timeline = Timeline(clock)
    clock.time = 160.0
    timeline.pause()
    clock.time = 0.0
    timeline.resume()
    clock.time = 1.0
    assert timeline.now() == 61_000_000_000


def test_waiting_ends_at_once_when_the_time_is_over_or_the_event_set() -> None:
    clock = SettableClock()
    timeline = Timeline(clock)
    wake = threading.Event()
    timeline.wait_until(0, wake)
    wake.set()
    timeline.wait_until(10_000_000_000, wake)
    timeline.pause()
    timeline.wait_until(10_000_000_000, wake)


def test_slots_are_multiples_of_the_period() -> None:
    assert [slot_at(now, 10) for now in (0, 9, 10, 25)] == [0, 0, 10, 20]
    assert [slot_after(now, 10) for now in (0, 9, 10, 25)] == [10, 10, 20, 30]
    assert [slot_from(now, 10) for now in (0, 9, 10, 25)] == [0, 10, 10, 30]


def test_the_first_automaton_wakes_with_its_slot_and_the_others_a_little_later() -> None:
    assert [delay_in_slot(index, 100_000_000) for index in range(3)] == [0, 50_000, 100_000]


@pytest.mark.parametrize("interval", [1, 1000, 20_000_000, 100_000_000])
def test_every_automaton_wakes_within_its_slot(interval: int) -> None:
    assert all(0 <= delay_in_slot(index, interval) < interval for index in range(3000))
