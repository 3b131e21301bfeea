"""The lights: ALLeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from naoserver.capabilities import Color
from naoserver.errors import CommandRefused, HardwareFailure
from naoserver.lights import SINGLE_COLORED, FadingLights
from naoserver_naoqi.errands import Errands

__all__ = ["NaoqiLights"]

_GROUPS: Final = {
    "LeftEye": "LeftFaceLeds",
    "RightEye": "RightFaceLeds",
    "LeftEar": "LeftEarLeds",
    "RightEar": "RightEarLeds",
    "Head": "BrainLeds",
    "Chest": "ChestLeds",
    "LeftFoot": "LeftFootLeds",
    "RightFoot": "RightFootLeds",
}


class NaoqiLights:
    """The lights of a robot. Implements Lights.

    NAOqi does not tell what they show: that is what they were told here.
    """

    def __init__(self, errands: Errands, now: Callable[[], float]) -> None:
        self._errands = errands
        self._shown = FadingLights(now)

    @property
    def names(self) -> tuple[str, ...]:
        """The groups: eyes, ears, head, chest and feet."""
        return self._shown.names

    def set(self, name: str, color: Color, seconds: float) -> None:
        """Let a group fade to a color in some seconds. Raises CommandRefused while the robot is lost."""
        try:
            if name in SINGLE_COLORED:
                self._errands.run("ALLeds.fade", _GROUPS[name], max(color), seconds)
            else:
                red, green, blue = (round(255 * part) for part in color)
                self._errands.run("ALLeds.fadeRGB", _GROUPS[name], red << 16 | green << 8 | blue, seconds)
        except HardwareFailure as error:
            raise CommandRefused(str(error)) from error
        self._shown.set(name, color, seconds)

    def reset(self) -> None:
        """Let every group show what it shows after the start."""
        try:
            self._errands.run("ALLeds.reset", "AllLeds")
        except HardwareFailure as error:
            raise CommandRefused(str(error)) from error
        self._shown.reset()

    def colors(self) -> Mapping[str, Color]:
        """Return what each group was told to show."""
        return self._shown.colors()
