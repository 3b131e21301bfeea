"""What the page is told of a component and its robot at one moment."""

from __future__ import annotations

import math
from typing import Final

import msgspec

from interfaces.hfsm import Breakpoint, ComponentSnapshot, ComponentStructure
from interfaces.nao import HealthReport
from visualhfsm.watch.numbers import number_in

__all__ = ["LiveSnapshot", "LiveStructure", "RobotState", "is_sound", "numbers_of"]

_LONGEST: Final = 1e9
"""Seconds of component time: thirty years."""
_LATEST: Final = 1e11
"""Seconds since 1970 at which a component may have been started, some thousand years."""
_MOST_AUTOMATA: Final = 10_000


class RobotState(msgspec.Struct, frozen=True, rename="camel"):
    """What is known of the robot; what is unknown or too old is empty."""

    joints: dict[str, float] = {}
    """Angles in rad by joint."""
    pan: float | None = None
    """Yaw of the head in rad, positive to the left."""
    tilt: float | None = None
    """Pitch of the head in rad, positive downwards."""
    health: HealthReport | None = None
    trouble: str = ""
    """Why the joints of a robot that is there are not known."""


class LiveSnapshot(msgspec.Struct, frozen=True, rename="camel"):
    """A component at one moment, in the words of `interfaces/hfsm.idl`, and its robot.

    `at` is the wall time in s since the epoch at which it was heard of, in a recording that of the run.
    """

    at: float
    component: ComponentSnapshot
    robot: RobotState = RobotState()


class LiveStructure(msgspec.Struct, frozen=True, rename="camel"):
    """What does not change from moment to moment; `run` counts the times that the component was started."""

    structure: ComponentStructure
    run: int
    breakpoints: list[Breakpoint] = []
    cameras: list[str] = []


def is_sound(snapshot: ComponentSnapshot) -> bool:
    """Return whether a snapshot can be one: of a time in a run, and of not too many automata.

    What is kept of a run is found by its times; whoever is in the realm may send anything.
    """
    return (
        0.0 <= snapshot.time <= _LONGEST
        and abs(snapshot.startedAt) <= _LATEST
        and len(snapshot.automata) <= _MOST_AUTOMATA
    )


def numbers_of(snapshot: LiveSnapshot) -> dict[str, float]:
    """Return all that can be plotted, by name.

    `4.corner` is a variable of automaton 4, `4:lastCycle` the wall seconds of its last cycle, `self.speed` a
    parameter, `joint.HeadYaw` an angle in rad, `robot.lag` and its like are of the robot's server.
    """
    found: dict[str, float] = {}
    for automaton in snapshot.component.automata:
        found[f"{automaton.id}:lastCycle"] = automaton.lastCycle
        found[f"{automaton.id}:overruns"] = float(automaton.overruns)
        for name, text in automaton.variables.items():
            value = number_in(text)
            if value is not None:
                found[f"{automaton.id}.{name}"] = value
    for name, text in snapshot.component.parameters.items():
        value = number_in(text)
        if value is not None:
            found[f"self.{name}"] = value
    robot = snapshot.robot
    found |= {f"joint.{name}": angle for name, angle in robot.joints.items()}
    if robot.health is not None:
        found["robot.realTimeFactor"] = robot.health.realTimeFactor
        found["robot.lag"] = robot.health.lag
        found["robot.torsoTilt"] = robot.health.torsoTilt
    return {name: value for name, value in found.items() if math.isfinite(value)}
