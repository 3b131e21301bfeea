"""What is wrong with single joints: servos that report a fault or are lost, and joints that do not follow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from interfaces.nao import Severity
from naoserver._event_log import EventLog
from naoserver.parts import JointFacts
from naoserver.robot import JointFault, JointReading, Robot

_PATIENCE: Final = 1.0
"""Robot seconds for which a joint makes no way until that is reported."""
_LOOKS: Final = 3
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
    looks: int = 0
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

    def look(self, reading: JointReading) -> None:
        """Report the changes since the last reading; an older one, of a lost robot, says nothing."""
        if reading.time <= self._time:
            return
        self._time = reading.time
        self._compare_faults(reading.faults)
        columns = zip(self._joints, reading.positions, reading.commands, reading.stiffnesses, strict=True)
        for joint, position, command, stiffness in columns:
            if joint.name in self._following and joint.name not in reading.faults:
                self._look_at(joint, position, command, stiffness)

    def _compare_faults(self, faults: Mapping[str, JointFault]) -> None:
        for joint, fault in faults.items():
            if fault != self._faults.get(joint):
                self._events.add(Severity.Error, joint, fault.message, fault.message)
                self._waits.pop(joint, None)
        for joint, fault in self._faults.items():
            if joint not in faults:
                message = "found again" if fault.lost else "its motor reports no fault any more"
                self._events.add(Severity.Info, joint, message, message)
        self._faults = dict(faults)

    def _look_at(self, joint: JointFacts, position: float, command: float, stiffness: float) -> None:
        scale, unit = (_SLIDES, "m") if joint.name in self._sliding else (1.0, "rad")
        span, wait = joint.upper - joint.lower, self._waits.get(joint.name)
        behind, most = abs(command - position), min(_BEHIND * scale, _SHARE * span)
        if stiffness < _HOLDS or behind < most * (0.5 if wait and wait.reported else 1.0):
            if wait and wait.reported:
                again = (
                    "is no longer stiff"
                    if stiffness < _HOLDS
                    else f"follows again: {behind:.2f} {unit} behind"
                )
                self._events.add(Severity.Info, joint.name, again, "follows")
            self._waits.pop(joint.name, None)
        elif wait is None or (not wait.reported and abs(position - wait.position) > _WAY * scale):
            self._waits[joint.name] = _Wait(self._time, position)
        else:
            wait.looks += 1
            waited = self._time - wait.time
            if not wait.reported and waited >= _PATIENCE and wait.looks >= _LOOKS - 1:
                wait.reported = True
                limit = joint.lower if position < command else joint.upper
                at_limit = f", at its limit {limit:.3g}" if abs(position - limit) < _AT_LIMIT * span else ""
                message = f"does not follow: {behind:.2f} {unit} behind for {waited:.1f} s{at_limit}"
                self._events.add(Severity.Warning, joint.name, message, "behind")
