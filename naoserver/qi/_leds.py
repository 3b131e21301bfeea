"""ALLeds: the lights."""

from __future__ import annotations

import itertools
import random
from functools import partial
from typing import Final

from naoserver._naoqi_names import LIGHT_GROUPS
from naoserver.capabilities import Color, Lights
from naoserver.errors import InvalidCommand
from naoserver.qi._access import Access, Service, needed
from naoserver.qi._arguments import chosen, listed, number_within, text
from naoserver.qi._clients import Call
from naoserver.qi._lamps import COLORS, LAMPS, lights_of

GROUPS: Final = {
    "AllLeds": tuple(LIGHT_GROUPS),
    "FaceLeds": ("LeftEye", "RightEye"),
    "EarLeds": ("LeftEar", "RightEar"),
    "FeetLeds": ("LeftFoot", "RightFoot"),
    **{group: (light,) for light, group in LIGHT_GROUPS.items()},
}
"""The lights of each of NAOqi's groups; createGroup combines these into further groups."""
_NAMED: Final = {
    "white": 0xFFFFFF,
    "red": 0xFF0000,
    "green": 0x00FF00,
    "blue": 0x0000FF,
    "yellow": 0xFFFF00,
    "magenta": 0xFF00FF,
    "cyan": 0x00FFFF,
}
_DARK: Final = (0.0, 0.0, 0.0)
_STEP: Final = 0.4
"""Robot seconds of a step of an effect."""
_LONGEST_FADE: Final = 60.0  # s
_MOST_GROUPS: Final = 100
_part: Final = partial(number_within, lower=0.0, upper=1.0)
_seconds: Final = partial(number_within, what="duration", lower=0.0, upper=_LONGEST_FADE)


