"""Other robots in a picture of a field: something tall stands there, perhaps with a shirt above its feet."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from naoserver.bodies.sight import Array, Thing
from naoserver.eyes._shot import Found, Shot
from naoserver.eyes.looks import Looks

_APART: Final = 0.3
"""Distance in m between the feet of two robots."""
_HANDS: Final = 0.3
"""How far in m its hands reach aside."""
_FARTHER: Final = 1.25
"""How much farther than its feet that seems to be which its hands hide."""
_BALL: Final = 0.2
"""Distance in m from the middle of a ball that hides grass."""
_COLUMNS: Final = 2
"""Searched columns that show a robot; fewer show something narrow."""
_NEAREST: Final = 0.35
"""Distance in m of what is nearer: the robot's own hands and feet."""
_SHIRT_PLACE: Final = 0.12, 0.2, 0.5
"""Half the width in m of what may be a shirt, and its heights above the floor."""
_SHIRT: Final = 0.04
"""Share of that which has its color."""


def find_robots(shot: Shot, looks: Looks, feet: Array, balls: Array) -> Iterator[Found]:
    """Yield robots where feet are, and no balls: x and y in m in the robot's frame, a row for each.

    What is behind the nearest of some feet is taken for its hands: they hide grass that is farther away.
    """
    for ball in balls:
        feet = feet[np.hypot(*(feet - ball).T) > _BALL]
    ways = feet - shot.eye[:2]
    away, turns = np.hypot(*ways.T), np.arctan2(ways[:, 1], ways[:, 0])
    left = away > _NEAREST
    while left.any():
        nearest = int(np.where(left, away, np.inf).argmin())
        own = left & (np.hypot(*(feet - feet[nearest]).T) < _APART)
        aside = np.abs(np.remainder(turns - np.median(turns[own]) + np.pi, 2.0 * np.pi) - np.pi)
        left &= ~own & ((aside > _HANDS / away[nearest]) | (away < _FARTHER * away[nearest]))
        if np.count_nonzero(own) < _COLUMNS:
            continue
        way = np.median(ways[own], axis=0)
        x, y = (shot.eye[:2] + way * (1.0 + looks.robots.depth / np.hypot(*way))).tolist()
        base = np.array((x, y, 0.0))
        shirt = _shirt(shot, looks, base)
        thing = Thing("robot", shirt, 0.9 if shirt else 0.3, error=shot.error_on_floor(base))
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
