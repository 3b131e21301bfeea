"""The torques that a motion needs, ahead of the error of the angles: inverse dynamics, shared by the feet.

A motor that holds an angle gives a torque only once the joint has left it. The weight of the body alone would
bend the legs by degrees, so that the soles do not press where the balance needs it. The floor's force on the
body follows from its equations of motion; each foot's part of it, turned into torques of that leg, is what
the motors have to give.
"""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from naoserver.footsteps import Footsteps
from naoserver_sim._footsteps.estimator import FEET, Estimator
from naoserver_sim._footsteps.limbs import LEFT, RIGHT, Array, Limbs
from naoserver_sim._footsteps.vectors import cross

_LARGEST_ACCELERATION: Final = 150.0
"""Largest planned acceleration in rad/s2 and m/s2 that counts."""
_LEAST_FORCE: Final = 50.0
"""Least force in N with which the body presses on the floor: it neither flies nor falls freely."""
_WITHIN_SOLE: Final = 0.8
"""Part of half a sole within which the center of pressure is to be."""
_LARGEST_TWIST: Final = 8.0
"""Largest moment in N m about the vertical axis with which a foot holds to the floor."""


class SupportTorques:
    """Compute the torques of the legs at each control tick."""

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs, footsteps: Footsteps, estimator: Estimator) -> None:
        self._mj = mj
        self._limbs = limbs
        self._estimator = estimator
        self._share = footsteps.acceleration_share
        self._stiffness = footsteps.frequency**2 * float(mj.body_subtreemass[limbs.base])
        self._most_pressed = _WITHIN_SOLE * np.array(footsteps.sole_half)
        self._legs = limbs.leg_dofs.reshape(2, -1)
        self._torques = np.zeros(mj.nv)
        self._linear = np.zeros((3, mj.nv))
        self._angular = np.zeros((3, mj.nv))

    def at(self, accelerations: Array, zmp: complex, heading: float, bearing: int | None) -> Array:
        """Return the torques in N m of the legs' joints, in the order of `Limbs.legs`.

        `accelerations` are the planned ones of all degrees of freedom; `zmp` is where the zero moment point
        has to be, `heading` that of the soles, `bearing` the foot that bears everything, None for both.
        """
        mj, data, torques = self._mj, self._estimator.data, self._torques
        np.clip(accelerations, -_LARGEST_ACCELERATION, _LARGEST_ACCELERATION, out=data.qacc)
        data.qacc *= self._share
        mujoco.mj_rne(mj, data, 1, torques)
        share = self._share_of_right(zmp, bearing)
        place = (1.0 - share) * self._estimator.soles[LEFT] + share * self._estimator.soles[RIGHT]
        place[2] = 0.0
        force, moment = self._floor(place)
        pressed = self._pressed(force, moment, zmp, heading)
        twist = np.array([0.0, 0.0, min(max(moment[2], -_LARGEST_TWIST), _LARGEST_TWIST)])
        found = torques[self._legs]
        for foot, part in zip(FEET, (1.0 - share, share), strict=True):
            if part > 0.0:
                found[foot] -= part * self._held(foot, pressed, force, twist)
        return found.ravel()

    def _share_of_right(self, zmp: complex, bearing: int | None) -> float:
        """Return the part of the weight that the right foot bears: by the place between them."""
        if bearing is not None:
            return float(bearing == RIGHT)
        left, right = (self._estimator.place_of(foot) for foot in FEET)
        between = right - left
        share = ((zmp - left) * between.conjugate()).real / max(abs(between) ** 2, 1e-6)
        return min(max(share, 0.0), 1.0)

    def _floor(self, place: Array) -> tuple[Array, Array]:
        """Return the force in N with which the floor bears the body, and its moment about a place in N m."""
        dof, base = self._limbs.base_dof, self._limbs.base
        force = self._torques[dof : dof + 3].copy()
        force[2] = max(force[2], _LEAST_FORCE)
        turned = self._estimator.data.xmat[base].reshape(3, 3)
        about_base = turned @ self._torques[dof + 3 : dof + 6]
        return force, about_base - cross(place - self._estimator.origin, force)

    def _pressed(self, force: Array, moment: Array, zmp: complex, heading: float) -> Array:
        """Return where a sole is pressed, from its middle; let the pendulum decide how hard it is pushed."""
        center = self._estimator.center
        # What draws the plan to the measured body is no planned acceleration: it would cancel the answer to a
        # push.
        lacking = self._stiffness * (center[:2] - (zmp.real, zmp.imag)) - force[:2]
        force[:2] += lacking
        pressed = np.array([-moment[1], moment[0]]) / force[2] - center[2] * lacking / force[2]
        cosine, sine = np.cos(heading), np.sin(heading)
        to_heading = np.array([[cosine, sine], [-sine, cosine]])
        within = np.clip(to_heading @ pressed, -self._most_pressed, self._most_pressed)
        return np.append(within @ to_heading, 0.0)

    def _held(self, foot: int, pressed: Array, force: Array, twist: Array) -> Array:
        """Return the torques of a leg whose foot is borne by a force at a place of its sole."""
        estimator = self._estimator
        place = estimator.soles[foot] - estimator.origin + pressed
        link = self._limbs.feet[foot]
        mujoco.mj_jac(self._mj, estimator.data, self._linear, self._angular, place, link)
        legs = self._legs[foot]
        torques: Array = force @ self._linear[:, legs] + twist @ self._angular[:, legs]
        return torques
