"""A client of the soak: it calls and follows two servers, one of which is killed repeatedly."""

from __future__ import annotations

import itertools
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from zenoh_ice import ZenohIceError, initialize

from .content import POSE, SMALL_IMAGE, frame
from .interface import REALM, load_generated

STEADY: Final = "Steady"
RESTARTED: Final = "Restarted"

_PAUSE: Final = 0.005  # s between calls
_IN_FLIGHT: Final = 8


class SoakClient:
    """Calls until the process ends, and counts the results."""

    def __init__(self, endpoints: Sequence[str], package: Path) -> None:
        self._bench = load_generated(package)
        self._stack = ExitStack()
        self._communicator = self._stack.enter_context(
            initialize(realm=REALM, connect=list(endpoints), clock="wall")
        )
        self._stop = threading.Event()
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()
        self._longest = 0.0

    def __enter__(self) -> Self:
        for identity in (STEADY, RESTARTED):
            robot = self._bench.RobotPrx.uncheckedCast(self._communicator.stringToProxy(identity))
            self._stack.enter_context(robot.joints.subscribe(self._check_joints))
            self._stack.enter_context(robot.video.subscribe(self._check_picture))
            thread = threading.Thread(target=self._call_on, args=(robot,))
            thread.start()
            self._threads.append(thread)
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        for thread in self._threads:
            thread.join(10.0)
        self._stack.close()

    def counts(self) -> dict[str, Any]:
        """Return the counts: calls started and ended, by result; values received and torn."""
        with self._lock:
            return {**self._counts, "longest": self._longest}

    def stop(self) -> dict[str, Any]:
        """Stop calling; return the counts when every call has ended, or after 10 s."""
        self._stop.set()
        for thread in self._threads:
            thread.join(10.0)
        return self.counts()

    # Each runs on a separate thread.

    def _call_on(self, robot: Any) -> None:  # noqa: ANN401
        angles = self._bench.Angles(*POSE)
        image = frame(*SMALL_IMAGE).tobytes()
        for number in itertools.count():
            if self._stop.wait(_PAUSE):
                return
            if number % 10 == 5:
                self._call(lambda: robot.image(*SMALL_IMAGE), lambda got: bytes(got) == image)
            elif number % 10 == 9:
                futures = [self._begin(robot.step.begin, angles) for _ in range(_IN_FLIGHT)]
                for future in futures:
                    self._call(future.result, lambda got: got == angles, begun=True)
            else:
                self._call(lambda: robot.step(angles), lambda got: got == angles)

    def _begin(self, call: Callable[[Any], Any], argument: Any) -> Any:  # noqa: ANN401
        with self._lock:
            self._counts["begun"] += 1
        return call(argument)

    def _call(self, call: Callable[[], Any], is_right: Callable[[Any], bool], *, begun: bool = False) -> None:
        with self._lock:
            self._counts["begun"] += not begun
        start = time.monotonic()
        try:
            outcome = "answered" if is_right(call()) else "torn"
        except ZenohIceError as error:
            outcome = type(error).__name__
        took = time.monotonic() - start
        with self._lock:
            self._counts["ended"] += 1
            self._counts[outcome] += 1
            self._longest = max(self._longest, took)

    def _check_joints(self, sample: Any) -> None:  # noqa: ANN401
        state = sample.value
        self._count("samples", torn=any(position != state.number for position in state.positions))

    def _check_picture(self, sample: Any) -> None:  # noqa: ANN401
        view = np.frombuffer(sample.value.pixels, np.uint8)
        self._count("samples", torn=bool((view != sample.value.number % 251).any()))

    def _count(self, what: str, *, torn: bool) -> None:
        with self._lock:
            self._counts[what] += 1
            self._counts["torn"] += torn
