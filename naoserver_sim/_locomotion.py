"""What all ways to move over the floor have in common: commands, what ends a motion, and arms that swing."""

from __future__ import annotations

import cmath
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import astuple
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import STILL, InertialReading, Odometry, WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver_sim._following import Following
from naoserver_sim._motors import Array, SetpointController
from naoserver_sim._simulator import Simulator
from zenoh_ice.data.text import sentence

_SLOWEST_WALK: Final = 1e-3
"""Velocity in m/s and rad/s below which a robot does not move."""
STUCK: Final = sentence("it does not get on: a wall, an edge, a slope or a push holds it back")
MOVED: Final = sentence("the robot was moved")
WALKS: Final = sentence("walk")
LYING: Final = sentence("it lies, or it falls; make it stand up first")
OFF_ITS_FEET: Final = sentence("it does not stand on its feet")
TILT: Final = math.radians(50)
"""Tilt of the trunk beyond which a robot is falling, and does not move."""
_UPRIGHT: Final = math.radians(20)
"""Tilt of the trunk beyond which joints say nothing of themselves: something throws the robot over."""
FIRM: Final = 0.5
"""Least stiffness of the motors with which it moves or balances."""
STILL_RATE: Final = 0.1
"""Turning rate in rad/s about each axis below which a robot that does not step stands still."""
STANDING_TICKS: Final = 500
"""Ticks of standing still over which the errors of the inertial unit are means."""


def limp(stiffnesses: Array, why: str) -> str:
    """Return why motors with such stiffnesses do not move a robot, and what to do; empty if they do."""
    weak = min(stiffnesses.tolist()) < FIRM
    return f"{why}; " + sentence(f"make them stiff, {FIRM:g} at least") if weak else ""


def yaw_rate(inertial: InertialReading) -> float:
    """Return the rate of the heading in rad/s, from the rates about the axes of a tilted trunk."""
    _, about_y, about_z = inertial.angular_velocity
    upright = max(math.cos(inertial.pitch), 0.1)  # a trunk that lies has no heading
    return (about_y * math.sin(inertial.roll) + about_z * math.cos(inertial.roll)) / upright


def nearer(value: float, wanted: float, most: float, slowing: float) -> float:
    """Return a value nearer to the wanted one by at most `most`, times `slowing` if it becomes smaller."""
    if value * wanted < 0.0:
        wanted = 0.0  # standing still precedes the way back
    if abs(wanted) < abs(value):
        most *= slowing
    return value + max(-most, min(most, wanted - value))


_LAG: Final = 0.8
"""Time constant in s with which a robot follows a higher velocity."""
_SURE: Final = 0.7
"""Part of the way of steady motion from which there is a verdict: not while it starts or turns round."""
_SLOW: Final = 0.05
"""Mean commanded velocity in m/s below which there is no verdict: who turns does not stay on the spot."""
_LEAST: Final = 0.5
"""Least part of the commanded way that a robot goes which gets on."""


class Headway:
    """Add up both ways, as sums that forget; `tick` is due at each control tick of a motion.

    `memory` is the time constant in s with which they forget; `slack` is the distance in m by which the way
    done may be less, because steps differ.
    """

    def __init__(self, memory: float = 2.0, slack: float = 0.04) -> None:
        self._memory = memory
        self._slack = slack
        self.begin()

    def begin(self) -> None:
        """Begin a motion, from rest."""
        self._expected = self._told = self._done = 0j
        self._place: complex | None = None

    def tick(self, seconds: float, velocity: WalkVelocity, now: Odometry) -> bool:
        """Advance by some seconds at a velocity, to the place `now`; return whether it gets on."""
        wanted, place = complex(velocity.forward, velocity.left), complex(now.x, now.y)
        if abs(self._expected) > abs(wanted):  # it slows down sooner
            self._expected *= abs(wanted) / abs(self._expected)
        self._expected += (wanted - self._expected) * seconds / _LAG
        kept = math.exp(-seconds / self._memory)
        self._told = kept * self._told + seconds * self._expected * cmath.rect(1.0, now.heading)
        self._done = kept * self._done + (0j if self._place is None else place - self._place)
        self._place = place
        told = abs(self._told)
        if told < self._memory * max(_SLOW, _SURE * abs(wanted)):
            return True
        return (self._done / self._told).real * told >= _LEAST * told - self._slack


