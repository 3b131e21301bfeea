"""Periodic jobs on clocks, and what runs them: the threads of a server, or the control loop of a robot.

A `Job` reports when it is due on its clock, and does its work when called. It has three drivers: `JobThreads`
and `ControlLoop` here and, in virtual time, its single thread (`visualhfsm.simulation._robot`).
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Iterable
from typing import Final, Protocol, Self

from naoserver.options import ServerLimits
from zenoh_ice import Clock

_logger = logging.getLogger(__name__)

_RESOLUTION: Final = 1e-6
"""Seconds by which a job may be early."""
_CHECK_PERIOD: Final = 0.05
"""Approximate wall seconds after which a thread checks again whether and when its jobs are due."""
_SHORTEST_REST: Final = 0.001
"""Minimum wall seconds that a thread rests, whatever its clock does."""
_RETRY_DELAY: Final = 1.0
"""Seconds until work that failed is tried again, where its own clock counts them."""
_WATCH_PERIOD: Final = 1.0
"""Seconds between two checks of the watchdog while everything rests."""
_AFTER_ERROR: Final = 0.1
"""Seconds until the watchdog repeats a failed check."""
_END_LIMIT: Final = 3.0
"""Wall seconds within which a thread ends: more than a camera takes for an image."""


class Job(Protocol):
    """Work that is due repeatedly."""

    @property
    def name(self) -> str:
        """Its name in the log."""

    @property
    def thread(self) -> str:
        """The thread that does it in a server; jobs of one thread delay each other and have one clock."""

    @property
    def clock(self) -> Clock:
        """The clock that it follows."""

    def due(self, now: float) -> float:
        """Return the time on its clock when it is due, given that it is `now`; infinity while it rests."""

    def run(self) -> None:
        """Do the due work."""


def is_due(job: Job, now: float) -> bool:
    """Return whether a job is to run at a time of its clock."""
    return job.due(now) <= now + _RESOLUTION


class Periodic:
    """Work at whole multiples of a period, while it is wanted: no drift, and no burst after a delay.

    `period` is in s and may change at any time. At least `gap` s pass between two runs. Work that returns
    False has failed and is tried again after a second of wall time.
    """

    def __init__(
        self,
        name: str,
        clock: Clock,
        period: Callable[[], float],
        work: Callable[[], object],
        *,
        thread: str = "",
        wanted: Callable[[], bool] = lambda: True,
        gap: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self.name: Final = name
        self.thread: Final = thread or name
        self.clock: Final = clock
        self._period = period
        self._work = work
        self._wanted = wanted
        self._gap = gap
        self._last: float | None = None  # when it ran or was found to be wanted; None while it is not
        self._earliest = self._due = -math.inf

    def due(self, now: float) -> float:
        """Return when it is due; infinity while it is not wanted."""
        if not self._wanted():
            self._last = None
            return math.inf
        if self._last is None or self._last > now + _RESOLUTION:  # it starts, or the clock was restarted
            self._last, self._earliest = now, -math.inf
        period = self._period()
        slot = (math.floor(self._last / period + _RESOLUTION) + 1) * period
        self._due = max(slot, self._earliest)
        return self._due

    def run(self) -> None:
        """Do the work."""
        now = self.clock.now()
        self._last = max(now, min(self._due, now + _RESOLUTION))
        self._earliest = now + self._gap()
        if self._work() is False:
            self._earliest = now + _RETRY_DELAY * (self.clock.rate or 1.0)


class Watched(Protocol):
    """Devices that must not move for longer than their client wants: joints, and the walk."""

    @property
    def name(self) -> str:
        """Its name in the log."""

    def watch(self) -> float | None:
        """Stop expired commands; return the wall seconds until the next check, None while all rest."""

    def moves_for(self, client: str) -> bool:
        """Return whether it still moves because a client commanded it."""

    def drop_client(self, client: str) -> None:
        """Stop everything that a lost client moves."""

    def close(self) -> None:
        """Stop, and refuse further motion."""


class Watchdog:
    """Check devices for expired commands: rarely while all rest, and in due time after each command.

    `clock` is steady wall time on a robot, however fast a simulation runs; in tests it is the virtual one.
    `sooner` is called when the next check becomes due earlier. Implements Job.
    """

    def __init__(self, clock: Clock, sooner: Callable[[], None]) -> None:
        self.name: Final = "watchdog"
        self.thread: Final = "watchdog"
        self.clock: Final = clock
        self.watched: Final[list[Watched]] = []
        """The checked devices."""
        self._failing: Final = set[str]()
        """Names of devices whose last check failed: it fails on and on while a robot is lost."""
        self._sooner = sooner
        self._lock = threading.Lock()
        self._next = clock.now()

    def check_within(self, seconds: float) -> None:
        """Check again in at most `seconds`: something has been commanded."""
        when = self.clock.now() + seconds
        with self._lock:
            sooner = when < self._next
            if sooner:
                self._next = when
        if sooner:
            self._sooner()

    def due(self, now: float) -> float:  # noqa: ARG002 - it does not depend on the time
        """Return when the next check is due."""
        return self._next

    def run(self) -> None:
        """Check every device, even if the check of another one fails."""
        with self._lock:
            self._next = math.inf  # so that a command during the check is not missed
        seconds = min((self._check(device) for device in self.watched), default=_WATCH_PERIOD)
        with self._lock:
            self._next = min(self._next, self.clock.now() + seconds)

    def _check(self, device: Watched) -> float:
        try:
            due = device.watch()
        except (Exception, SystemExit):
            if device.name not in self._failing:
                self._failing.add(device.name)
                _logger.exception("the watchdog could not check %s, and tries on", device.name)
            return _AFTER_ERROR
        self._failing.discard(device.name)
        return _WATCH_PERIOD if due is None else due


class ControlLoop:
    """Do jobs in the control ticks of a robot, so that no delay of a thread comes between them and the robot.

    The robot calls `tick` at the end of each control tick, once its new state can be read: commands of a job
    take effect in the next one. A job that fails is logged and tried again after a second of its clock.
    Jobs may be added and removed in any thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: tuple[Job, ...] = ()
        self._retry: dict[Job, float] = {}  # when a failed job is tried again, on its clock

    def add(self, job: Job) -> None:
        """Do a job from the next tick on."""
        with self._lock:
            self._jobs = (*self._jobs, job)

    def remove(self, job: Job) -> None:
        """Do a job no more, except in a tick that has begun; does nothing the second time."""
        with self._lock:
            self._jobs = tuple(each for each in self._jobs if each is not job)
            self._retry.pop(job, None)

    def tick(self) -> None:
        """Do the jobs that are due."""
        for job in self._jobs:
            now = job.clock.now()
            if is_due(job, now) and self._retry.get(job, -math.inf) <= now:
                self._do(job, now)

    def _do(self, job: Job, now: float) -> None:
        try:
            job.run()
        except (Exception, SystemExit):  # of a driver, too, which calls `sys.exit`
            _logger.exception("%s is tried again in %g s of the robot after an error", job.name, _RETRY_DELAY)
            self._retry[job] = now + _RETRY_DELAY


