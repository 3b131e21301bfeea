"""What the walk feels: how the torso turns and tilts, and what the soles carry."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import mujoco
import numpy as np

from naoserver_sim.body import TORSO, sole
from naoserver_sim.walk.odometry import Attitude

__all__ = ["Feel", "Feeling", "exact"]


@dataclass(frozen=True, slots=True)
class Feeling:
    """What is felt at a tick."""

    attitude: Attitude = field(default_factory=Attitude)
    loads: tuple[float, float] = (0.0, 0.0)
    """Of the left and of the right sole in N."""


Feel = Callable[[], Feeling]
"""Tell what is felt now; belongs to the thread of the physics."""


def exact(mj: mujoco.MjModel, data: mujoco.MjData) -> Feel:
    """Return what feels without noise or delay."""
    torso = mj.body(TORSO).id
    turning = slice(mj.joint("base").dofadr[0] + 3, mj.joint("base").dofadr[0] + 6)
    soles = [mj.geom(sole(side)).id for side in ("left", "right")]
    force = np.zeros(6)

    def feel() -> Feeling:
        loads = [0.0, 0.0]
        for index in range(data.ncon):
            touching = data.contact[index].geom
            for foot, geom in enumerate(soles):
                if geom in touching:
                    mujoco.mj_contactForce(mj, data, index, force)
                    loads[foot] += float(force[0])
        axes = data.xmat[torso]
        x, y, z = data.qvel[turning].tolist()
        roll, pitch = math.atan2(axes[7], axes[8]), -math.asin(max(-1.0, min(1.0, axes[6])))
        return Feeling(Attitude((x, y, z), roll, pitch), (loads[0], loads[1]))

    return feel
