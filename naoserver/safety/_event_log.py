"""The events of the health report, and what causes them: the robot's condition, and that of single joints."""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from interfaces.nao import HealthEvent, Severity
from naoserver.bodies.parts import JointFacts, MotorHeat
from naoserver.protocol.robot import LIMP, BodyState, JointFault, JointReading, Robot
from zenoh_ice.data.text import sentence

log = logging.getLogger(__name__)

KEPT: Final = 20
_LEVELS: Final = (logging.INFO, logging.WARNING, logging.ERROR)  # by severity


class EventLog:
    """Collect events and count limited commands; keep at most one event a second of each source and kind.

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
        """Report an event of `source`; events of the same source and `kind` count as the same."""
        now = self.wall_time()
        with self._lock:
            last, suppressed = self._last.get((source, kind), (-float("inf"), 0))
            if now - last < 1.0:
                self._last[source, kind] = (last, suppressed + 1)
                return
            self._last[source, kind] = (now, 0)
            if suppressed:
                message = sentence(f"{message} ({suppressed} more since the last report)")
            self._events.append(HealthEvent(self.robot_time(), level, source, message))
        log.log(_LEVELS[level], "%s: %s", source, message)

    def add_limited(self, limitations: Sequence[tuple[str, str]]) -> None:
        """Count a command if it was limited, and report which of its values were limited and why."""
        with self._lock:
            self._limited += bool(limitations)
        for source, reason in limitations:
            self.add(Severity.Warning, source, reason, "limited")

    def count_timeout(self) -> None:
        """Count a velocity command that was stopped because it was not renewed."""
        with self._lock:
            self._timeouts += 1

    def snapshot(self) -> tuple[list[HealthEvent], int, int]:
        """Return the newest events, oldest first, the limited commands and the velocity timeouts."""
        with self._lock:
            return list(self._events), self._limited, self._timeouts


LOW: Final = 0.2
"""Charge of the battery below which it is low."""
VERY_LOW: Final = 0.07
"""Charge of the battery at which a robot is about to switch itself off."""
_RECOVERED: Final = 0.05
"""How far the charge must rise above a mark before the mark is reported again."""
_FLOOR: Final = -0.3
"""Height in m of its root below which a robot that is not mounted is under the floor."""
_CEILING: Final = 10.0
"""Height in m to which no robot here gets by itself."""
_FASTEST: Final = 20.0
"""Speed in m/s that no robot here gets by itself."""


class ConditionWatch:
    """Compare a robot's condition with the last check, and report each change once."""

    def __init__(self, robot: Robot, events: EventLog) -> None:
        self._robot = robot
        self._events = events
        self._present: set[str] = set()  # present problems
        self._charge_mark = math.inf

    def poll(self, state: BodyState) -> None:
        """Report the changes since the last check; `state` is the robot's newest."""
        name, reading = self._robot.name, self._robot.read()
        tilt = math.degrees(state.torso_tilt)
        fallen = (Severity.Error, sentence(f"fallen: the torso tilts by {tilt:.0f} deg"))
        upright = sentence(f"upright again: the torso tilts by {tilt:.0f} deg")
        self._compare("fallen", state.fallen, name, fallen, upright)
        is_limp = bool(self._robot.body.motors) and max(reading.stiffnesses) < LIMP
        limp = (Severity.Warning, sentence("limp: no motor holds until it is made stiff again"))
        self._compare("limp", is_limp, name, limp, sentence("no longer limp: motors hold again"))
        self._check_place()
        if (heat := self._robot.body.motor_heat) is not None:
            self._check_motors(heat, reading)
        if self._robot.body.battery is not None:
            self._check_battery()

    def _compare(
        self, condition: str, present: bool, source: str, begin: tuple[Severity, str], end: str
    ) -> None:
        if present != (condition in self._present):
            self._present ^= {condition}
            level, message = begin if present else (Severity.Info, end)
            self._events.add(level, source, message, message)

    def _check_place(self) -> None:
        """Report a simulated robot that nothing holds, or that its own parts throw away."""
        stage, name = self._robot.stage, self._robot.name
        if stage is None or self._robot.body.mounted:
            return
        truth = stage.truth()
        height, speed = truth.torso.position[2], math.hypot(*truth.velocity)
        is_under = height < _FLOOR
        under = sentence(f"under the floor: its root is at {height:.1f} m, since no shape of a link holds it")
        self._compare("under", is_under, name, (Severity.Error, under), sentence("above the floor again"))
        is_away = not is_under and (height > _CEILING or speed > _FASTEST)
        away = sentence(
            f"flung away: its root is at {height:.1f} m, at {speed:.0f} m/s, as if its shapes burst apart"
        )
        self._compare("flung", is_away, name, (Severity.Error, away), sentence("no longer flung away"))

    def _check_motors(self, heat: MotorHeat, reading: JointReading) -> None:
        for joint, temperature in zip(self._robot.joints, reading.temperatures, strict=True):
            is_hot = temperature >= (heat.cool if joint.name in self._present else heat.hot)
            hot = sentence(f"hot: its motor has {temperature:.0f} degrees Celsius and gives less torque")
            cool = sentence(f"cool again: its motor has {temperature:.0f} degrees Celsius")
            self._compare(joint.name, is_hot, joint.name, (Severity.Warning, hot), cool)

    def _check_battery(self) -> None:
        if self._robot.senses is None:
            return
        battery = self._robot.senses.read().battery
        unknown = (Severity.Warning, sentence("unknown: the robot does not report its charge"))
        known = sentence("known: its charge is reported again")
        self._compare("battery", math.isnan(battery.charge), "Battery", unknown, known)
        if battery.plugged or battery.charge > self._charge_mark + _RECOVERED:
            self._charge_mark = math.inf
            return
        for mark, level in ((VERY_LOW, Severity.Error), (LOW, Severity.Warning)):
            if battery.charge < mark < self._charge_mark:
                self._charge_mark = mark
                message = sentence(f"low: {battery.charge:.0%} of its charge are left")
                self._events.add(level, "Battery", message, message)
                return


