"""What an operator should know: the events of the health report, and how the robot's condition makes some."""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Final

from interfaces.nao import HealthEvent, Severity
from naoserver.robot import BodyState, JointReading, Robot

log = logging.getLogger(__name__)

KEPT: Final = 20
_LEVELS: Final = {
    Severity.Info: logging.INFO,
    Severity.Warning: logging.WARNING,
    Severity.Error: logging.ERROR,
}


class EventLog:
    """Collect events and count what was limited; of one source and kind, at most one event a second is kept.

    Thread-safe. `robot_time` gives an event's time, `wall_time` (steady) paces the rate limit.
    """

    def __init__(self, robot_time: Callable[[], float], wall_time: Callable[[], float]) -> None:
        self.robot_time: Final = robot_time
        self.wall_time: Final = wall_time
        self._lock = threading.Lock()
        self._events: deque[HealthEvent] = deque(maxlen=KEPT)
        self._last: dict[tuple[str, str], tuple[float, int]] = {}  # wall time of the newest, suppressed since
        self._limited = 0
        self._timeouts = 0

    def add(self, level: Severity, source: str, message: str, kind: str = "") -> None:
        """Report what happened to `source`; events of the same source and `kind` count as the same."""
        now = self.wall_time()
        with self._lock:
            last, suppressed = self._last.get((source, kind), (-float("inf"), 0))
            if now - last < 1.0:
                self._last[source, kind] = (last, suppressed + 1)
                return
            self._last[source, kind] = (now, 0)
            if suppressed:
                message = f"{message} ({suppressed} more since the last report)"
            self._events.append(HealthEvent(self.robot_time(), level, source, message))
        log.log(_LEVELS[level], "%s: %s", source, message)

    def count_limited(self) -> None:
        """Count a command that was limited."""
        with self._lock:
            self._limited += 1

    def count_timeout(self) -> None:
        """Count a velocity command that was stopped because it was not renewed."""
        with self._lock:
            self._timeouts += 1

    def snapshot(self) -> tuple[list[HealthEvent], int, int]:
        """Return the newest events, oldest first, the limited commands and the velocity timeouts."""
        with self._lock:
            return list(self._events), self._limited, self._timeouts


HOT: Final = 75.0
"""Temperature in degrees Celsius from which on a motor of a Nao gives less torque."""
COOL: Final = 70.0
"""Temperature below which a hot motor counts as cool again."""
LOW: Final = 0.2
"""Charge of the battery below which it is low."""
VERY_LOW: Final = 0.07
"""Charge of the battery at which a Nao is about to switch itself off."""
_RECOVERED: Final = 0.05
"""By how much the charge is above a mark before it can be told of again."""
_LIMP: Final = 0.05
"""Stiffness below which a motor holds nothing."""

_Event = tuple[Severity, str, str]


@dataclass(slots=True)
class ConditionWatch:
    """Compare a robot's condition with that of the last look, and tell what has changed, once."""

    robot: Robot
    events: EventLog
    _fallen: bool = False
    _limp: bool = False
    _hot: set[str] = field(default_factory=set)
    _charge_mark: float = math.inf

    def look(self, state: BodyState) -> None:
        """Tell what has changed since the last look; `state` is the robot's newest."""
        reading = self.robot.read()
        for level, source, message in (
            *self._look_at_fall(state),
            *self._look_at_stiffness(reading),
            *self._look_at_temperatures(reading),
            *self._look_at_battery(),
        ):
            self.events.add(level, source, message, message)

    def _look_at_fall(self, state: BodyState) -> Iterator[_Event]:
        if state.fallen != self._fallen:
            self._fallen = state.fallen
            tilt = math.degrees(state.torso_tilt)
            if state.fallen:
                yield Severity.Error, self.robot.name, f"fallen: the torso tilts by {tilt:.0f} deg"
            else:
                yield Severity.Info, self.robot.name, f"upright again: the torso tilts by {tilt:.0f} deg"

    def _look_at_stiffness(self, reading: JointReading) -> Iterator[_Event]:
        limp = max(reading.stiffnesses, default=1.0) < _LIMP
        if limp != self._limp:
            self._limp = limp
            if limp:
                yield Severity.Warning, self.robot.name, "limp: no motor holds until it is made stiff again"
            else:
                yield Severity.Info, self.robot.name, "no longer limp: motors hold again"

    def _look_at_temperatures(self, reading: JointReading) -> Iterator[_Event]:
        for joint, temperature in zip(self.robot.joints, reading.temperatures, strict=True):
            name = joint.name
            if name not in self._hot and temperature >= HOT:
                self._hot.add(name)
                message = f"hot: its motor has {temperature:.0f} degrees Celsius and gives less torque"
                yield Severity.Warning, name, message
            elif name in self._hot and temperature < COOL:
                self._hot.remove(name)
                yield Severity.Info, name, f"cool again: its motor has {temperature:.0f} degrees Celsius"

    def _look_at_battery(self) -> Iterator[_Event]:
        if self.robot.senses is None:
            return
        battery = self.robot.senses.read().battery
        if battery.plugged or battery.charge > self._charge_mark + _RECOVERED:
            self._charge_mark = math.inf
            return
        for mark, level in ((VERY_LOW, Severity.Error), (LOW, Severity.Warning)):
            if battery.charge < mark < self._charge_mark:
                self._charge_mark = mark
                yield level, "Battery", f"low: {battery.charge:.0%} of its charge are left"
                return
