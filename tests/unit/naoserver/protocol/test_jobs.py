"""Periodic work, in virtual time if the clock can be stepped, and its threads."""

import threading
from contextlib import contextmanager
from functools import partial

import pytest

from naoserver.options import ServerLimits
from naoserver.protocol.jobs import ControlLoop, JobThreads, Periodic, Watchdog
from naoserver.serving.camera import WINDOW, RateMeter
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.robot_server import eventually
from tests.support.stepped_clock import SteppedClock
from zenoh_ice import VirtualClock, WallClock


@contextmanager
def running(clock, *jobs, limits=None):
    """Do jobs in threads; the clock may be advanced as soon as all of them wait for it."""
    threads = JobThreads(jobs, limits)
    with threads:
        if isinstance(clock, SteppedClock):
            clock.wait_for_waiters(len({job.thread for job in jobs}))
        yield threads


def times_of(clock, period, work=(), gap=0.0, seconds=1.0):
    """Return the start times of a job within some seconds, if its rounds take the seconds of `work`."""
    times, left = [], list(work)

    def round_of_work():
        times.append(clock.now())
        if left and (duration := left.pop(0)):
            clock.sleep(duration)

    with running(clock, Periodic("test", clock, lambda: period, round_of_work, gap=lambda: gap)):
        clock.advance(seconds)
    return times


def test_unless_all_threads_start_none_runs_on(monkeypatch):
    start = threading.Thread.start
    started: list[threading.Thread] = []

    def start_one(thread):
        if started:
            raise RuntimeError("can't start new thread")
        started.append(thread)
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", start_one)
    jobs = [Periodic(name, WallClock(), lambda: 0.1, lambda: None) for name in ("one", "two", "three")]
    with pytest.raises(RuntimeError, match="can't start"), JobThreads(jobs):
        raise AssertionError
    assert not started[0].is_alive()


def test_a_job_does_not_drift_when_a_round_is_a_little_late():
    times = times_of(SteppedClock(), 0.1, [0.0, 0.13], seconds=0.5)
    assert times == pytest.approx([0.1, 0.2, 0.33, 0.4, 0.5])


def test_a_job_keeps_its_pace_whatever_its_points_are_rounded_to():
    times = times_of(SteppedClock(), 0.02, seconds=1.2)
    assert times == pytest.approx([0.02 * point for point in range(1, 61)])


def test_a_job_goes_on_after_a_long_delay_without_a_burst():
    times = times_of(SteppedClock(), 0.1, [0.0, 0.95], seconds=1.3)
    assert times == pytest.approx([0.1, 0.2, 1.15, 1.2, 1.3])


def test_a_gap_is_kept_between_two_rounds():
    times = times_of(SteppedClock(), 0.02, gap=0.05, seconds=0.2)
    assert times == pytest.approx([0.02, 0.07, 0.12, 0.17])


def test_a_job_that_is_not_wanted_rests_until_it_is():
    clock, done, wanted = SteppedClock(), [], threading.Event()
    job = Periodic("test", clock, lambda: 0.1, lambda: done.append(clock.now()), wanted=wanted.is_set)
    with running(clock, job):
        clock.advance(0.33)
        assert done == []
        wanted.set()
        clock.advance(0.27)
    assert done == pytest.approx([0.4, 0.5, 0.6])


def test_a_wake_makes_a_job_due_at_its_next_point():
    clock, done, wanted = SteppedClock(), [], threading.Event()
    job = Periodic("test", clock, lambda: 0.01, lambda: done.append(clock.now()), wanted=wanted.is_set)
    with running(clock, job) as threads:
        clock.advance(0.001)
        wanted.set()
        threads.wake()
        clock.advance(0.0)
        clock.advance(0.009)
    assert done == pytest.approx([0.01])


def test_a_job_follows_a_clock_that_was_restarted():
    clock, done = SteppedClock(start=100.0), []
    job = Periodic("test", clock, lambda: 0.1, lambda: done.append(1))
    assert job.due(100.0) == pytest.approx(100.1)
    assert job.due(3.0) == pytest.approx(3.1)


def test_work_that_fails_is_tried_again_after_a_second():
    times, clock = [], SteppedClock()

    def fail():
        times.append(clock.now())
        return False

    with running(clock, Periodic("test", clock, lambda: 0.1, fail)):
        clock.advance(2.5)
    assert times == pytest.approx([0.1, 1.1, 2.1])


def test_a_slow_job_delays_none_of_another_thread():
    release, done = threading.Event(), []
    slow = Periodic("slow", WallClock(), lambda: 0.01, lambda: release.wait(FOREVER))
    quick = Periodic("quick", WallClock(), lambda: 0.01, lambda: done.append(1))
    with running(WallClock(), slow, quick):
        eventually(lambda: len(done) > 5)
        release.set()


