"""Options of a robot server, with their defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class SafetyOptions:
    """Limits of commands."""

    speed_fraction: float = 1.0
    """Limit of every speed, as a fraction of the joint's full speed."""
    speed_rules: bool = True
    """Whether the speed rules of the body apply, too: a Nao's arms are slower while its legs are straight."""
    default_fraction: float = 0.1
    """Speed of a position command that gives none, as a fraction of the full speed: JdeRobot's."""
    velocity_timeout: float = 0.5
    """Wall seconds after which a velocity command stops unless it is renewed."""
    gains_timeout: float = 0.2
    """Wall seconds after which joints no longer follow commands with gains unless they are renewed."""
    damping_time: float = 0.5
    """Wall seconds for which such joints are damped then, before they are held where they are."""
    ramp_time: float = 0.25
    """Robot seconds in which a velocity command accelerates a joint from rest to full speed."""
    period: float = 0.02
    """Wall seconds between two checks of moving joints."""


def capped(fraction: float | None) -> SafetyOptions:
    """Return options with one limit of every speed in any posture; without one, the defaults."""
    if fraction is None:
        return SafetyOptions()
    return SafetyOptions(speed_fraction=fraction, speed_rules=False)


@dataclass(frozen=True, slots=True)
class CameraOptions:
    """The settings with which a camera starts, and to which `reset` returns."""

    width: int = 320
    height: int = 240
    rate: float = 10.0
    """Images a second of robot time."""


@dataclass(frozen=True, slots=True)
class ServerLimits:
    """How long a robot server waits, in s of the wall."""

    retry: float = 1.0
    """Until a job is tried again after a failure."""
    progress: float = 20.0
    """Until a thread of jobs that has not got on counts as hanging: a camera may take 10 s to start."""
    answer: float = 5.0
    """For an answer to the call that shows whether the server works."""


@dataclass(frozen=True, slots=True)
class ServerOptions:
    """Options of a robot server."""

    safety: SafetyOptions = field(default_factory=SafetyOptions)
    mechanism_safety: SafetyOptions = field(default_factory=SafetyOptions)
    """Limits of commands to the mechanisms besides the robot (the balls)."""
    cameras: Mapping[str, CameraOptions] = field(default_factory=dict)
    """Settings of individual cameras by identity; the others have `usual_settings`."""
    sight: bool = True
    """Whether what it sees without pictures is served; else `nao eyes` may serve it."""
    team: str = ""
    """The team whose robots hear each other; empty for a robot that has none."""
    resume_after_reset: bool = False
    """Whether behaviors that an emergency stop paused go on by themselves after its reset."""
    limits: ServerLimits = field(default_factory=ServerLimits)
