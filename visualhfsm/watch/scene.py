"""Everything that the view shows at one moment, apart from how it is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Generic, TypeVar

from interfaces.hfsm import ComponentSnapshot
from interfaces.nao import HeadPose, HealthReport
from visualhfsm.watch.automata import Automata
from visualhfsm.watch.recording import Ball, Change

__all__ = ["STALE", "STALE_HEALTH", "Aged", "Scene"]

STALE: Final = 0.8
"""Wall seconds after which a value that comes at least ten times a second is no longer believed."""
STALE_HEALTH: Final = 2.0
"""The same for health reports, which come twice a second."""

T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True, slots=True)
class Aged(Generic[T_co]):
    """A value and the wall seconds since it arrived."""

    value: T_co
    age: float
    limit: float = STALE

    @property
    def stale(self) -> bool:
        """Whether the value is too old to be believed."""
        return self.age > self.limit


@dataclass(frozen=True, slots=True)
class Scene:
    """A component and its robot at one moment; what has not arrived yet is None or empty.

    `joints` and `limits` are in rad by joint name, `image_size` is in pixels. `elapsed` counts the wall
    seconds of watching, `seconds` is its end, 0 for never.
    """

    component: str
    endpoint: str
    elapsed: float = 0.0
    seconds: float = 0.0
    automata: Automata | None = None
    snapshot: Aged[ComponentSnapshot] | None = None
    ball: Ball | None = None
    changes: Sequence[Change] = ()
    head: Aged[HeadPose] | None = None
    joints: Aged[Mapping[str, float]] | None = None
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    health: Aged[HealthReport] | None = None
    image_size: tuple[int, int] = (320, 240)

    @property
    def robot_age(self) -> float | None:
        """Wall seconds since anything was heard of the robot's server, or None."""
        heard = [aged.age for aged in (self.head, self.joints, self.health) if aged is not None]
        return min(heard, default=None)

    @property
    def trouble(self) -> str:
        """What does not answer and what happens about it; empty when all is well."""
        robot_age = self.robot_age
        if robot_age is None:
            return f"Waiting for a robot server at {self.endpoint}; naoserver-sim starts one"
        if robot_age > STALE:
            return f"Robot server lost {robot_age:.0f} s ago; going on when it is back at {self.endpoint}"
        if self.automata is None or self.snapshot is None:
            return f"Waiting for {self.component}; python -m behaviors.{self.component} starts it"
        if self.snapshot.stale:
            return f"{self.component} lost {self.snapshot.age:.0f} s ago; going on when it is back"
        return ""