class JobThreads:
    """Do jobs in threads, one for each `Job.thread`, from `start` or the start of a `with` block to `close`.

    A job that fails is logged and tried again after a second; the others of its thread continue.
    """

    def __init__(self, jobs: Iterable[Job], limits: ServerLimits | None = None) -> None:
        self._limits = limits or ServerLimits()
        groups: dict[str, list[Job]] = {}
        for job in jobs:
            groups.setdefault(job.thread, []).append(job)
        self._threads = [_JobThread(name, group, self._limits.retry) for name, group in groups.items()]

    def start(self) -> None:
        """Start the threads: all, or none where the system does not allow all (RuntimeError)."""
        try:
            for thread in self._threads:
                thread.start()
        except RuntimeError:
            self.close()
            raise

    def wake(self) -> None:
        """Make every thread check now for due jobs: something has changed."""
        for thread in self._threads:
            thread.changed.set()

    def hanging(self) -> list[str]:
        """Return the names of the threads that have been in the same job, or wait, for very long."""
        oldest = time.monotonic() - self._limits.progress
        return [thread.name for thread in self._threads if thread.seen < oldest]

    def stop(self) -> None:
        """Let each thread end after its current job."""
        for thread in self._threads:
            thread.stopping = True
        self.wake()

    def close(self) -> None:
        """End the threads, and wait for them with a limit; does nothing the second time."""
        self.stop()
        for thread in self._threads:
            if thread.ident is not None:
                thread.join(_END_LIMIT)
                if thread.is_alive():
                    _logger.error("%s did not end within %g s", thread.name, _END_LIMIT)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _JobThread(threading.Thread):
    """A thread that does the jobs of one clock."""

    def __init__(self, name: str, jobs: list[Job], retry: float) -> None:
        super().__init__(name=name, daemon=True)
        self._retry_delay = retry
        self.changed: Final = threading.Event()
        self.stopping = False
        self.seen = math.inf  # the moment of the monotonic clock at which it began its last round
        self._jobs = jobs
        self._clock = jobs[0].clock
        self._due: dict[Job, float] = {}  # as each job reported before the last wait
        self._retry: dict[Job, float] = {}  # when a failed job is tried again, in steady wall time

    def run(self) -> None:
        while True:
            self.seen = time.monotonic()
            self.changed.clear()
            if self.stopping:
                return
            for job in self._jobs:
                due = self._due.get(job, math.inf) <= self._clock.now() + _RESOLUTION
                if due and self._retry.get(job, -math.inf) <= time.monotonic():
                    self._do(job)
            self._wait()

    def _do(self, job: Job) -> None:
        try:
            job.run()
        except (Exception, SystemExit):  # of a driver, too, which calls `sys.exit`
            _logger.exception("%s is tried again in %g s after an error", job.name, self._retry_delay)
            self._retry[job] = time.monotonic() + self._retry_delay

    def _wait(self) -> None:
        """Wait until something is due, or has changed."""
        now, begun = self._clock.now(), time.monotonic()
        # On the jobs' clock even while idle: advancing a stepped clock waits for its waiters.
        self._due = {job: job.due(now) for job in self._jobs}
        seconds = min(min(self._due.values()) - now, _CHECK_PERIOD * (self._clock.rate or 1.0))
        self._clock.wait(self.changed, max(0.0, seconds))
        # Neither a failing job nor a closed clock causes a busy loop.
        if not self.stopping:
            time.sleep(max(0.0, begun + _SHORTEST_REST - time.monotonic()))
