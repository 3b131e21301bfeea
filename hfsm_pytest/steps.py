"""What happens to a behavior in a random test: steps that print as the code that repeats them."""

from __future__ import annotations

from dataclasses import dataclass

from .behavior import Behavior
from .errors import says_it_all

__all__ = ["Advance", "HideBall", "PlaceBall", "Send", "SetGuard", "Step"]
__tracebackhide__ = says_it_all


@dataclass(frozen=True, slots=True)
class Advance:
    """Let time pass, in s."""

    seconds: float

    def apply(self, b: Behavior) -> None:
        """Do it."""
        b.advance(self.seconds)

    def __repr__(self) -> str:
        return f"b.advance({self.seconds:g})"


@dataclass(frozen=True, slots=True)
class SetGuard:
    """Make a guard true or false from now on."""

    name: str
    value: bool

    def apply(self, b: Behavior) -> None:
        """Do it."""
        b.guard(self.name, self.value)

    def __repr__(self) -> str:
        return f"b.guard({self.name!r}, {self.value})"


@dataclass(frozen=True, slots=True)
class Send:
    """Send an event."""

    event: str

    def apply(self, b: Behavior) -> None:
        """Do it."""
        b.send(self.event)

    def __repr__(self) -> str:
        return f"b.send({self.event!r})"


@dataclass(frozen=True, slots=True)
class PlaceBall:
    """Put a ball somewhere: bearing in rad, distance and height in m."""

    ball: str
    pan: float
    distance: float
    height: float

    def apply(self, b: Behavior) -> None:
        """Do it."""
        b.robot.ball(self.ball).place(self.pan, self.distance, self.height)

    def __repr__(self) -> str:
        place = f"{self.pan:g}, {self.distance:g}, {self.height:g}"
        return f"b.robot.ball({self.ball!r}).place({place})"


@dataclass(frozen=True, slots=True)
class HideBall:
    """Put a ball out of sight."""

    ball: str

    def apply(self, b: Behavior) -> None:
        """Do it."""
        b.robot.ball(self.ball).hide()

    def __repr__(self) -> str:
        return f"b.robot.ball({self.ball!r}).hide()"


Step = Advance | SetGuard | Send | PlaceBall | HideBall
