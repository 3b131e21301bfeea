"""What streams and watches in virtual time, as the threads of `naoserver` do in real time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

from naoserver.assembly import Assembly
from naoserver.motions.player import PERIOD
from naoserver.options import ServerOptions
from naoserver.servants.camera import CameraI
from naoserver.servants.streaming import StateSource, StreamsState
from naoserver.watchdog import Watched
from zenoh_ice import Object, Publisher

from .clock import TaskClock

__all__ = ["Pump", "Watchdog", "make_pumps"]


class Pump:
    """Publish at whole multiples of a period, for as long as it is wanted; `wake` begins anew."""

    def __init__(
        self,
        clock: TaskClock,
        period: Callable[[], float],
        wanted: Callable[[], bool],
        publish: Callable[[], object],
    ) -> None:
        self._clock: Final = clock
        self._period: Final = period
        self._wanted: Final = wanted
        self._publish: Final = publish
        self._running = False

    def wake(self) -> None:
        """Begin when somebody listens."""
        if not self._running and self._wanted():
            self._running = True
            self._schedule()

    def _schedule(self) -> None:
        period = self._period()
        slot = math.floor(self._clock.now() / period + 1e-6) + 1
        self._clock.call_at(slot * period, self._run)

    def _run(self) -> None:
        if self._wanted():
            self._publish()
            self._schedule()
        else:
            self._running = False


class Watchdog:
    """Look after what moves whenever the safety layer has asked for it."""

    def __init__(self, clock: TaskClock) -> None:
        self._clock: Final = clock
        self.watched: list[Watched] = []
        self._next = math.inf

    def look_within(self, seconds: float) -> None:
        """Look again in at most so many seconds."""
        when = self._clock.now() + seconds
        if when < self._next:
            self._next = when
            self._clock.call_at(when, self._look)

    def _look(self) -> None:
        if self._clock.now() < self._next - 1e-9:
            return  # an earlier look has been asked for meanwhile, and has asked for the next
        self._next = math.inf
        for watched in self.watched:
            due = watched.watch()
            if due is not None:
                self.look_within(due)


def make_pumps(clock: TaskClock, assembly: Assembly, options: ServerOptions) -> list[Pump]:
    """Return the pumps of everything that a robot streams, and that of its motions."""
    by_device: dict[StateSource, list[StreamsState]] = {}
    for servant in assembly.streams:
        by_device.setdefault(servant.device, []).append(servant)
    pumps = [_state_pump(clock, 1.0 / options.state_rate, *item) for item in by_device.items()]
    pumps.extend(_camera_pump(clock, camera) for camera in assembly.cameras)
    time = _publisher(assembly.clock, "getTime")
    pumps.append(
        Pump(clock, lambda: 1.0 / options.clock_rate, lambda: time.listening, assembly.clock.publish)
    )
    pumps.append(_report_pump(clock, 1.0 / options.health_rate, assembly))
    player = assembly.player
    motions = Pump(clock, lambda: PERIOD, lambda: player.busy, player.tick)
    player.on_begin = motions.wake
    pumps.append(motions)
    return pumps


def _state_pump(clock: TaskClock, period: float, device: StateSource, servants: list[StreamsState]) -> Pump:
    def publish() -> None:
        reading = device.read()
        for servant in servants:
            if servant.listening:
                servant.publish(reading)

    return Pump(clock, lambda: period, lambda: any(servant.listening for servant in servants), publish)


def _camera_pump(clock: TaskClock, camera: CameraI) -> Pump:
    return Pump(clock, lambda: camera.period, lambda: camera.wanted, camera.publish)


def _report_pump(clock: TaskClock, period: float, assembly: Assembly) -> Pump:
    health = _publisher(assembly.servants["Health"], "getHealth")
    safety = _publisher(assembly.servants["Safety"], "getSafetyState")

    def publish() -> None:
        for report in assembly.reports:
            report()

    return Pump(clock, lambda: period, lambda: health.listening or safety.listening, publish)


def _publisher(servant: Object, operation: str) -> Publisher[Any]:
    return servant.ice_publisher(servant.ice_interface.all_operations[operation])
