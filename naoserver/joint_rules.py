"""What a command of a joint may hold, whatever moves at the moment, and what the safety layer makes of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from naoserver.body import Coupling
from naoserver.errors import InvalidCommand
from naoserver.options import SafetyOptions
from naoserver.robot import JointFacts


@dataclass(frozen=True, slots=True)
class Limitation:
    """A value that was changed, and why."""

    joint: str
    reason: str


@dataclass(slots=True)
class Outcome:
    """What the device is to be told, and what became of the client's command."""

    positions: dict[str, float] = field(default_factory=dict)
    """Targets for `JointDevice.command_positions`, with `max_speeds`."""
    max_speeds: dict[str, float] = field(default_factory=dict)
    velocities: dict[str, float] = field(default_factory=dict)
    """Velocities for `JointDevice.command_velocities`."""
    accepted: dict[str, float] = field(default_factory=dict)
    """The value of each joint that the client named, as it was limited."""
    limitations: list[Limitation] = field(default_factory=list)
    stopped: list[str] = field(default_factory=list)
    """Joints whose velocity command ended because it was not renewed or its client was lost."""


_LONGEST_NAME: Final = 64
"""Characters of a client's text that are told back."""
_ROUNDING: Final = 1e-9
"""Change in rad (or m) by which a value that only went through arithmetic is not called limited."""


class JointRules:
    """The rules for the joints of one device; what they change is told in an Outcome."""

    def __init__(
        self, joints: Sequence[JointFacts], options: SafetyOptions, couplings: Iterable[Coupling]
    ) -> None:
        self.facts: Final = {joint.name: joint for joint in joints}
        self._options = options
        self._couplings = tuple(couplings)

    def check(self, values: Mapping[str, float], what: str) -> dict[str, float]:
        """Return a copy of the values; raises InvalidCommand for an unknown joint or a value not finite."""
        for joint, value in values.items():
            if joint not in self.facts:
                name = joint[:_LONGEST_NAME]
                raise InvalidCommand(name, f"there is no joint {name!r}; there are {', '.join(self.facts)}")
            if not math.isfinite(value):
                raise InvalidCommand(joint, f"{joint}: a {what} of {value} is not a finite number")
        return dict(values)

    def check_speeds(self, speeds: Mapping[str, float]) -> dict[str, float]:
        """Return a copy of the speeds of position commands; raises InvalidCommand for a negative one, too."""
        for joint, speed in speeds.items():
            if speed < 0:
                raise InvalidCommand(joint, f"{joint}: a speed of {speed:g} is negative")
        return self.check(speeds, "speed")

    def couple(self, values: dict[str, float], outcome: Outcome) -> None:
        """Give joints of one motor the same value: the leader's, or the follower's if it alone has one."""
        for pair in self._couplings:
            leader, follower = values.get(pair.leader), values.get(pair.follower)
            if leader is not None:
                values[pair.follower] = leader
                if follower is not None and follower != leader:
                    reason = f"shares its motor with {pair.leader}, whose {leader:.4g} it takes"
                    outcome.limitations.append(Limitation(pair.follower, reason))
            elif follower is not None:
                values[pair.leader] = follower

    def speed_cap(self, joint: str) -> float:
        """Return the highest speed that a command gets, in rad/s or m/s."""
        fraction = self._options.speed_fractions.get(joint, self._options.speed_fraction)
        return fraction * self.facts[joint].max_velocity

    def default_speed(self, joint: str) -> float:
        """Return the speed of a position command that gives none."""
        return self._options.default_fraction * self.facts[joint].max_velocity

    def cap_speed(self, joint: str, speed: float, outcome: Outcome, *, full: bool = False) -> float:
        """Return a speed, or velocity, capped; with `full` only by what the motor does."""
        cap = self.facts[joint].max_velocity if full else self.speed_cap(joint)
        safe = clamp(speed, -cap, cap)
        if abs(safe - speed) > _ROUNDING:
            outcome.limitations.append(Limitation(joint, f"speed {speed:.4g} is too fast, taken {safe:.4g}"))
        return safe

    def clamp_target(
        self, joint: str, target: float, limits: tuple[float, float], why: str, outcome: Outcome
    ) -> float:
        """Return a target clamped to limits; `why` says what is wrong beyond them."""
        safe = clamp(target, *limits)
        if abs(safe - target) > _ROUNDING:
            outcome.limitations.append(Limitation(joint, f"{target:.4g} {why}, taken {safe:.4g}"))
        return safe


def clamp(value: float, lower: float, upper: float) -> float:
    """Return the value nearest to `value` from `lower` to `upper`."""
    return min(max(value, lower), upper)
