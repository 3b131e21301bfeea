"""The pace of the pumps, in virtual time where there is a clock to step."""

import threading

import pytest

from naoserver.pumps import Pump, Schedule, WallPump
from naoserver.rate_meter import WINDOW, RateMeter
from tests.support.limits import LIMIT
from zenoh_ice import VirtualClock


def run_schedule(clock, period, work, rounds):
    """Return the times at which a schedule's rounds begin when each takes `work` seconds."""
    times = []
    done = threading.Event()

    def rounds_of_work():
        schedule = Schedule(clock)
        for seconds in work[:rounds]:
            schedule.wait_for_next(threading.Event(), lambda: period)
            times.append(clock.now())
            if seconds:
                clock.sleep(seconds)
        done.set()

    thread = threading.Thread(target=rounds_of_work)
    thread.start()
    for _ in range(1000):
        if done.is_set():
            break
        clock.wait_for_waiters(1)
        clock.advance(0.01)
        if len(times) == rounds:
            done.wait(LIMIT)  # it does not wait any more
    thread.join(LIMIT)
    return times


def test_a_schedule_does_not_drift_when_a_round_is_a_little_late():
    times = run_schedule(VirtualClock(), 0.1, [0.0, 0.13, 0.0, 0.0, 0.0], 5)
    assert times == pytest.approx([0.1, 0.2, 0.33, 0.4, 0.5])


def test_a_schedule_keeps_its_pace_whatever_its_points_are_rounded_to():
    times = run_schedule(VirtualClock(), 0.02, [0.0] * 60, 60)
    assert times == pytest.approx([0.02 * point for point in range(1, 61)])


def test_a_clock_that_has_ended_does_not_keep_a_schedule_from_stopping():
    class EndedClock(VirtualClock):
        def wait(self, event, timeout):
            return event.is_set()

    stopping = threading.Event()
    waiting = threading.Thread(target=Schedule(EndedClock()).wait_for_next, args=(stopping, lambda: 0.1))
    waiting.start()
    stopping.set()
    waiting.join(LIMIT)
    assert not waiting.is_alive()


def test_a_schedule_begins_anew_after_a_long_delay_without_a_burst():
    times = run_schedule(VirtualClock(), 0.1, [0.0, 0.95, 0.0, 0.0, 0.0], 5)
    assert times == pytest.approx([0.1, 0.2, 1.15, 1.25, 1.35])


def test_a_pump_goes_on_after_an_error_and_tells_it(monkeypatch, caplog):
    monkeypatch.setattr("naoserver.pumps._RETRY", 0.01)
    went_on = threading.Event()
    calls = []

    def publish():
        calls.append(1)
        if len(calls) == 1:
            raise ValueError("no such luck")
        went_on.set()

    pump = WallPump("test", 1000.0, publish)
    pump.start()
    try:
        assert went_on.wait(LIMIT)
    finally:
        pump.ask_to_stop()
        pump.join()
    assert "no such luck" in caplog.text


def test_a_pump_that_never_started_can_be_joined():
    pump: Pump = WallPump("test", 10.0, lambda: None)
    pump.ask_to_stop()
    pump.join()


def test_a_rate_is_counted_over_the_window():
    clock = VirtualClock()
    meter = RateMeter(clock.now)
    for _ in range(30):
        clock.advance(0.1)
        meter.count(clock.now())
    assert meter.rate == pytest.approx(10.0)
    clock.advance(WINDOW / 2)
    assert meter.rate == pytest.approx(5.0, abs=0.5)
    clock.advance(WINDOW)
    assert meter.rate == 0.0


def test_a_rate_begins_anew_with_the_simulation():
    meter = RateMeter(lambda: 0.1)
    meter.count(100.0)
    meter.count(0.1)
    assert meter.rate == pytest.approx(1 / WINDOW)
