"""Models of the looks of a robot alone."""

from __future__ import annotations

from typing import Final

import mujoco

from naoserver.bodies.looks import read_looks
from naoserver.bodies.nao import H25
from naoserver_sim.appearance import VISUAL_GROUP, add_appearance

__all__ = ["COLORS", "model_of"]

COLORS: Final = {light: lamp.start for light, lamp in H25.lights.items()} | {"Ring": (1.0, 1.0, 0.0)}
"""Colors of the lights of all robots that have looks."""


def model_of(name: str, *, skin: bool = True) -> mujoco.MjModel:
    """Return a model of a robot's looks, its links all in one place."""
    spec = mujoco.MjSpec()
    spec.add_default("skin", spec.default).geom.group = VISUAL_GROUP
    looks = read_looks(name)
    parts = (*looks.skin.parts(), *looks.skin.parts(shell=False))
    links = {link: spec.worldbody.add_body(name=link) for link in dict.fromkeys(part.link for part in parts)}
    add_appearance(spec, links, looks, skin=skin, colors=COLORS)
    return spec.compile()