_PATIENCE: Final = 1.0
"""Robot seconds for which a joint makes no way until that is reported."""
_CHECKS: Final = 3
"""Checks that must find so, however fast robot time passes."""
_BEHIND: Final = 0.2
"""Distance in rad from its setpoint beyond which a joint is to move: a load holds it nearer than that."""
_SHARE: Final = 0.25
"""The same as a share of the range, for a joint with a short one."""
_AT_LIMIT: Final = 0.02
"""Share of its range within which a joint is at its limit."""
_WAY: Final = 0.05
"""Distance in rad by which a joint that moves gets on."""
_SLIDES: Final = 0.2
"""Both distances of a joint that slides, in m, for each rad of one that turns."""
_HOLDS: Final = 0.5
"""Stiffness from which a motor is to follow: a softer one may give way to a load."""


@dataclass(slots=True)
class _Wait:
    """A joint that is behind its setpoint: where and when it last got on, and how often it was seen since."""

    time: float
    position: float
    checks: int = 0
    reported: bool = False


class JointWatch:
    """Compare the readings of a robot's joints, and report each change once, with the joint."""

    def __init__(self, robot: Robot, events: EventLog) -> None:
        self._joints = robot.joints
        wheels = robot.body.groups.wheels  # they turn without end, by their speed
        self._sliding = {joint.name for joint in robot.body.joints if joint.sliding}
        self._following = {joint.name for joint in robot.joints if joint.max_torque > 0.0}.difference(wheels)
        self._events = events
        self._faults: Mapping[str, JointFault] = {}
        self._waits: dict[str, _Wait] = {}
        self._time = float("-inf")

    def poll(self, reading: JointReading) -> None:
        """Report the changes since the last reading; an older one, of a lost robot, says nothing."""
        if reading.time <= self._time:
            return
        self._time = reading.time
        self._compare_faults(reading.faults)
        columns = zip(self._joints, reading.positions, reading.commands, reading.stiffnesses, strict=True)
        for joint, position, command, stiffness in columns:
            if joint.name in self._following and joint.name not in reading.faults:
                self._check_joint(joint, position, command, stiffness)

    def _compare_faults(self, faults: Mapping[str, JointFault]) -> None:
        for joint, fault in faults.items():
            if fault != self._faults.get(joint):
                self._events.add(Severity.Error, joint, fault.message, fault.message)
                self._waits.pop(joint, None)
        for joint, fault in self._faults.items():
            if joint not in faults:
                message = sentence("found again")
                if not fault.lost:
                    message = sentence("its motor reports no fault any more")
                self._events.add(Severity.Info, joint, message, message)
        self._faults = dict(faults)

    def _check_joint(self, joint: JointFacts, position: float, command: float, stiffness: float) -> None:
        scale, unit = (_SLIDES, "m") if joint.name in self._sliding else (1.0, "rad")
        span, wait = joint.upper - joint.lower, self._waits.get(joint.name)
        behind, most = abs(command - position), min(_BEHIND * scale, _SHARE * span)
        if stiffness < _HOLDS or behind < most * (0.5 if wait and wait.reported else 1.0):
            if wait and wait.reported:
                again = sentence(f"follows again: {behind:.2f} {unit} behind")
                if stiffness < _HOLDS:
                    again = sentence("is no longer stiff")
                self._events.add(Severity.Info, joint.name, again, "follows")
            self._waits.pop(joint.name, None)
        elif wait is None or (not wait.reported and abs(position - wait.position) > _WAY * scale):
            self._waits[joint.name] = _Wait(self._time, position)
        else:
            wait.checks += 1
            waited = self._time - wait.time
            if not wait.reported and waited >= _PATIENCE and wait.checks >= _CHECKS - 1:
                wait.reported = True
                limit = joint.lower if position < command else joint.upper
                message = sentence(f"does not follow: {behind:.2f} {unit} behind for {waited:.1f} s")
                if abs(position - limit) < _AT_LIMIT * span:
                    what = message
                    message = sentence(f"{what}, at its limit {limit:.3g}")
                self._events.add(Severity.Warning, joint.name, message, "behind")
