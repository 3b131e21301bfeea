"""What the body's sensors say about it: its center of mass, how that moves, and where the feet are.

A foot that bears load rests on the floor. From there the angles of the joints and the attitude of the trunk
lead to every other point, and the speeds of the joints and the turning rate to its velocity. No force is
measured.

Legs that swing, and a trunk that turns, move the center of mass to and fro. What the floor changes is the
body's angular momentum about it. So the velocity is that of a pendulum with this momentum (Gong and Grizzle,
ASME J. Dyn. Sys., Meas., Control 144, 2022). The frame is that of the odometer: the floor, with the robot's
start at 0, x forward, y left. Places on the floor are complex numbers, x + iy, in m.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from typing import Final

import mujoco
import numpy as np

from naoserver.bodies.capabilities import InertialReading
from naoserver.bodies.footsteps import GRAVITY, Footsteps
from naoserver_sim._footsteps.limbs import LEFT, RIGHT, Array, Limbs, quaternion
from naoserver_sim._locomotion import STANDING_TICKS, STILL_RATE, yaw_rate
from naoserver_sim._senses.record import encoded
from naoserver_sim._simulator import Simulator


class BodySensors:
    """Read the joints as they were when the inertial unit measured what it reports now.

    Readings of different moments contradict each other: a step shakes the trunk by more than a radian per
    second. `delay` is that of the inertial unit in ticks. With `noise` angles are those of encoders. `tick`
    is due at the beginning of a control tick, when the joints are needed.
    """

    def __init__(
        self,
        simulator: Simulator,
        limbs: Limbs,
        inertial: Callable[[], InertialReading],
        *,
        noise: bool = False,
        delay: int = 0,
    ) -> None:
        self._simulator = simulator
        self._limbs = limbs
        self.inertial = inertial
        """Return the reading of the inertial unit."""
        self._noise = noise
        self.delay = delay
        """Of all readings, in ticks."""
        self.tick()

    def tick(self) -> None:
        """Read the joints.

        Angles and speeds, in rad and rad/s, are those of all joints of the body; torques, in N m, those of
        the motors of the legs, in the order of `Limbs.legs`.
        """
        simulator, limbs = self._simulator, self._limbs
        then = simulator.past(self.delay * simulator.tick_period)
        angles = then.measured[limbs.qpos]
        self.angles = encoded(angles) if self._noise else angles
        self.speeds = then.qvel[limbs.dofs]
        self.torques = then.forces[limbs.leg_motors]


FEET: Final = (LEFT, RIGHT)
_HALF_LIFE: Final = 0.01
"""Seconds in which half of the last velocity is replaced."""
_PULL: Final = 0.2
"""Part of its distance from the measured attitude that the integrated one makes up for in a tick."""
_LOST: Final = 0.1
"""Distance in rad from the measured attitude from which the integrated one is that at once."""
_LARGEST_MOUNTING: Final = 0.03
"""Largest error of roll and pitch in rad by the mounting of the inertial unit."""


class Estimator:
    """Estimate the state of the body at each control tick."""

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs, footsteps: Footsteps) -> None:
        self._mj = mj
        self._limbs = limbs
        self._frequency = footsteps.frequency
        self._lever = footsteps.com_height * float(mj.body_subtreemass[limbs.base])
        self.data: Final = mujoco.MjData(mj)
        """The measured body: its base rests at 0, turned and turning as it is measured."""
        self.data.qpos[limbs.base_qpos : limbs.base_qpos + 3] = 0.0
        self.origin: Final[Array] = np.zeros(3)
        """Place of the base in m."""
        self.places = [0j, 0j]
        """Where the middles of the soles are, left and right."""
        self.levers: Final[Array] = np.zeros((12, mj.nv))
        """The motion of the left sole by each degree of freedom, then of the right one: 6 rows each."""
        self._levers = [(self.levers[row : row + 3], self.levers[row + 3 : row + 6]) for row in (0, 6)]
        # Views of what is measured.
        self._qpos, self._qvel = self.data.qpos, self.data.qvel
        self._turned = self._qpos[limbs.base_qpos + 3 : limbs.base_qpos + 7]
        self._turning = self._qvel[limbs.base_dof + 3 : limbs.base_dof + 6]
        self._com, self._com_velocity = (
            self.data.subtree_com[limbs.base],
            self.data.subtree_linvel[limbs.base],
        )
        self._momentum = self.data.subtree_angmom[limbs.base]
        self._axes = [self.data.xmat[link] for link in limbs.feet]
        self._soles = [self.data.site_xpos[site] for site in limbs.middles]
        self.center = 0j
        """Place of the center of mass on the floor."""
        self.height = 0.0
        """Of the center of mass above the floor in m."""
        self.velocity = 0j
        """Velocity in m/s of a pendulum with the body's angular momentum about the floor, smoothed."""
        self.heading = 0.0
        """Of the base in rad, not limited to a turn."""
        self._anchors = [0j, 0j]
        self._velocity = 0j  # before it was looked ahead
        self._roll = self._pitch = math.nan  # of the base, as the unit measures them
        self._offset = 0.0  # of the turning rate about the vertical axis
        self._mounting = [0.0, 0.0]  # errors of roll and pitch
        self._still = 0  # ticks over which both are means
        self.turning = 0.0
        """Largest turning rate of the base about one of its axes in rad/s."""
        self._resting = False  # whether nothing turns

    @property
    def capture_point(self) -> complex:
        """The point on the floor over which the body would come to rest (Pratt et al., Humanoids 2006)."""
        return self.center + self.velocity / self._frequency

    def heading_of(self, foot: int) -> float:
        """Return the heading of a foot in rad, within half a turn of that of the base."""
        axes = self._axes[foot]
        heading = math.atan2(axes[3], axes[0])
        return self.heading + math.remainder(heading - self.heading, math.tau)

    def place_of(self, foot: int) -> complex:
        """Return where the middle of a sole is."""
        return self.places[foot]

    def plant(self, foot: int, place: complex) -> None:
        """Let a foot rest at a place from now on."""
        self._anchors[foot] = place

    def lose_footing(self) -> None:
        """Let the body rest as the next measurement shows it, its feet below where the base was."""
        self._anchors = [complex(math.nan), complex(math.nan)]
        self._roll = self._pitch = math.nan
        self._velocity = 0j

    def look_ahead(self, seconds: float, zmp: complex) -> None:
        """Move the center of mass on for some seconds, as a pendulum over the zero moment point."""
        acceleration = self._frequency**2 * (self.center - zmp)
        self.center += self.velocity * seconds + 0.5 * acceleration * seconds * seconds
        self.velocity += acceleration * seconds

    def turn(self, seconds: float, inertial: InertialReading, *, resting: bool = False) -> None:
        """Integrate the attitude for a control tick: roll and pitch are measured, too, but with more noise.

        A robot that is `resting` stands flat on its soles without stepping: if nothing turns, it learns the
        errors of the inertial unit.
        """
        about_x, about_y, about_z = inertial.angular_velocity
        sine, cosine = math.sin(inertial.roll), math.cos(inertial.roll)
        rate = yaw_rate(inertial)
        rolled = about_x + rate * math.sin(inertial.pitch)
        self._roll = _pulled(self._roll + rolled * seconds, inertial.roll)
        self._pitch = _pulled(self._pitch + (about_y * cosine - about_z * sine) * seconds, inertial.pitch)
        self.turning = max(abs(about_x), abs(about_y), abs(about_z))
        self._resting = resting and self.turning < STILL_RATE
        if self._resting:
            self._still = min(self._still + 1, STANDING_TICKS)
            self._offset += (rate - self._offset) / self._still
        self.heading += (rate - self._offset) * seconds

    def tick(
        self,
        seconds: float,
        inertial: InertialReading,
        angles: Array,
        speeds: Array,
        shares: Sequence[float],
        *,
        sliding: bool = False,
    ) -> None:
        """Advance by some seconds, at the end of which the sensors have these readings, after `turn`.

        `angles` in rad and `speeds` in rad/s are those of all joints of the body; `shares` are those of the
        left and the right foot in bearing it, 1 together. While feet may be `sliding`, moved by somebody,
        each comes to rest where it is, the sooner the less it bears.
        """
        self._put(inertial, angles, speeds)
        if self._resting:
            self._level(shares)
        for site, (moves, turns) in zip(self._limbs.middles, self._levers, strict=True):
            mujoco.mj_jacSite(self._mj, self.data, moves, turns, site)
        moved = np.dot(self.levers, self._qvel).tolist()  # how fast the soles move, as if the base rested
        drift = shares[LEFT] * complex(*moved[:2]) + shares[RIGHT] * complex(*moved[6:8])
        ahead, aside, above = self._stand_on(shares, sliding=sliding)
        x, y, z = self._com.tolist()
        self.center, self.height = complex(ahead + x, aside + y), above + z
        along_x, along_y, _ = self._com_velocity.tolist()
        about_x, about_y, _ = self._momentum.tolist()
        velocity = complex(along_x, along_y) + complex(about_y, -about_x) / self._lever - drift
        self._velocity = velocity + 0.5 ** (seconds / _HALF_LIFE) * (self._velocity - velocity)
        self.velocity = self._velocity

    def _put(self, inertial: InertialReading, angles: Array, speeds: Array) -> None:
        """Compute where all links are, relative to the base, and how they move."""
        mj, data, limbs = self._mj, self.data, self._limbs
        roll, pitch = self._roll - self._mounting[0], self._pitch - self._mounting[1]
        self._turned[:] = quaternion(self.heading, roll, pitch)
        self._qpos[limbs.qpos] = angles
        self._turning[:] = inertial.angular_velocity
        self._qvel[limbs.dofs] = speeds
        mujoco.mj_kinematics(mj, data)
        mujoco.mj_comPos(mj, data)
        mujoco.mj_comVel(mj, data)
        mujoco.mj_subtreeVel(mj, data)

    def _level(self, shares: Sequence[float]) -> None:
        """Learn by how much the unit is mounted askew: the soles that seem to be tilted are level."""
        left, right = (complex(*axes[2:6:3].tolist()) for axes in self._axes)
        seen = (shares[LEFT] * left + shares[RIGHT] * right) * cmath.rect(1.0, -self.heading)
        for axis, error in enumerate((-seen.imag, seen.real)):
            found = self._mounting[axis] + error / self._still
            self._mounting[axis] = max(-_LARGEST_MOUNTING, min(_LARGEST_MOUNTING, found))

    def _stand_on(self, shares: Sequence[float], *, sliding: bool) -> tuple[float, float, float]:
        """Move the base to where the bearing feet rest at their anchors; return its place in m."""
        left_x, left_y, left_z = self._soles[LEFT].tolist()
        right_x, right_y, right_z = self._soles[RIGHT].tolist()
        left, right = complex(left_x, left_y), complex(right_x, right_y)
        if cmath.isnan(self._anchors[LEFT]):
            here = complex(self.origin[0], self.origin[1])
            self._anchors = [here + left, here + right]
        place = shares[LEFT] * (self._anchors[LEFT] - left) + shares[RIGHT] * (self._anchors[RIGHT] - right)
        height = -shares[LEFT] * left_z - shares[RIGHT] * right_z
        self.origin[:] = origin = place.real, place.imag, height
        self.places = [place + left, place + right]
        if sliding:
            for foot in FEET:
                self._anchors[foot] += (1.0 - shares[foot]) * (self.places[foot] - self._anchors[foot])
        return origin


