"""Options of a robot server, with their defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class SafetyOptions:
    """Limits of commands."""

    speed_fraction: float = 0.3
    """Cap of every speed as a fraction of the joint's full speed. Both arms in phase at 0.5 throw a standing
    H25 over; at 0.3 its torso tilts 8 to 15 degrees."""
    speed_fractions: Mapping[str, float] = field(default_factory=lambda: {"HeadYaw": 1.0, "HeadPitch": 1.0})
    """Caps of joints that have their own."""
    default_fraction: float = 0.1
    """Fraction of the full speed at which a position command moves that gives no speed: JdeRobot's."""
    velocity_timeout: float = 0.5
    """Wall seconds after which a velocity command stops unless it is renewed."""
    ramp_time: float = 0.25
    """Robot seconds in which a velocity command takes a joint from rest to full speed."""
    period: float = 0.02
    """Wall seconds between two checks of moving joints."""


@dataclass(frozen=True, slots=True)
class CameraOptions:
    """The settings with which a camera starts, and to which `reset` returns."""

    width: int = 320
    height: int = 240
    rate: float = 10.0
    """Images a second of robot time."""


@dataclass(frozen=True, slots=True)
class ServerOptions:
    """Options of a robot server."""

    safety: SafetyOptions = field(default_factory=SafetyOptions)
    mechanism_safety: SafetyOptions = field(default_factory=lambda: SafetyOptions(speed_fraction=1.0))
    """Limits of commands to the mechanisms besides the robot (the balls)."""
    camera: CameraOptions = field(default_factory=CameraOptions)
    cameras: Mapping[str, CameraOptions] = field(default_factory=dict)
    """Settings of single cameras by identity; the others take `camera`."""
    state_rate: float = 50.0
    """Samples of joint and head state a second of robot time."""
    state_wall_rate: float = 200.0
    """Most samples of state a second of wall time, however fast a simulation runs."""
    clock_rate: float = 50.0
    """Clock samples a second of wall time."""
    health_rate: float = 2.0
    """Health reports a second of wall time."""
