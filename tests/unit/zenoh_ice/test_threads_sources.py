"""Sources of jobs of a pool: files that one thread at a time reads."""

from __future__ import annotations

import os
import threading

from tests.support.limits import EVENT_LIMIT
from zenoh_ice._threads import PULSE_PERIOD, Job, Kind, Pool, Source


class SlowSource(Source):
    """Takes some periods of the watch to find a job, once for each byte of a pipe."""

    def __init__(self, jobs: int) -> None:
        self.inside = self.most_inside = 0
        self.done = threading.Semaphore(0)
        self._lock = threading.Lock()
        self._file, sending = os.pipe()
        os.write(sending, bytes(jobs))
        os.close(sending)
        os.set_blocking(self._file, False)

    def fileno(self) -> int:
        return self._file

    def take(self) -> Job | None:
        with self._lock:
            self.inside += 1
            self.most_inside = max(self.most_inside, self.inside)
        threading.Event().wait(5 * PULSE_PERIOD)
        found = os.read(self._file, 1)
        with self._lock:
            self.inside -= 1
        return (Kind(), self.done.release) if found else None

    def close(self) -> None:
        os.close(self._file)


def test_no_thread_takes_from_a_source_while_another_one_does() -> None:
    pool = Pool(4, "test")
    source = SlowSource(3)
    pool.attach(source)
    for _ in range(3):
        assert source.done.acquire(timeout=EVENT_LIMIT)
    pool.detach(source)
    assert pool.close(EVENT_LIMIT)
    source.close()
    assert source.most_inside == 1
