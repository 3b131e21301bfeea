"""Where the setpoints of joints are, between NAOqi's reports of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from naoserver.robot import JointFacts

__all__ = ["Setpoints"]

_REPORT: Final = 0.2
"""Seconds after which NAOqi's report shows what was commanded."""
_SLACK: Final = 0.05
"""Distance in rad by which a setpoint may differ from its report beside what the delay explains."""


@dataclass(frozen=True, slots=True)
class _Way:
    """A setpoint from `time` on: it moves at `rate` until it is at `end`."""

    time: float
    value: float
    rate: float
    end: float

    def at(self, time: float) -> float:
        if self.rate == 0.0:
            return self.value
        value = self.value + self.rate * max(0.0, time - self.time)
        return min(value, self.end) if self.rate > 0.0 else max(value, self.end)

    @property
    def arrival(self) -> float:
        return self.time + (abs((self.end - self.value) / self.rate) if self.rate else 0.0)


class Setpoints:
    """The setpoint of each joint, as it follows from the commands, corrected by what NAOqi reports.

    A report is some hundredths of a second old, which is too much for who plans the next step from where a
    setpoint is. While a joint is on a commanded way the model is believed, unless the report shows that
    something else moves it; otherwise the report is. Callers serialise the calls.
    """

    def __init__(self, joints: Sequence[JointFacts]) -> None:
        self._joints = {joint.name: joint for joint in joints}
        self._index = {joint.name: index for index, joint in enumerate(joints)}
        self._ways = [_Way(-math.inf, 0.0, 0.0, 0.0) for _ in joints]

    def at(self, time: float) -> tuple[float, ...]:
        """Return every setpoint at a time in s."""
        return tuple(way.at(time) for way in self._ways)

    def value(self, joint: str, time: float) -> float:
        """Return one setpoint at a time in s."""
        return self._ways[self._index[joint]].at(time)

    def send(self, joint: str, target: float, speed: float, time: float) -> None:
        """Let a setpoint go to a target at a speed."""
        facts, index = self._joints[joint], self._index[joint]
        value = self._ways[index].at(time)
        end = min(max(target, facts.lower), facts.upper)
        self._ways[index] = _Way(time, value, math.copysign(speed, end - value) if end != value else 0.0, end)

    def moving(self, joint: str, time: float) -> bool:
        """Return whether a setpoint is on its way."""
        way = self._ways[self._index[joint]]
        return way.rate != 0.0 and time < way.arrival

    def hold(self, joint: str, time: float) -> None:
        """Let a setpoint stay where it is."""
        index = self._index[joint]
        value = self._ways[index].at(time)
        self._ways[index] = _Way(time, value, 0.0, value)

    def report(
        self,
        commands: Sequence[float],
        positions: Sequence[float],
        stiffnesses: Sequence[float],
        time: float,
    ) -> None:
        """Take what NAOqi reports of every joint; the setpoint of a limp motor goes along with its joint."""
        for index, (command, position, stiffness) in enumerate(
            zip(commands, positions, stiffnesses, strict=True)
        ):
            if stiffness == 0.0:
                self._ways[index] = _Way(-math.inf, position, 0.0, position)
                continue
            way = self._ways[index]
            value = way.at(time)
            if time > way.arrival + _REPORT:
                if command != value or way.rate:
                    self._ways[index] = _Way(-math.inf, command, 0.0, command)
            elif time > way.time + _REPORT and abs(command - value) > _SLACK + abs(way.rate) * _REPORT:
                self._ways[index] = replace(way, time=time, value=command)  # something else moved it