def test_jobs_share_the_thread_that_they_name():
    seen = {}

    def note(name):
        seen[name] = threading.current_thread()

    jobs = [
        Periodic(name, WallClock(), lambda: 0.01, partial(note, name), thread=thread)
        for name, thread in (("a", "one"), ("b", "one"), ("c", "two"))
    ]
    with running(WallClock(), *jobs):
        eventually(lambda: len(seen) == 3)
    assert seen["a"] is seen["b"]
    assert [seen[name].name for name in "abc"] == ["one", "one", "two"]


def test_a_clock_that_has_ended_does_not_keep_a_thread_from_ending():
    class EndedClock(SteppedClock):
        def wait(self, event, timeout):
            return event.is_set()

    clock = EndedClock()
    threads = JobThreads([Periodic("test", clock, lambda: 0.1, lambda: None)])
    threads.start()
    threads.close()
    assert "test" not in {thread.name for thread in threading.enumerate()}


@pytest.mark.parametrize("error", [ValueError("no such luck"), SystemExit("no such luck")])
def test_a_job_goes_on_after_an_error_and_logs_it(caplog, error):
    went_on = threading.Event()
    calls = []

    def publish():
        calls.append(1)
        if len(calls) == 1:
            raise error
        went_on.set()

    job, soon = Periodic("test", WallClock(), lambda: 0.001, publish), ServerLimits(retry=0.01)
    with running(WallClock(), job, limits=soon):
        assert went_on.wait(EVENT_LIMIT)
    assert "no such luck" in caplog.text


def test_a_job_that_fails_does_not_stop_those_of_its_thread():
    done = []

    def fail():
        raise ValueError("no such luck")

    jobs = (
        Periodic("fails", WallClock(), lambda: 0.01, fail, thread="one"),
        Periodic("works", WallClock(), lambda: 0.01, lambda: done.append(1), thread="one"),
    )
    with running(WallClock(), *jobs):
        eventually(lambda: len(done) > 3)


def test_threads_that_never_started_can_be_closed():
    JobThreads([Periodic("test", WallClock(), lambda: 0.1, lambda: None)]).close()


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


def test_a_rate_restarts_with_the_simulation():
    meter = RateMeter(lambda: 0.1)
    meter.count(100.0)
    meter.count(0.1)
    assert meter.rate == pytest.approx(1 / WINDOW)


def ticked(clock, *jobs):
    """Return a loop that does jobs in ticks of 10 ms."""
    loop = ControlLoop()
    for job in jobs:
        loop.add(job)
    clock.call_every(0.01, loop.tick)
    return loop


def test_a_control_loop_does_a_job_in_the_ticks_in_which_it_is_due():
    clock, times = VirtualClock(), []
    job = Periodic("test", clock, lambda: 0.02, lambda: times.append(clock.now()))
    loop = ticked(clock, job)
    clock.advance(0.075)
    assert times == pytest.approx([0.02, 0.04, 0.06])
    loop.remove(job)
    loop.remove(job)
    clock.advance(0.1)
    assert len(times) == 3


@pytest.mark.parametrize("error", [RuntimeError("a slip"), SystemExit(0)])
def test_a_job_that_fails_in_a_control_loop_is_tried_again_and_stops_no_other(caplog, error):
    clock, failures, times = VirtualClock(), [], []

    def fail():
        failures.append(clock.now())
        raise error

    ticked(
        clock,
        Periodic("broken", clock, lambda: 0.02, fail),
        Periodic("whole", clock, lambda: 0.02, lambda: times.append(clock.now())),
    )
    clock.advance(1.1)
    assert failures == pytest.approx([0.02, 1.02])
    assert len(times) == 55
    assert caplog.text.count("broken is tried again in 1 s") == 2


def test_a_job_may_remove_itself_from_its_control_loop():
    clock, times = VirtualClock(), []

    def once():
        times.append(clock.now())
        loop.remove(job)

    job = Periodic("test", clock, lambda: 0.02, once)
    loop = ticked(clock, job)
    clock.advance(0.1)
    assert len(times) == 1


def test_a_check_that_fails_on_and_on_is_repeated_soon_and_logged_once(caplog):
    class Lost:
        name = "joints"
        checks = 0
        lost = True

        def watch(self):
            self.checks += 1
            if self.lost:
                raise OSError("no link")

        def moves_for(self, client):
            return False

        def drop_client(self, client):
            """Nothing moves."""

        def close(self):
            """Nothing moves."""

    device, clock = Lost(), VirtualClock()
    watchdog = Watchdog(clock, lambda: None)
    watchdog.watched.append(device)
    for lost in (True, False, True):
        device.lost = lost
        for _ in range(10):
            watchdog.run()
    assert device.checks == 30
    assert watchdog.due(clock.now()) == pytest.approx(clock.now() + 0.1)
    assert caplog.text.count("the watchdog could not check joints") == 2
