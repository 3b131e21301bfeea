"""Servos of a user's robot: as its model says, else so stiff that joints hold and go where they are sent."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import mujoco
import numpy as np

from naoserver_sim._own.couplings import Pull
from naoserver_sim._own.figure import Figure

_GIVES: Final = {False: 0.1, True: 0.005}
"""Angle in rad, or way in m, by which a servo gives way at its largest torque, if nothing says it."""
_LIMP: Final = {False: 0.3, True: 0.05}
"""Angle in rad, or way in m, from which a servo that the model describes is too soft to hold its joint."""
_STRONGEST: Final = 20.0
"""Largest such torque, as a multiple of what gravity asks of it: more would only make light links tremble."""
_SPARE: Final = 2.0
"""What is added to it, in N m: grips and wheels need more than gravity asks."""
_SAGS: Final = {False: 0.01, True: 0.001}
"""Angle in rad, or way in m, by which the weight that a joint carries may bend such a servo."""
_BENDS: Final = 0.5
"""Share of that angle by which a leg's joint gives way at what it may need to stand."""
_FIRM: Final = 1.5
"""Stiffness of a leg's joint, as a multiple of that with which the robot would just not fall about it."""
_QUICKEST: Final = 150.0
"""Highest natural frequency of such a servo in rad/s: steps of the physics take 2.5 ms."""
_SLOWEST: Final = 10.0
"""Lowest such frequency."""
_LIGHTEST: Final = 1e-4
"""Least inertia in kg m2 that moves with a joint without a motor: with less, closed chains fly apart."""
_LARGEST_ROTOR: Final = 0.1
"""Largest inertia of a rotor in kg m2 that is added for it, if the model has none."""


def gear_of(
    figure: Figure, joint: int, pulls: Iterable[Pull], torque: float, *, mounted: bool
) -> dict[str, float]:
    """Return the gains of a joint's servo, or the bearings of a joint without a torque.

    They are those of a position servo among `pulls` that can hold the joint; else it neither sags nor swings.
    """
    mj, slides = figure.mj, figure.slides(joint)
    dof = int(mj.jnt_dofadr[joint])
    rotor = float(mj.dof_armature[dof])
    gear = {
        "friction_damping": float(np.ravel(mj.dof_damping[dof])[0]),
        "friction": float(mj.dof_frictionloss[dof]),
        "inertia": rotor,
    }
    held, free = (float(each[dof]) for each in figure.inertias)
    if not torque:
        if free < _LIGHTEST:
            gear["inertia"] = rotor + _LIGHTEST - free
            gear["friction_damping"] = max(gear["friction_damping"], _LIGHTEST * _SLOWEST)
        rest = float(mj.qpos_spring[mj.jnt_qposadr[joint]])
        return gear | {"stiffness": float(np.ravel(mj.jnt_stiffness[joint])[0]), "rest": rest}
    load, standing = figure.load(joint), figure.standing(joint, mounted=mounted)
    for motor, lever in pulls:
        affine = mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_AFFINE
        if affine and mj.actuator_biasprm[motor, 1] < 0.0:
            square = (lever * float(mj.actuator_gear[motor, 0])) ** 2
            stiffness, damping = (-square * mj.actuator_biasprm[motor, 1:3]).tolist()
            if max(load, standing) < _LIMP[slides] * stiffness:
                return gear | {"stiffness": stiffness, "damping": max(damping, 0.0)}
    stiffness = max(
        min(torque, _STRONGEST * max(load, standing) + _SPARE) / _GIVES[slides],
        load / _SAGS[slides],
        standing / (_BENDS * _GIVES[slides]),
        _FIRM * figure.tips(joint, mounted=mounted),
        _SLOWEST**2 * held,
    )
    wanted = stiffness / _QUICKEST**2 - free
    added = 0.0 if rotor else min(max(wanted, 0.0), _LARGEST_ROTOR)
    stiffness = min(stiffness, _QUICKEST**2 * (free + added))
    damping = 2.0 * math.sqrt(stiffness * (held + added))
    return gear | {"inertia": rotor + added, "stiffness": stiffness, "damping": damping}
