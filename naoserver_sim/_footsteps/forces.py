"""The torques that a motion needs, ahead of the error of the angles: inverse dynamics, shared by the feet.

A motor that holds an angle gives a torque only once the joint has left it. The weight of the body alone would
bend the legs by degrees, so that the soles do not press where the balance needs it. The floor's force on the
body follows from its equations of motion; each foot's part of it, turned into torques of that leg, is what
the motors have to give.
"""

from __future__ import annotations

import cmath
from typing import Final

import mujoco
import numpy as np

from naoserver.footsteps import Footsteps
from naoserver_sim._footsteps.estimator import FEET, Estimator
from naoserver_sim._footsteps.limbs import LEFT, RIGHT, Array, Limbs

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
        self._most_pressed = tuple(_WITHIN_SOLE * half for half in footsteps.sole_half)
        self._torques = np.zeros(mj.nv)

    def at(self, accelerations: Array, zmp: complex, heading: float, bearing: int | None) -> Array:
        """Return the torques in N m of the legs' joints, in the order of `Limbs.legs`.

        `accelerations` are the planned ones of all degrees of freedom; `zmp` is where the zero moment point
        has to be, `heading` that of the soles, `bearing` the foot that bears everything, None for both.
        """
        estimator, torques = self._estimator, self._torques
        planned = np.minimum(np.maximum(accelerations, -_LARGEST_ACCELERATION), _LARGEST_ACCELERATION)
        np.multiply(planned, self._share, out=estimator.data.qacc)
        mujoco.mj_rne(self._mj, estimator.data, 1, torques)
        right = self._share_of_right(zmp, bearing)
        held = np.array(self._floor(right, zmp, heading))
        held = np.concatenate([(1.0 - right) * held, right * held])
        found: Array = (torques - held @ estimator.levers)[self._limbs.leg_dofs]
        return found

    def _share_of_right(self, zmp: complex, bearing: int | None) -> float:
        """Return the part of the weight that the right foot bears: by the place between them."""
        if bearing is not None:
            return float(bearing == RIGHT)
        left, right = (self._estimator.place_of(foot) for foot in FEET)
        between = right - left
        share = ((zmp - left) * between.conjugate()).real / max(abs(between) ** 2, 1e-6)
        return min(max(share, 0.0), 1.0)

    def _floor(self, right: float, zmp: complex, heading: float) -> tuple[float, ...]:
        """Return the force in N with which the floor bears the body, and its moment about a sole in N m.

        The pendulum decides how hard the body is pushed, and with that where the soles are pressed: all at
        the same place from their middles.
        """
        estimator, dof, base = self._estimator, self._limbs.base_dof, self._limbs.base
        x, y, z, *about_base = self._torques[dof : dof + 6].tolist()
        z = max(z, _LEAST_FORCE)
        about_x, about_y, about_z = (estimator.data.xmat[base].reshape(3, 3) @ about_base).tolist()
        soles = [estimator.place_of(foot) for foot in FEET]
        # The moment about the place between the soles on the floor.
        ahead, aside, above = estimator.origin.tolist()
        away = (1.0 - right) * soles[LEFT] + right * soles[RIGHT] - complex(ahead, aside)
        about_x += -away.imag * z - above * y
        about_y += above * x + away.real * z
        about_z += away.imag * x - away.real * y
        # What draws the plan to the measured body is no planned acceleration: it would cancel the answer to a
        # push.
        force = self._stiffness * (estimator.center - zmp)
        lacking = force - complex(x, y)
        pressed = (1j * complex(about_x, about_y) - estimator.height * lacking) / z
        pressed = self._within_sole(pressed * cmath.rect(1.0, -heading)) * cmath.rect(1.0, heading)
        twist = min(max(about_z, -_LARGEST_TWIST), _LARGEST_TWIST)
        twist += pressed.real * force.imag - pressed.imag * force.real
        return force.real, force.imag, z, pressed.imag * z, -pressed.real * z, twist

    def _within_sole(self, place: complex) -> complex:
        length, width = self._most_pressed
        return complex(min(max(place.real, -length), length), min(max(place.imag, -width), width))
