"""What the robot's lights look like: the materials of the lamps, which shine as the lights tell them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import mujoco

from naoserver.capabilities import Color
from naoserver.lights import START

_GLASS: Final = (0.62, 0.65, 0.68)
"""The color of a lamp that is off."""
_WHITE: Final = (0.52, 0.74, 0.80)
"""The white of LEDs, which is cold; what shines by itself is added to it."""
_PALE: Final = 0.25
"""Share of white in what a lamp shows: it dazzles."""
_EMISSION: Final = 0.7


class Look(NamedTuple):
    """A color of a surface, and how much of it shines by itself."""

    color: Color
    emission: float


def look_of(light: Color) -> Look:
    """Return how a lamp looks that shows a color."""
    brightness = max(light)
    red, green, blue = (
        glass * (1.0 - brightness) + white * ((1.0 - _PALE) * shown + _PALE * brightness)
        for glass, white, shown in zip(_GLASS, _WHITE, light, strict=True)
    )
    return Look((red, green, blue), _EMISSION * brightness)


def lamp_material(light: str) -> str:
    """Return the name of the material of a group's lamps."""
    return f"light {light}"


def add_lamp_materials(spec: mujoco.MjSpec) -> None:
    """Add the materials, as the lights are after the start."""
    for light, color in START.items():
        look = look_of(color)
        spec.add_material(
            name=lamp_material(light), rgba=[*look.color, 1.0], emission=look.emission, specular=0.0
        )


class Lamps:
    """Let the lamps of a model look as its lights are."""

    def __init__(self, mj: mujoco.MjModel, colors: Callable[[], Mapping[str, Color]]) -> None:
        self._mj = mj
        self._colors = colors
        self._materials = {
            light: mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_MATERIAL, lamp_material(light))
            for light in START
        }
        self._shown: Mapping[str, Color] = dict(START)

    def show(self) -> None:
        """Look as the lights are now; for the thread that draws."""
        colors = self._colors()
        if colors == self._shown:
            return
        self._shown = colors
        for light, material in self._materials.items():
            look = look_of(colors[light])
            self._mj.mat_rgba[material, :3] = look.color
            self._mj.mat_emission[material] = look.emission
