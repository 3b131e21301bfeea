"""The threads that publish: each sends what is new, to whoever listens, at its own pace."""

from __future__ import annotations

import logging
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

from naoserver.servants.camera import CameraI
from naoserver.servants.streaming import StateSource, StreamsState
from zenoh_ice import Clock, TimeoutException

_logger = logging.getLogger(__name__)

_IDLE: Final = 0.05
"""Wall seconds, about, between two looks for listeners while there is none."""
_RESOLUTION: Final = 1e-6
"""Seconds that no clock is waited for."""
_RETRY: Final = 1.0
"""Wall seconds until a pump goes on after a failure."""
_SLICE: Final = 0.25
"""Seconds of any clock after which a pump that waits looks at its period again."""
_FASTEST: Final = 0.001
"""Wall seconds that at least pass between two rounds of any pump, whatever the robot's clock does."""
_END: Final = 3.0
"""Wall seconds within which a pump ends: above the longest a camera takes for an image."""


class Pump(ABC):
    """A thread that does a round of work again and again until it is closed."""

    def __init__(self, name: str) -> None:
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def ask_to_stop(self) -> None:
        """Let the thread end after its current round."""
        self._stopping.set()

    def join(self) -> None:
        """Wait until the thread has ended, with a limit."""
        if self._thread.ident is not None:
            self._thread.join(_END)
            if self._thread.is_alive():
                _logger.error("%s did not end within %g s", self._thread.name, _END)

    @abstractmethod
    def _round(self) -> None:
        """Wait for the next round's time, for as long as `_stopping` is not set, and do its work."""

    def _run(self) -> None:
        while not self._stopping.is_set():
            begun = time.monotonic()
            try:
                self._round()
            except Exception:
                _logger.exception("%s goes on in %g s after an error", self._thread.name, _RETRY)
                self._stopping.wait(_RETRY)
            self._stopping.wait(max(0.0, begun + _FASTEST - time.monotonic()))


class Schedule:
    """Points in time a period apart on a clock: without drift, and without a burst after a delay."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._due = clock.now()

    def wait_for_next(self, stopping: threading.Event, period: Callable[[], float]) -> bool:
        """Wait for the next point, also while `period` changes; returns False when `stopping` came first."""
        last = self._due
        while not stopping.is_set():
            seconds, now = period(), self._clock.now()
            self._due = last + seconds
            if not now - seconds <= self._due <= now + 2 * seconds:  # far too late, or the clock began anew
                self._due = now
            if self._due - now < _RESOLUTION:
                return True
            self._wait(stopping, min(self._due - now, _SLICE))
            if self._clock.now() <= now:
                stopping.wait(_FASTEST)  # a clock that has ended makes nobody wait
        return False

    def idle(self, stopping: threading.Event) -> None:
        """Wait a little, and make the next point due then."""
        self._wait(stopping, _IDLE * (self._clock.rate or 1.0))
        self._due = self._clock.now()

    def _wait(self, stopping: threading.Event, seconds: float) -> None:
        # On the robot's clock even while idle: who advances a virtual one waits until its waiters are back.
        with suppress(TimeoutException):  # nobody advances the virtual clock
            self._clock.wait(stopping, seconds)


class WallPump(Pump):
    """Call `publish` at a rate of wall time."""

    def __init__(self, name: str, rate: float, publish: Callable[[], None]) -> None:
        super().__init__(name)
        self._period = 1.0 / rate
        self._publish = publish
        self._due = time.monotonic()

    def _round(self) -> None:
        self._due = max(self._due + self._period, time.monotonic())
        if not self._stopping.wait(self._due - time.monotonic()):
            self._publish()


class StatePump(Pump):
    """Stream the state of joints, walk and senses: one reading a device and round, shared by its servants.

    A reading that a device has given before, by its time, is not sent again.
    """

    def __init__(self, clock: Clock, rate: float, wall_rate: float, servants: Sequence[StreamsState]) -> None:
        super().__init__("state")
        self._schedule = Schedule(clock)
        self._period = 1.0 / rate
        self._shortest = 1.0 / wall_rate
        self._groups: dict[StateSource, list[StreamsState]] = {}
        self._sent: dict[StateSource, float] = {}
        for servant in servants:
            self._groups.setdefault(servant.device, []).append(servant)

    def _round(self) -> None:
        begun = time.monotonic()
        listening = False
        for device, servants in self._groups.items():
            listened_to = [servant for servant in servants if servant.listening]
            if listened_to:
                listening = True
                reading = device.read()
                if reading.time == self._sent.get(device):
                    continue
                self._sent[device] = reading.time
                for servant in listened_to:
                    servant.publish(reading)
        if not listening:
            self._schedule.idle(self._stopping)
        elif self._schedule.wait_for_next(self._stopping, lambda: self._period):
            self._stopping.wait(max(0.0, begun + self._shortest - time.monotonic()))


class CameraPump(Pump):
    """Stream a camera's images at its rate in robot time."""

    def __init__(self, clock: Clock, camera: CameraI) -> None:
        super().__init__(f"images of {camera.facts.name}")
        self._schedule = Schedule(clock)
        self._camera = camera

    def _round(self) -> None:
        if not self._camera.wanted:
            self._schedule.idle(self._stopping)
        elif not self._camera.publish():
            self._stopping.wait(_RETRY)
        else:
            self._schedule.wait_for_next(self._stopping, lambda: self._camera.period)