class Locomotion(ABC):
    """A walk, or a drive: moves at the newest commanded velocity, until it is 0 or something ends the motion.

    Implements `capabilities.Walker`, whose methods may be called from any thread; all others are
    for the thread of the physics only. `does` is the verb in errors.
    """

    lag: float = 0.0
    balances: bool = False

    def __init__(
        self, simulator: Simulator, joints: tuple[str, ...], limits: WalkVelocity, does: str = WALKS
    ) -> None:
        self.joints: Final = joints
        self.limits: Final = limits
        self._simulator = simulator
        self._does = does
        self.ended = ""
        self.failed = False
        self._newest = self._commanded = STILL
        self._velocity = STILL
        """The velocity that it follows; for the thread of the physics only."""
        self._headway = Headway()
        self._following = Following(simulator, joints)

    @property
    @abstractmethod
    def walking(self) -> bool:
        """Whether it moves, as of `Walker`."""

    @abstractmethod
    def odometry(self) -> Odometry:
        """Return the place that it measures, as of `Walker`."""

    @abstractmethod
    def tick(self, seconds: float) -> None:
        """Set the setpoints of its motors for the next control tick, and update the odometry."""

    @abstractmethod
    def abandon(self, why: str = MOVED) -> None:
        """End the motion at once: the robot fell, or was placed elsewhere."""

    @abstractmethod
    def _hindrance(self, stiffnesses: NDArray[np.float64]) -> str:
        """Return why it cannot move, with these stiffnesses of all motors; empty when it can."""

    def command(self, velocity: WalkVelocity) -> None:
        """Move at a velocity until the next command. Raises InvalidCommand when it cannot move now."""
        if max(map(abs, astuple(velocity))) < _SLOWEST_WALK:
            velocity = STILL
        if velocity != STILL and not self.walking:
            reason = self._hindrance(self._simulator.newest().stiffnesses)
            if reason:
                what = self._does
                raise InvalidCommand("walk", f"the robot cannot {what}: {reason}")
            self.ended, self.failed = "", False
        self._newest = self._commanded = velocity
        self._simulator.order(lambda: self._accept(velocity))

    def commanded(self) -> WalkVelocity:
        """Return the newest command; all 0 once the motion has ended."""
        return self._commanded

    def _accept(self, velocity: WalkVelocity) -> None:
        if velocity is self._newest:
            self._commanded = velocity  # even if the motion was ended since then
        self._velocity = self._followed(velocity)

    def _followed(self, velocity: WalkVelocity) -> WalkVelocity:
        """Return the velocity that it has to follow to reach a commanded one."""
        return velocity

    def _check_headway(self, seconds: float, velocity: WalkVelocity, now: Odometry, tilt: float) -> None:
        """End a motion at a velocity that does not get on, or whose joints do not follow.

        `now` is the place at the end of some seconds, `tilt` that of the trunk in rad.
        """
        if velocity == STILL:
            self._headway.begin()
        elif not self._headway.tick(seconds, velocity, now):
            self._end(STUCK)
        self._check_following(seconds, velocity, tilt)

    def _check_following(self, seconds: float, velocity: WalkVelocity, tilt: float) -> None:
        """End a motion whose joints do not follow."""
        if velocity == STILL or tilt > _UPRIGHT:
            self._following.begin()
        elif joint := self._following.tick(seconds):
            self.failed = True
            self._end(sentence(f"{joint} does not follow its commands"))

    def _end(self, why: str) -> None:
        """Follow no command any more."""
        self.ended = why
        self._commanded = self._velocity = STILL


class ArmSwing:
    """Swing the arms that hang when the walk begins, each until one of its joints is commanded.

    They swing against the legs, which keeps the feet from twisting on the floor. `arms` are the motors of
    each, left and right; the one that swings it comes first.
    """

    def __init__(self, setpoints: SetpointController, arms: Sequence[NDArray[np.intp]]) -> None:
        self._setpoints = setpoints
        self._arms = arms
        self._shoulders = np.array([arm[0] for arm in arms], dtype=np.intp)
        self.begin(np.zeros(len(arms), dtype=bool))

    def shoulders(self) -> Array:
        """Return the setpoints of the motors that swing the arms, in rad."""
        return self._setpoints.setpoints[self._shoulders]

    def begin(self, hanging: NDArray[np.bool_]) -> None:
        """Swing the arms that are `hanging` from now on."""
        self._rests: list[float] = self.shoulders().tolist()
        self._seen = self._setpoints.commands
        self._begun = self._commands()
        self._swing(hanging)

    def tick(self, swings: Sequence[float], out: Array, reach: float = math.inf) -> None:
        """Fill the setpoints of the shoulders in `out`: `swings` from where they hung, in rad.

        None moves by more than `reach` rad.
        """
        if self._seen is not self._setpoints.commands:
            self._seen = self._setpoints.commands
            self._swing(self._swinging & (self._commands() == self._begun))
        moved = self._moved
        if not moved.size:
            return
        present = self._setpoints.setpoints[moved].tolist()
        angles = [self._rests[arm] + swings[arm] for arm in self._swung]
        near = [max(now - reach, min(now + reach, angle)) for now, angle in zip(present, angles, strict=True)]
        self._setpoints.place(moved, np.array(near), out)

    def _swing(self, swinging: NDArray[np.bool_]) -> None:
        self._swinging, self._moved = swinging, self._shoulders[swinging]
        self._swung = np.flatnonzero(swinging).tolist()

    def _commands(self) -> NDArray[np.int64]:
        """Return the numbers of commands to the joints of each arm."""
        return np.array([self._setpoints.commands[arm].sum() for arm in self._arms], dtype=np.int64)
