"""Masses and inertias of a user's model as bodies can have them: MuJoCo refuses others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.errors import RobotError

Array = NDArray[np.float64]

LEAST_MASS: Final = 0.01
"""Mass in kg of a link that moves and of which nothing says a mass."""
_DENSITY: Final = 1000.0
"""Density in kg/m3 of the ball whose inertia a link without one has."""
_FRAME: Final = 1e-3
"""Mass in kg up to which a fixed link without inertia is a mere frame."""
_LITTLE: Final = 0.02
"""Share of its largest moment by which an inertia may be off without being named by itself."""
_ROUNDING: Final = 1e-6
"""Share of the largest moment up to which an inertia is that of a rod or a plate, but for rounding."""
_LEAST: Final = 1e-14
"""MuJoCo's smallest mass in kg and moment of inertia in kg m2, with a reserve."""
_NAMED: Final = 6
"""Links that a note names."""


def balance_inertias(
    spec: mujoco.MjSpec, at: Callable[[mujoco.MjsBody], str], balance: bool | None, *, free: bool
) -> Iterator[str]:
    """Repair masses and inertias that no body can have, and yield notes on it; `at` returns a body's place.

    With `free`, the root moves, too. Raises RobotError for a mass below 0, and with `balance` False for
    inertias that no body can have.
    """
    little, light = [], []
    for body in spec.bodies[1:]:
        if body.mass < 0.0:
            raise RobotError(f"{at(body)}: the mass of {body.name!r} is {body.mass:g}: write 0 or more")
        moves = len(body.joints) > 0 or (free and body.parent.name == "world")
        if moves and not _has_mass(body):
            light.append(body.name)
            bound(body, moves=moves)
        if not body.explicitinertial or body.mass < _LEAST:
            continue
        tensor = _tensor(body)
        moments = np.linalg.eigvalsh(tensor)
        if moments[2] < _LEAST:
            light.append(body.name)
            bound(body, moves=moves)
            continue
        off = (moments[2] - moments[0] - moments[1]) / (2.0 * moments[2])
        if off < -_ROUNDING and moments[0] >= _LEAST:
            continue
        if abs(off) <= _ROUNDING:
            _set_tensor(body, _repaired(tensor))
            continue
        shown = ", ".join(f"{moment:.4g}" for moment in moments)
        what = f"{at(body)}: the inertia of {body.name!r} has the moments {shown}, which no body has"
        if balance is False:
            raise RobotError(f"{what}: correct it, or write balance = true")
        _set_tensor(body, _repaired(tensor))
        if off > _LITTLE and balance is None:
            changed = ", ".join(f"{moment:.4g}" for moment in np.linalg.eigvalsh(_tensor(body)))
            yield f"{what}: {changed} is taken (balance = true says that this is right)"
        else:
            little.append(body.name)
    if little:
        yield f"the inertias of {_listed(little)} are repaired: their moments are those of no body"
    if light:
        ball = f"taken as a ball, of {LEAST_MASS:g} kg where they move"
        yield f"{_listed(light)} without mass or inertia: {ball}"


def bound(body: mujoco.MjsBody, *, moves: bool) -> None:
    """Give a body the inertia of a ball, and if it moves, the least mass; nothing to a frame without mass."""
    given = body.mass if body.explicitinertial else 0.0
    body.mass = max(given, LEAST_MASS) if moves else given if given > _FRAME else 0.0
    radius = (3.0 * body.mass / (4.0 * np.pi * _DENSITY)) ** (1.0 / 3.0)
    if not body.explicitinertial:
        body.ipos = np.zeros(3)
    body.explicitinertial = True
    _set_tensor(body, np.eye(3) * 0.4 * body.mass * radius**2)


def _has_mass(body: mujoco.MjsBody) -> bool:
    """Return whether a body has a mass, or one that is fixed to it."""
    fixed = [body]
    for each in fixed:  # grows meanwhile
        weights = [geom.mass if np.isfinite(geom.mass) else geom.density for geom in each.geoms]
        if each.mass >= _LEAST if each.explicitinertial else any(weight > 0.0 for weight in weights):
            return True
        fixed += [child for child in each.bodies if not child.joints]
    return False


def _tensor(body: mujoco.MjsBody) -> Array:
    """Return the inertia of a body about its center of mass, in the frame that it is given in."""
    if np.isfinite(body.fullinertia[0]):
        xx, yy, zz, xy, xz, yz = body.fullinertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.diag(body.inertia)


def _set_tensor(body: mujoco.MjsBody, tensor: Array) -> None:
    if np.isfinite(body.fullinertia[0]):
        body.fullinertia = np.array([*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]])
    else:
        body.inertia = np.diag(tensor)


def _repaired(tensor: Array) -> Array:
    """Return the inertia nearest to one that no body has: mass has no negative extent along any axis."""
    moments, axes = np.linalg.eigh(tensor)
    extents = moments.sum() / 2.0 - moments
    # More than 0, as MuJoCo compares without a tolerance.
    extents = np.maximum(extents, _ROUNDING * np.abs(moments).max())
    repaired: Array = (axes * (extents.sum() - extents)) @ axes.T
    return repaired


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(map(repr, names[:_NAMED])) + more
