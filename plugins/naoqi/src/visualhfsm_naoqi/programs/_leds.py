"""ALLeds: the lights, and NAOqi's names of single lamps.

A light of ours is a group of such lamps, so that a lamp means its whole group.
"""

from __future__ import annotations

import itertools
import random
import re
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Final

from naoserver.bodies.capabilities import Color, Lights
from naoserver.errors import InvalidCommand
from visualhfsm_naoqi._names import LIGHT_GROUPS
from visualhfsm_naoqi.programs._access import Access, Service, needed
from visualhfsm_naoqi.programs._arguments import chosen, listed, number_within, text
from visualhfsm_naoqi.programs._clients import Call

COLORS: Final = ("Red", "Green", "Blue")
"""The parts of a color, in its order."""
_SIDES: Final = ("Left", "Right")
_HEAD: Final = {"Front": 2, "Middle": 1, "Rear": 3}
"""Lamps of each row on the head, on each side."""


def _lamps() -> Iterator[tuple[str, str, int | None]]:
    """Yield name, light and the number of its only color, None for a lamp that has all that it can show."""
    for color, part in enumerate(COLORS):
        yield f"ChestBoard/Led/{part}", "Chest", color
        for side in _SIDES:
            yield f"{side[0]}Foot/Led/{part}", f"{side}Foot", color
            for angle in range(0, 360, 45):
                yield f"Face/Led/{part}/{side}/{angle}Deg", f"{side}Eye", color
    for side in _SIDES:
        for angle in range(0, 360, 36):
            yield f"Ears/Led/{side}/{angle}Deg", f"{side}Ear", None
        for row, count in _HEAD.items():
            for number in range(count):
                yield f"Head/Led/{row}/{side}/{number}", "Head", None


LAMPS: Final[Mapping[str, tuple[str, int | None]]] = {
    f"{name}/Actuator/Value": (light, color) for name, light, color in _lamps()
}
"""Light and color of each lamp, by the name of its device."""

_NAME: Final = re.compile(
    r"(Left|Right)?(Face|Ear|Brain)Led(Left|Right)?\d{1,2}"
    r"|(Left|Right)?(Face|Ear|Brain)Leds(Left|Right)?(Top|Bottom|Internal|External|Front|Middle|Back|Even|Odd)"
    r"|(Face|Ears|Head|ChestBoard|[LR]Foot)/Led/\S{1,60}"
)
"""Names of lamps, short ones and those of devices, and of groups of lamps within a light."""
_LIGHTS: Final = {
    "Face": "Eye",
    "Ear": "Ear",
    "Foot": "Foot",
    "Brain": "Head",
    "Head": "Head",
    "ChestBoard": "Chest",
}
"""The light at each place of lamps, without its side."""
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


def lights_of(name: str) -> tuple[tuple[str, ...], str] | None:
    """Return the lights that a lamp means, and the only part of their color, empty for all; None for none."""
    if not _NAME.fullmatch(name):
        return None
    light = next(light for place, light in _LIGHTS.items() if place in name)
    sides = _SIDES if f"Left{light}" in LIGHT_GROUPS else ("",)
    meant = [side for side in sides if side in name or name.startswith(f"{side[:1]}Foot")]
    part = next((part for part in COLORS if part in name), "")
    return tuple(f"{side}{light}" for side in meant or sides), part


def brightness_of_lamps(shown: Mapping[str, Color]) -> Iterator[tuple[str, float]]:
    """Yield the name of each lamp, and how bright it is, from 0 to 1, with the lights that are shown."""
    for name, (light, color) in LAMPS.items():
        yield name, max(shown[light]) if color is None else shown[light][color]
