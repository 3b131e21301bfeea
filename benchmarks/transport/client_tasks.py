"""The commands of a benchmark client: call and measure, follow a stream and report what arrived."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from functools import partial
from typing import Any, Final, Self

import numpy as np

from .peers import Client
from .processor_time import thread_times

_WARM_UP: Final = 20  # calls that are not counted: the processes are just waking up
_QUIET: Final = 0.5  # s without a value after which the rest counts as lost
_FIRST_SAMPLE: Final = 5.0  # s within which the first value arrives
_LATEST_IN_ONE: Final = 100  # the clock itself takes a tenth of a microsecond


class ClientTasks:
    """Calls a server and follows its streams."""

    thread_times = staticmethod(thread_times)

    def __init__(self, opened: AbstractContextManager[Client]) -> None:
        self._stack = ExitStack()
        self._client = self._stack.enter_context(opened)
        self._arrivals = Arrivals()
        self._following: AbstractContextManager[object] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.unfollow()
        self._stack.close()

    # Calls.

    def call(
        self,
        operation: str,
        count: int = 0,
        seconds: float = 0.0,
        at: float = 0.0,
        size: tuple[int, int] | None = None,
    ) -> list[float]:
        """Call a number of times or for a duration from a time of the monotonic clock; return s per call."""
        call = self._operation(operation, size)
        for _ in range(min(_WARM_UP, count or _WARM_UP)):
            call()
        clock = time.perf_counter
        times: list[float] = []
        if at:
            time.sleep(max(at - time.monotonic(), 0.0))
        end = clock() + seconds
        while len(times) < count if count else clock() < end:
            start = clock()
            call()
            times.append(clock() - start)
        return times

    def latest(self, count: int) -> list[float]:
        """Read the newest joint state a number of times; return s per read."""
        read, times = self._client.latest, []
        deadline = time.monotonic() + _FIRST_SAMPLE
        while read() is None:  # the first read subscribes
            if time.monotonic() > deadline:
                raise RuntimeError("no joint state has arrived")
            time.sleep(0.001)
        for _ in range(max(count // _LATEST_IN_ONE, 1)):
            start = time.perf_counter()
            for _ in range(_LATEST_IN_ONE):
                read()
            times.append((time.perf_counter() - start) / _LATEST_IN_ONE)
        return times

    def pipeline(self, count: int, width: int) -> float:
        """Keep `width` calls in flight; return calls per second."""
        call = self._client.stepAsync
        flying = deque(call() for _ in range(width))
        start = time.perf_counter()
        for _ in range(count):
            flying.popleft().result()
            flying.append(call())
        rate = count / (time.perf_counter() - start)
        for future in flying:
            future.result()
        return rate

    def _operation(self, operation: str, size: tuple[int, int] | None) -> Callable[[], object]:
        if size is None:
            call: Callable[[], object] = getattr(self._client, operation)
            return call
        return partial(self._image, *size)

    def _image(self, width: int, height: int) -> None:
        view = np.frombuffer(self._client.image(width, height), np.uint8)
        if view.size != 3 * width * height:
            raise RuntimeError(f"an image of {view.size} bytes")

    # Streams.

    def follow(self, stream: str) -> None:
        """Follow a stream; `heard` shows when its values arrive."""
        self.unfollow()
        self._arrivals = Arrivals()
        self._following = self._client.follow(stream, self._arrivals.take)
        self._following.__enter__()

    def heard(self) -> int:
        """Return the number of values that have arrived."""
        return len(self._arrivals.numbers)

    def forget(self) -> None:
        """Discard the values that have arrived."""
        self._arrivals.clear()

    def collect(self, last: int, limit: float) -> dict[str, Any]:
        """Wait for the value with a number, or for silence; return what has arrived since `forget`."""
        return self._arrivals.collect(last, limit)

    def unfollow(self) -> None:
        """Stop following."""
        following, self._following = self._following, None
        if following is not None:
            following.__exit__(None, None, None)


class Arrivals:
    """The values that arrived on a stream, with their times."""

    def __init__(self) -> None:
        self.numbers: list[int] = []
        self._latencies: list[float] = []
        self._times: list[int] = []
        self._changed = threading.Condition()

    def take(self, value: Any) -> None:  # noqa: ANN401
        """Record a value; the pixels of an image are read, as by any subscriber."""
        if hasattr(value, "pixels"):
            np.frombuffer(value.pixels, np.uint8)[-1]
        now = time.monotonic_ns()
        with self._changed:
            self._latencies.append((now - value.stamp) * 1e-9)
            self._times.append(now)
            self.numbers.append(value.number)
            self._changed.notify()

    def clear(self) -> None:
        """Discard everything."""
        with self._changed:
            for each in (self.numbers, self._latencies, self._times):
                each.clear()

    def collect(self, last: int, limit: float) -> dict[str, Any]:
        """Wait for the value with a number, or for silence; return what arrived."""
        deadline = time.monotonic() + limit
        with self._changed:
            while not self.numbers or self.numbers[-1] < last:
                before = len(self.numbers)
                self._changed.wait(_QUIET)
                if len(self.numbers) == before or time.monotonic() > deadline:
                    break
            span = (self._times[-1] - self._times[0]) * 1e-9 if self._times else 0.0
            return {
                "latencies": list(self._latencies),
                "received": len(set(self.numbers)),
                "in_order": self.numbers == sorted(self.numbers),
                "rate": (len(self._times) - 1) / span if span else 0.0,
            }
