"""What the safety layer makes of a command."""

from __future__ import annotations

from dataclasses import dataclass, field


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
