"""The planned motion of the whole body: the pendulum moves its center of mass, the legs follow.

The pendulum stands over the zero moment point that the steps ask for. It is drawn to the measured body, so
that the plan is always near to what happens. The torques that the motion needs are computed, too.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from itertools import chain
from typing import Final

import mujoco
import numpy as np

from naoserver.bodies.footsteps import Footsteps
from naoserver_sim._footsteps.estimator import Estimator
from naoserver_sim._footsteps.limbs import LEFT, RIGHT, Array, Limbs, inclination, quaternion
from naoserver_sim._footsteps.posture import Posture, Target
from naoserver_sim._footsteps.steps import Steps

_TICK: Final = 0.01
"""Seconds of a control tick, for which `Footsteps.pull` is given, and in which half of the last speeds is
replaced."""
_PACE: Final = 0.15
"""Mean speed in m/s, and in rad/s, at which the body comes into its stance."""
_NEAR: Final = 0.005
"""Distance in m, and in rad, from the stance within which it need not come into it first."""


@dataclass(frozen=True, slots=True)
class _Bend:
    """How a body differs from its stance on flat soles: in m, and in roll and pitch in rad."""

    height: float
    soles: tuple[float, float]
    """Their heights."""
    turns: tuple[tuple[float, float], ...]
    """Of left foot, right foot and pelvis."""

    @property
    def largest(self) -> float:
        """The largest of all differences."""
        return max(map(abs, (self.height, *self.soles, *chain(*self.turns))))


class PlannedMotion:
    """Plan the angles of the legs at each control tick, and how all degrees of freedom move."""

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs, footsteps: Footsteps, estimator: Estimator) -> None:
        self._mj = mj
        self._limbs = limbs
        self._footsteps = footsteps
        self._estimator = estimator
        self._posture = Posture(mj, limbs)
        planned = [*range(limbs.base_dof, limbs.base_dof + 6), *limbs.leg_dofs]
        self._planned = np.zeros(mj.nv)  # the others move as they are commanded
        self._planned[planned] = 1.0
        self._center = 0j
        self._velocity = 0j
        self._bend = _Bend(0.0, (0.0, 0.0), 3 * ((0.0, 0.0),))
        self._return_time = 0.0
        self._time = 0.0
        self.speeds: Array = np.zeros(mj.nv)
        """Of all degrees of freedom in rad/s and m/s; 0 for what is not planned here."""
        self.accelerations: Array = np.zeros(mj.nv)
        """In rad/s2 and m/s2."""

    @property
    def returning(self) -> bool:
        """Whether the body is still on its way into the stance."""
        return self._time < self._return_time

    @property
    def legs(self) -> Array:
        """Angles of the legs in rad, in the order of `Limbs.legs`."""
        return self._posture.legs

    def begin(self, angles: Array) -> None:
        """Begin with all joints of the body at `angles` in rad, as they are commanded."""
        estimator, limbs, posture = self._estimator, self._limbs, self._posture
        posture.put(estimator.origin, estimator.data.qpos)
        posture.data.qpos[limbs.qpos] = angles
        posture.update()
        center = posture.data.subtree_com[limbs.base]
        self._center = complex(center[0], center[1])
        self._velocity = estimator.velocity
        left, right = limbs.soles(posture.data)[:, 2].tolist()
        self._bend = _Bend(
            center[2] - self._footsteps.com_height,
            (left, right),
            tuple(inclination(posture.axes(link)) for link in (*limbs.feet, limbs.pelvis)),
        )
        largest = self._bend.largest
        # The eased way is at its middle 1.5 times as fast as on average.
        self._return_time = largest / _PACE if largest > _NEAR else 0.0
        self._time = 0.0
        self.speeds = np.zeros(self._mj.nv)
        self.accelerations = np.zeros(self._mj.nv)

    def tick(self, seconds: float, steps: Steps, angles: Array, *, landed: bool) -> None:
        """Advance by some seconds; after a step that has just ended it has `landed`.

        `angles` are those at which all joints of the body are commanded to be; those of the legs do not
        count.
        """
        self._time += seconds
        self._fall(seconds, steps.zmp)
        self._posture.solve(self._target(steps), angles)
        speeds = self.speeds
        if not landed:  # the plan jumps to where the foot has really come down
            kept = 0.5 ** (seconds / _TICK)
            speeds = kept * speeds + ((1.0 - kept) / seconds) * self._planned * self._posture.moved
        self.accelerations = (speeds - self.speeds) / seconds
        self.speeds = speeds

    def _fall(self, seconds: float, zmp: complex) -> None:
        """Move the center of mass as a pendulum, and towards the measured one."""
        estimator, footsteps = self._estimator, self._footsteps
        acceleration = footsteps.frequency**2 * (self._center - zmp)
        self._center += self._velocity * seconds + 0.5 * acceleration * seconds * seconds
        self._velocity += acceleration * seconds
        pull = min(footsteps.pull * seconds / _TICK, 1.0)
        self._center += pull * (estimator.center - self._center)
        self._velocity += pull * (estimator.velocity - self._velocity)

    def _target(self, steps: Steps) -> Target:
        left, right = steps.feet
        bend, part, center = self._bend, self._left, self._center
        (of_left, of_right), turns = bend.soles, bend.turns
        return Target(
            (
                (left.place.real, left.place.imag, left.height + part * of_left),
                (right.place.real, right.place.imag, right.height + part * of_right),
                (center.real, center.imag, self._footsteps.com_height + part * bend.height),
            ),
            (
                quaternion(left.heading, part * turns[LEFT][0], part * turns[LEFT][1]),
                quaternion(right.heading, part * turns[RIGHT][0], part * turns[RIGHT][1]),
                quaternion(steps.heading, part * turns[2][0], part * turns[2][1]),
            ),
        )

    @property
    def _left(self) -> float:
        """The part of the bend that is left, which goes from 1 to 0 smoothly."""
        if not self.returning:
            return 0.0
        done = self._time / self._return_time
        return 1.0 - done * done * (3.0 - 2.0 * done)


_LARGEST_ACCELERATION: Final = 150.0
"""Largest planned acceleration in rad/s2 and m/s2 that counts."""
_LEAST_FORCE: Final = 50.0
"""Least force in N with which the body presses on the floor: it neither flies nor falls freely."""
_WITHIN_SOLE: Final = 0.8
"""Part of half a sole within which the center of pressure is to be."""
_LARGEST_TWIST: Final = 8.0
"""Largest moment in N m about the vertical axis with which a foot holds to the floor."""


class SupportTorques:
    """Compute the torques of the legs at each control tick: inverse dynamics, shared by the feet.

    A motor that holds an angle gives a torque only once the joint has left it. The weight of the body alone
    would bend the legs by degrees, so that the soles do not press where the balance needs it. The floor's
    force on the body follows from its equations of motion; each foot's part of it, turned into torques of
    that leg, is what the motors have to give.
    """

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs, footsteps: Footsteps, estimator: Estimator) -> None:
        self._mj = mj
        self._limbs = limbs
        self._estimator = estimator
        self._stiffness = footsteps.frequency**2 * float(mj.body_subtreemass[limbs.base])
        self._most_pressed = tuple(_WITHIN_SOLE * half for half in footsteps.sole_half)
        self._torques = np.zeros(mj.nv)
        # Arrays, because those are faster than numbers.
        self._shares = np.full(mj.nv, footsteps.acceleration_share)
        self._largest = np.full(mj.nv, _LARGEST_ACCELERATION)
        self._planned = np.zeros(mj.nv)
        self._from_floor = self._torques[limbs.base_dof : limbs.base_dof + 6]
        self._axes = estimator.data.xmat[limbs.base]

    def at(self, accelerations: Array, zmp: complex, heading: float, bearing: int | None) -> Array:
        """Return the torques in N m of the legs' joints, in the order of `Limbs.legs`.

        `accelerations` are the planned ones of all degrees of freedom; `zmp` is where the zero moment point
        has to be, `heading` that of the soles, `bearing` the foot that bears everything, None for both.
        """
        estimator, torques = self._estimator, self._torques
        planned, largest = self._planned, self._largest
        np.minimum(np.maximum(accelerations, -largest, out=planned), largest, out=planned)
        np.multiply(planned, self._shares, out=estimator.data.qacc)
        mujoco.mj_rne(self._mj, estimator.data, 1, torques)
        right = self._share_of_right(zmp, bearing)
        held = np.array(self._floor(right, zmp, heading))
        left_levers, right_levers = estimator.levers[:6], estimator.levers[6:]
        if bearing is not None:
            borne = np.dot(held, right_levers if bearing == RIGHT else left_levers)
        else:
            borne = np.dot((1.0 - right) * held, left_levers) + np.dot(right * held, right_levers)
        legs = self._limbs.leg_dofs
        found: Array = torques[legs] - borne[legs]
        return found

    def _share_of_right(self, zmp: complex, bearing: int | None) -> float:
        """Return the part of the weight that the right foot bears: by the place between them."""
        if bearing is not None:
            return float(bearing == RIGHT)
        left, right = self._estimator.places
        between = right - left
        share = ((zmp - left) * between.conjugate()).real / max(abs(between) ** 2, 1e-6)
        return min(max(share, 0.0), 1.0)

    def _floor(self, right: float, zmp: complex, heading: float) -> tuple[float, ...]:
        """Return the force in N with which the floor bears the body, and its moment about a sole in N m.

        The pendulum decides how hard the body is pushed, and with that where the soles are pressed: all at
        the same place from their middles.
        """
        estimator, soles = self._estimator, self._estimator.places
        x, y, z, own_x, own_y, own_z = self._from_floor.tolist()
        z = max(z, _LEAST_FORCE)
        xx, xy, xz, yx, yy, yz, zx, zy, zz = self._axes.tolist()
        about_x = xx * own_x + xy * own_y + xz * own_z
        about_y = yx * own_x + yy * own_y + yz * own_z
        about_z = zx * own_x + zy * own_y + zz * own_z
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
