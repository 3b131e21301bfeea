"""ALMotion's foot steps: a walk to where they lead."""

from __future__ import annotations

import cmath
import math
from typing import Final

from naoserver.errors import InvalidCommand
from naoserver_qi.arguments import chosen, fraction, listed, number, texts
from naoserver_qi.calls import Call
from naoserver_qi.motion import ALMotion

_LEGS: Final = ("LLeg", "RLeg")
_HALF: Final = 0.05
"""Half of the distance in m between the feet of NAOqi's stance."""


class FootSteps:
    """Walk to the place between the feet after some steps; the steps on the way are those of the walk."""

    def __init__(self, motion: ALMotion) -> None:
        self._motion = motion

    def setFootSteps(
        self, call: Call, legName: object, footSteps: object, timeList: object, clearExisting: object
    ) -> bool:
        """Walk to where steps lead, which has no effect on each step; returns at the end whether it came."""
        legs, steps = _steps(legName, footSteps)
        for time in listed(timeList, "timeList", len(legs)):
            number(time, "a time")
        return self._walk(call, legs, steps, clearExisting)

    def setFootStepsWithSpeed(
        self, call: Call, legName: object, footSteps: object, fractionMaxSpeed: object, clearExisting: object
    ) -> bool:
        """Walk to where steps lead, which has no effect on each step; returns at the end whether it came."""
        legs, steps = _steps(legName, footSteps)
        for share in listed(fractionMaxSpeed, "fractionMaxSpeed", len(legs)):
            fraction(share, "a fraction")
        return self._walk(call, legs, steps, clearExisting)

    def _walk(self, call: Call, legs: list[str], steps: list[list[float]], clear: object) -> bool:
        if clear:
            self._motion.stopMove()
        # In the plane, x + iy, and headings in rad.
        feet, headings = {"LLeg": 1j * _HALF, "RLeg": -1j * _HALF}, dict.fromkeys(_LEGS, 0.0)
        for leg, (x, y, turn) in zip(legs, steps, strict=True):
            support = _LEGS[leg == "LLeg"]
            feet[leg] = feet[support] + cmath.rect(1.0, headings[support]) * complex(x, y)
            headings[leg] = headings[support] + turn
        middle = sum(feet.values()) / 2
        return self._motion.moveTo(call, middle.real, middle.imag, sum(headings.values()) / 2)


def _steps(legs: object, steps: object) -> tuple[list[str], list[list[float]]]:
    """Return the leg of each step, and x and y in m and the heading in rad relative to the other foot."""
    names = [chosen(leg, "leg", _LEGS) for leg in texts(legs, "legs")]
    found = [
        [number(part, "a step") for part in listed(step, "a step", 3)] for step in listed(steps, "steps")
    ]
    if len(names) != len(found) or not names:
        raise InvalidCommand("steps", f"there are {len(found)} steps for {len(names)} legs")
    if any(math.hypot(x, y) > 1.0 for x, y, _ in found):
        raise InvalidCommand("steps", "a step is longer than 1 m")
    return names, found
