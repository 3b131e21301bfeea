"""Other robots in a picture of a field: something tall stands there, perhaps with a shirt above its feet."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from naoserver.bodies.sight import Array, Thing
from naoserver.eyes._shot import Found, Shot
from naoserver.eyes.looks import Looks

_APART: Final = 0.4
"""Distance in m between the feet of two robots."""
_COLUMNS: Final = 2
"""Searched columns that show a robot; fewer show something narrow."""
_NEAREST: Final = 0.35
"""Distance in m of what is nearer: the robot's own hands and feet."""
_SHIRT_PLACE: Final = 0.12, 0.2, 0.5
"""Half the width in m of what may be a shirt, and its heights above the floor."""
_SHIRT: Final = 0.04
"""Share of that which has its color."""


def find_robots(shot: Shot, looks: Looks, feet: Array, posts: Array) -> Iterator[Found]:
    """Yield robots where feet are, and no posts: x and y in m in the robot's frame, a row for each."""
    for post in posts:
        feet = feet[np.hypot(*(feet - post).T) > _APART]
    feet = feet[np.hypot(*(feet - shot.eye[:2]).T) > _NEAREST]
    feet = feet[np.argsort(np.hypot(*(feet - shot.eye[:2]).T))]
    while len(feet):
        beside = np.hypot(*(feet - feet[0]).T) < _APART
        own, feet = feet[beside], feet[~beside]
        if len(own) < _COLUMNS:
            continue
        x, y = np.median(own, axis=0).tolist()
        base = np.array((x, y, 0.0))
        shirt = _shirt(shot, looks, base)
        thing = Thing("robot", shirt, 0.9 if shirt else 0.5, error=shot.error_on_floor(base))
        yield Found(thing, np.array((x, y, looks.robots.height)), base)


def _shirt(shot: Shot, looks: Looks, base: Array) -> str:
    """Return the color above a place on the floor; empty if there is none."""
    wide, low, high = _SHIRT_PLACE
    way = (base - shot.eye)[:2]
    aside = wide * np.array((-way[1], way[0], 0.0)) / np.hypot(*way)
    corners = shot.pixels_of(np.array((base + aside + (0.0, 0.0, high), base - aside + (0.0, 0.0, low))))
    if np.isnan(corners).any():
        return ""
    (left, top), (right, bottom) = np.clip(corners, 0, shot.pixels.shape[1::-1]).astype(int).tolist()
    shares = {
        name: float(shot.masks(looks.colors[name])[top:bottom, left:right].mean()) / 255.0
        for name in looks.robots.shirts
        if bottom > top and right > left
    }
    best = max(shares, key=shares.__getitem__, default="")
    return best if best and shares[best] > _SHIRT else ""