def _pulled(angle: float, measured: float) -> float:
    """Return an integrated angle, pulled to the measured one."""
    error = math.remainder(measured - angle, math.tau)
    return angle + _PULL * error if abs(error) < _LOST else measured


_SMOOTHING: Final = 0.2
"""Time constant in s: accelerations are not accounted for."""
_TRUST: Final = 0.02
"""Lever arm in m below which a torque says little about a force."""
_UP: Final = slice(2, None, 6)
"""The upward forces among the forces and moments of the floor on both feet."""


class Loads:
    """Estimate how much the left and the right foot bear, in N: the soles have no sensors.

    At rest, the torques of a leg's motors are those of the leg's weight and of the floor's force on its foot.
    A straight leg bears any load without a torque of its knee: where the torques say little, a foot counts as
    bearing half the weight.
    """

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs, estimator: Estimator) -> None:
        self._mj = mj
        self._limbs = limbs
        self._estimator = estimator
        self._damping = mj.dof_damping[limbs.leg_dofs]
        self.weight: Final = GRAVITY * float(mj.body_subtreemass[limbs.base])
        """Of the body in N."""
        self._bias = np.zeros(mj.nv)
        self._more = np.zeros(12)
        self._usual = np.zeros(12)
        self._usual[_UP] = 0.5 * self.weight
        self._trust = _TRUST**2 * np.eye(12)
        self.reset()

    def reset(self) -> None:
        """Begin with a robot that stands."""
        self.feet = np.full(2, 0.5 * self.weight)

    @property
    def shares(self) -> tuple[float, float]:
        """Parts of the load that the left and the right foot bear, 1 together."""
        left, right = (max(load, 1.0) for load in self.feet.tolist())
        return left / (left + right), right / (left + right)

    def tick(self, seconds: float, torques: Array) -> None:
        """Advance by some seconds, at the end of which the legs' motors give `torques` in N m.

        `torques` are in the order of `Limbs.legs`.
        """
        data, legs = self._estimator.data, self._limbs.leg_dofs
        mujoco.mj_rne(self._mj, data, 0, self._bias)
        lever = self._estimator.levers.take(legs, axis=1)  # a leg moves no other foot
        given = torques - self._damping * data.qvel[legs]
        unexplained = self._bias[legs] - given - self._usual @ lever
        matrix = lever @ lever.T + self._trust
        mujoco.mju_cholFactor(matrix, 0.0)
        mujoco.mju_cholSolve(self._more, matrix, lever @ unexplained)
        loads = np.maximum((self._usual + self._more)[_UP], 0.0)
        self.feet += (loads - self.feet) * min(seconds / _SMOOTHING, 1.0)
