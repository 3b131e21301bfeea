"""Ways of the whole body: to a posture from wherever it is, and into a motion.

A route is asked for its next leg after each: the next one follows from how the body lies, sits or
stands then. So a getting up that failed is tried again, and a fall on the way is made good.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final, Protocol

from naoserver.body import H25
from naoserver.errors import InvalidCommand
from naoserver.motions.keyframes import Interpolation, Key, Motion
from naoserver.motions.postures import POSTURES, STANCES, Situation, Stance, nearest_posture, stance_of

_FRACTION: Final = 0.3
"""Highest speed of a change of posture as a fraction of the joints': of full pace."""
_SLOWEST: Final = 0.01
"""Smallest fraction of the full pace: a smaller one counts as this, so that every way ends."""
_SHORTEST: Final = 0.4
"""Seconds that a change of posture takes at least."""
_SAME: Final = 0.02
"""Angle in rad within which a joint's setpoint needs no separate leg."""
_TRIES: Final = 3
"""Number of attempts at a motion out of a stance."""


class RouteError(InvalidCommand):
    """There is no way on; the message says why."""

    def __init__(self, message: str) -> None:
        super().__init__("name", message)


class Route(Protocol):
    """The body's actions, leg by leg."""

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg, None at the end; `commands` are the joints' setpoints. Raises RouteError."""


class PostureRoute:
    """The way to a posture: legs from stance to stance, and then within the posture's stance."""

    def __init__(self, posture: str, motions: Iterable[Motion], fraction: float = 1.0) -> None:
        self._posture = posture
        self._fraction = fraction
        self._motions = tuple(motions)
        self._tries: Counter[Stance] = Counter()
        self._arrived = False

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg; None once the body is in the posture. Raises RouteError."""
        stance, wanted = stance_of(situation), STANCES[self._posture]
        if stance is wanted:
            if self._arrived:
                return None
            self._arrived = True
            return within_stance(self._posture, self._motions, situation, commands, self._fraction)
        self._arrived = False
        if self._tries[stance] == _TRIES:
            raise RouteError(f"it is still {stance} after {_TRIES} motions")
        if stance in _SIDES:
            self._tries[stance] += 1
            # The arms of that posture tip the body onto its belly or its back: either will do.
            leg = change_posture(_OFF_THE_SIDE[self._tries[stance] % 2], commands, self._fraction)
            return replace(leg, end="")
        bridge = self._first_bridge(stance, wanted)
        if bridge is None:
            raise RouteError(f"it is {stance}, and no motions lead from there to {self._posture}")
        if stance in _UPRIGHT and not _is_near(commands, bridge.start):
            return within_stance(bridge.start, self._motions, situation, commands, self._fraction)
        self._tries[stance] += 1
        return bridge

    def _first_bridge(self, begin: Stance, end: Stance) -> Motion | None:
        """Return the first of the fewest motions that lead from a stance to another."""
        paths: deque[tuple[Stance, Motion | None]] = deque([(begin, None)])
        seen = {begin}
        while paths:
            stance, first = paths.popleft()
            if stance is end:
                return first
            for motion in self._motions:
                if not motion.start or not motion.end or STANCES[motion.start] is not stance:
                    continue
                after = STANCES[motion.end]
                if after not in seen:
                    seen.add(after)
                    paths.append((after, first or motion))
        return None


class MotionRoute:
    """A motion, after the way into the posture in which it begins."""

    def __init__(self, motion: Motion, motions: Iterable[Motion] = ()) -> None:
        self._motion = motion
        self._motions = tuple(motions)
        self._legs = [motion]
        self._prepared = not motion.start

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg. Raises RouteError when the motion cannot begin as the body is."""
        start = self._motion.start
        if not self._prepared:
            self._prepared = True
            stance = stance_of(situation)
            if stance is not STANCES[start]:
                name = self._motion.name
                raise RouteError(f"{name} begins {STANCES[start]}, in {start}, but the robot is {stance} now")
            if stance in _UPRIGHT and not _is_near(commands, start):
                return within_stance(start, self._motions, situation, commands, 1.0)
        return self._legs.pop() if self._legs else None


def within_stance(
    posture: str,
    motions: Iterable[Motion],
    situation: Situation,
    commands: Mapping[str, float],
    fraction: float,
) -> Motion:
    """Return the leg into a posture of the same stance: a motion made for it, or else the straight way."""
    begin = nearest_posture(situation)
    for motion in motions:
        if begin != posture and (motion.start, motion.end) == (begin, posture):
            return motion
    return change_posture(posture, commands, fraction)


def change_posture(posture: str, commands: Mapping[str, float], fraction: float) -> Motion:
    """Return the motion from where the joints are into a posture at a fraction of the full pace."""
    seconds = max(
        abs(POSTURES[posture][joint.name] - commands[joint.name]) / joint.max_velocity
        for joint in H25.joints
        if joint.name in commands
    )
    seconds = max(seconds * Interpolation.SMOOTH.peak / (_FRACTION * max(fraction, _SLOWEST)), _SHORTEST)
    keys = {joint: (Key(seconds, angle),) for joint, angle in POSTURES[posture].items() if joint in commands}
    for pair in H25.couplings:
        del keys[pair.follower]
    return Motion(f"to {posture}", MappingProxyType(keys), end=posture)


_SIDES: Final = (Stance.LEFT_SIDE, Stance.RIGHT_SIDE)
_OFF_THE_SIDE: Final = ("LyingBack", "StandZero")
_UPRIGHT: Final = (Stance.STANDING, Stance.SITTING)


def _is_near(commands: Mapping[str, float], posture: str) -> bool:
    angles = POSTURES[posture]
    return all(abs(command - angles[joint]) <= _SAME for joint, command in commands.items())