class ALLeds(Service):
    """Set the lights, a group at a time; a fade returns when it is at its end."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._created = self._bounded("groups of lights", _MOST_GROUPS)

    @property
    def _lights(self) -> Lights:
        return needed(self._robot.lights, "has no lights")

    def fadeRGB(self, call: Call, name: object, *color: object) -> None:
        """Fade to red, green and blue from 0 to 1, to 0xRRGGBB or to a colour's name, within some seconds."""
        if len(color) not in (2, 4):
            raise InvalidCommand("color", "fadeRGB takes a group, a colour of one or three values, seconds")
        seconds = _seconds(color[-1])
        self._fade(name, _color(color[:-1]), seconds)
        call.wait(seconds)

    def fadeListRGB(self, call: Call, name: object, rgbList: object, timeList: object) -> None:
        """Fade through colours 0xRRGGBB at times in s."""
        times = listed(timeList, "timeList")
        colors = listed(rgbList, "rgbList", len(times))
        now = 0.0
        for color, time in zip(colors, times, strict=True):
            seconds = max(0.0, _seconds(time) - now)
            now += seconds
            self._fade(name, _color((color,)), seconds)
            if call.wait(seconds):
                return

    def fade(self, call: Call, name: object, intensity: object, duration: object) -> None:
        """Fade to an intensity from 0 to 1 within some seconds."""
        seconds = _seconds(duration)
        self._dim(name, _part(intensity, "intensity"), seconds)
        call.wait(seconds)

    def setIntensity(self, name: object, intensity: object) -> None:
        """Set the intensity of a group, from 0 to 1."""
        self._dim(name, _part(intensity, "intensity"), 0.0)

    def on(self, name: object) -> None:
        """Turn on the lights of a group."""
        self._dim(name, 1.0, 0.0)

    def off(self, name: object) -> None:
        """Turn off the lights of a group."""
        self._dim(name, 0.0, 0.0)

    def reset(self, name: object) -> None:
        """Reset every light to its state after the start."""
        self._members(name)
        self._lights.reset()

    def getIntensity(self, name: object) -> list[float]:
        """Return the brightest part of each light of a group."""
        members, _ = self._members(name)
        colors = self._lights.colors()
        return [max(colors[light]) for light in members]

    def rasta(self, call: Call, duration: object) -> None:
        """Show green, yellow and red in turn on all lights, for some seconds."""
        end = self._robot.clock.now() + _seconds(duration)
        for name in itertools.cycle(("green", "yellow", "red")):
            self._fade("AllLeds", _color((name,)), _STEP)
            if self._pause(call, end):
                return

    def rotateEyes(self, call: Call, rgb: object, timeForRotation: object, totalDuration: object) -> None:
        """Let both eyes swell and fade in a colour, once a rotation, for some seconds."""
        color, end = _color((rgb,)), self._robot.clock.now() + _seconds(totalDuration)
        half = number_within(timeForRotation, "time of a rotation", 0.1, _LONGEST_FADE) / 2.0
        for shown in itertools.cycle((color, _DARK)):
            self._fade("FaceLeds", shown, half)
            if self._pause(call, end, half):
                return

    def randomEyes(self, call: Call, duration: object) -> None:
        """Show changing random colours in the eyes for some seconds."""
        end = self._robot.clock.now() + _seconds(duration)
        while True:
            for light in GROUPS["FaceLeds"]:
                self._lights.set(light, (random.random(), random.random(), random.random()), _STEP)
            if self._pause(call, end):
                return

    def listLEDs(self) -> list[str]:
        """Return the names of the single lamps; each means the whole light that it is a part of."""
        return list(LAMPS)

    def listGroups(self) -> list[str]:
        """Return the names of the groups."""
        return list(self._groups())

    def listGroup(self, groupName: object) -> list[str]:
        """Return the lights of a group."""
        return list(self._members(groupName)[0])

    def createGroup(self, groupName: object, ledNames: object) -> None:
        """Create a group from others, under a new name."""
        groups = [self._members(name)[0] for name in listed(ledNames, "ledNames")]
        members = dict.fromkeys(light for group in groups for light in group)
        with self._lock:
            self._created[text(groupName, "groupName")] = tuple(members)

    def _members(self, name: object) -> tuple[tuple[str, ...], str]:
        """Return the lights of a group, and the only color component meant by `FaceLedsRed` and the like."""
        group = text(name, "name")
        if (lamp := lights_of(group)) is not None:
            return lamp
        part = next((part for part in COLORS if group.endswith(f"Leds{part}")), "")
        groups = self._groups()
        return groups[chosen(group.removesuffix(part), "group of lights", groups)], part

    def _groups(self) -> dict[str, tuple[str, ...]]:
        with self._lock:
            return {**GROUPS, **self._created}

    def _fade(self, name: object, color: Color, seconds: float) -> None:
        for light in self._members(name)[0]:
            self._lights.set(light, color, seconds)

    def _pause(self, call: Call, end: float, seconds: float = _STEP) -> bool:
        """Wait for the next step of an effect; return whether it is at its end in robot time, or stopped."""
        left = end - self._robot.clock.now()
        return call.wait(max(0.0, min(left, seconds))) or left <= seconds

    def _dim(self, name: object, intensity: float, seconds: float) -> None:
        members, part = self._members(name)
        shown = self._lights.colors()
        for light in members:
            red, green, blue = (
                intensity if part in ("", name) else shown[light][i] for i, name in enumerate(COLORS)
            )
            self._lights.set(light, (red, green, blue), seconds)


def _color(values: tuple[object, ...]) -> Color:
    """Return the colour given by three parts, 0xRRGGBB or a name."""
    if len(values) == 3:
        return _part(values[0], "red"), _part(values[1], "green"), _part(values[2], "blue")
    (value,) = values
    code = _NAMED.get(value) if isinstance(value, str) else value
    if not isinstance(code, int) or not 0 <= code <= 0xFFFFFF:
        known = ", ".join(_NAMED)
        raise InvalidCommand("color", f"a colour is 0xRRGGBB or one of {known}, not {str(value)[:60]!r}")
    return (code >> 16) / 255, (code >> 8 & 0xFF) / 255, (code & 0xFF) / 255
