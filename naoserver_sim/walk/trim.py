"""Where the weight of arms and head is: the feet follow it, so that it walks with its arms stretched out."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from naoserver.body import H25, Body
from naoserver_sim.body import TORSO

__all__ = ["Trim"]

_SMOOTHING: Final = 0.3
"""Time constant in s with which the feet follow."""
_LEGS: Final = ("Hip", "Knee", "Ankle")


class Trim:
    """Tell by how much arms and head move the center of mass, in the torso's frame."""

    def __init__(self, mj: mujoco.MjModel, data: mujoco.MjData, body: Body = H25) -> None:
        self._data = data
        self._torso = mj.body(TORSO).id
        upper = [
            link.name
            for link in body.links
            if link.parent_joint is not None and not any(part in link.parent_joint for part in _LEGS)
        ]
        self._bodies = np.array([mj.body(name).id for name in upper], dtype=np.intp)
        weights = mj.body_mass[self._bodies]
        self._shares = weights / float(mj.body_subtreemass[self._torso])
        self._share = float(self._shares.sum())
        self._usual = self._measure_at_rest(mj, body)
        self._x, self._y = 0.0, 0.0

    @property
    def shift(self) -> tuple[float, float]:
        """How far forwards and to the left of where it usually is in m, smoothed."""
        return self._x, self._y

    def begin(self) -> None:
        """Begin with where arms and head are now."""
        self.tick(_SMOOTHING)

    def tick(self, seconds: float) -> None:
        """Go on for some seconds after which arms and head are where they are."""
        x, y = self._measure(self._data)
        part = min(seconds / _SMOOTHING, 1.0)
        self._x += (x - self._usual[0] - self._x) * part
        self._y += (y - self._usual[1] - self._y) * part

    def _measure(self, data: mujoco.MjData) -> tuple[float, float]:
        """Return what arms and head add to the center of mass along the torso's x and y axes."""
        center = self._shares @ data.xipos[self._bodies] - self._share * data.xpos[self._torso]
        axes = data.xmat[self._torso]
        return float(center @ axes[0::3]), float(center @ axes[1::3])

    def _measure_at_rest(self, mj: mujoco.MjModel, body: Body) -> tuple[float, float]:
        data = mujoco.MjData(mj)
        for name, angle in body.postures["STAND_INIT"].items():
            data.joint(name).qpos[0] = angle
        mujoco.mj_kinematics(mj, data)
        return self._measure(data)
