"""The balance of the simulated robot: its ankles keep the center of mass over the feet, tick by tick.

It is the ankle strategy of people who stand (Horak and Nashner, J. Neurophysiol. 55, 1986): where the center
of mass leaves the place that the setpoints give it, or moves, the carrying ankles turn the body back. That
place itself is shifted into the support polygon where a pose would fall even at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import Support
from naoserver.bodies.kinematics import rotation
from naoserver.bodies.parts import Axis
from naoserver.body import Body
from naoserver_sim._locomotion import FIRM, TILT
from naoserver_sim._senses.record import SensorRecord
from naoserver_sim._simulator import Simulator
from naoserver_sim._walk.walker import WEIGHT
from naoserver_sim.model import Model
from naoserver_sim.support_polygon import Array, convex_hull, nearest_within

_LEFT, _RIGHT = 0, 1
_BOTH: Final = (_LEFT, _RIGHT)
_GAIN: Final = 1.0
"""Lean in rad, times the height of the center of mass, for each m that it is away from its place."""
_DAMPING: Final = 0.25
"""The same for each m/s that it moves, in s."""
_MARGIN: Final = 0.012
"""Distance in m from the edges of the support polygon that it keeps."""
_LARGEST_CORRECTION: Final = 0.35
"""Largest correction of a joint in rad: 20 degrees."""
_FASTEST_CORRECTION: Final = 3.0
"""Highest speed of a correction in rad/s: half of that of an ankle."""
_LEAST_HEIGHT: Final = 0.15
"""Least height in m of the center of mass above the soles that counts."""
_SMOOTHING: Final = 0.06
"""Time constant in s with which loads are smoothed: feet bounce."""
_SMOOTHING_MOTION: Final = 0.7
"""Part of the last speed of the center of mass that is kept at each tick."""
_CARRIES: Final = 0.1
"""Least share of the load with which a foot carries the robot."""
_CHANGES: Final = 0.35
"""Share of the load below which a foot is no longer the reference, while both soles are level."""
_LEVEL: Final = 0.02
"""Difference in m of the heights of a sole's corners above the other sole up to which they are parallel."""
_STEP: Final = 0.01
"""Height in m of a sole above the other one up to which both stand on the floor."""


@dataclass(frozen=True, slots=True)
class _Figure:
    """Where the parts of the body are in the torso's frame, or in another one."""

    center: Array
    """The center of mass in m."""
    feet: tuple[Array, Array]
    """Places of the feet's frames in m, left and right."""
    axes: tuple[Array, Array]
    """Their rotations, shape (3, 3)."""

    def seen_from(self, foot: int, axes: Array) -> _Figure:
        """Return it in a frame at a foot, with given axes as columns."""
        origin = self.feet[foot]
        left, right = ((place - origin) @ axes for place in self.feet)
        turns = axes.T @ self.axes[_LEFT], axes.T @ self.axes[_RIGHT]
        return _Figure((self.center - origin) @ axes, (left, right), turns)

    def seen(self, points: Array, foot: int) -> Array:
        """Return points of a foot's frame in m, shape (n, 3)."""
        seen: Array = points @ self.axes[foot].T + self.feet[foot]
        return seen


def _upright(foot: Array, roll: float, pitch: float) -> Array:
    """Return the axes, in the torso's frame, of the upright frame that has the heading of a foot."""
    attitude = (rotation((0.0, 1.0, 0.0), pitch) @ rotation((1.0, 0.0, 0.0), roll))[:3, :3]
    forward = attitude @ foot[:, 0]
    heading = rotation((0.0, 0.0, 1.0), math.atan2(forward[1], forward[0]))[:3, :3]
    axes: Array = attitude.T @ heading
    return axes


def _correcting(body: Body, side: str) -> tuple[str, str, str]:
    """Return the joints of a leg that it corrects: the ankle's tilt and roll, and the hip's roll."""
    ankle, hip = body.hinges[f"{side}Ankle"], body.hinges[f"{side}Hip"]
    return ankle[Axis.TILT].joint, ankle[Axis.ROLL].joint, hip[Axis.ROLL].joint


class SimulatedBalancer:
    """Correct the legs' motors at each control tick, beside the setpoints, which stay as they are commanded.

    Implements `capabilities.Balancer`, whose methods may be called from any thread; `tick` and
    `abandon` are for the thread of the physics only. It uses what a robot can measure: angles, inertial unit
    and the loads of the feet. While it walks, lies, falls, sits, is
    limp or carried, the corrections go back to 0.
    """

    def __init__(
        self, model: Model, simulator: Simulator, sensors: SensorRecord, walking: Callable[[], bool]
    ) -> None:
        self._simulator = simulator
        self._sensors = sensors
        self._walking = walking
        self._mj = model.mj
        self._base = model.base
        self._joints = model.robot.qpos
        self._robot = model.robot
        self._scratch = mujoco.MjData(model.mj)
        upright = (1.0, 0.0, 0.0, 0.0)
        self._scratch.qpos[model.base.qpos : model.base.qpos + 7] = (0.0, 0.0, 0.0, *upright)
        body = model.body
        self._feet = [model.mj.body(sole.link).id for sole in body.soles]
        self._foot_height = body.soles[0].height
        # The corners of each sole in the frame of its foot in m.
        self._corners = [
            np.array([(x, y, -sole.height) for x, y in sole.outline], np.float64) for sole in body.soles
        ]
        motors = dict(zip(body.joint_names, model.robot.motors, strict=True))
        self._motors: NDArray[np.intp] = np.array(
            [motors[joint] for side in ("Left", "Right") for joint in _correcting(body, side)], dtype=np.intp
        )
        self._legs: NDArray[np.intp] = np.array(
            sorted({motors[joint] for joint in body.groups.legs}), dtype=np.intp
        )
        self._ranges = model.mj.actuator_ctrlrange[self._motors].T.copy()
        self._support: Support | None = None
        self.abandon()

    def command(self, support: Support | None) -> None:
        self._support = support

    def support(self) -> Support | None:
        return self._support

    def abandon(self) -> None:
        """Forget what was measured and chosen: the robot was placed elsewhere."""
        self._support = None
        self._corrections = np.zeros(len(self._motors))
        self._correcting = False
        self._loads = np.zeros(2)
        self._reference = _LEFT
        self._begin()

    def tick(self, seconds: float) -> None:
        """Advance the corrections, and add them to the motors' setpoints."""
        support = self._support
        if support is None and not self._correcting:
            return
        if support is None or self._hindered(seconds):
            self._begin()
            wanted = np.zeros(len(self._motors))
        else:
            wanted = self._wanted(support, seconds)
        reach = _FASTEST_CORRECTION * seconds
        self._corrections += np.clip(wanted - self._corrections, -reach, reach)
        self._correcting = bool(self._corrections.any())
        targets = self._simulator.setpoints.setpoints[self._motors] + self._corrections
        self._simulator.commands[self._motors] = np.clip(targets, *self._ranges)

    def _begin(self) -> None:
        self._arm: Array | None = None  # from the reference foot to the center of mass at the last tick
        self._motion = np.zeros(2)  # speed of the center of mass in m/s, smoothed

    def _hindered(self, seconds: float) -> bool:
        """Return whether it does not stand on its feet; and smooth the loads of the feet."""
        self._loads += (np.array(self._sensors.loads()) - self._loads) * min(seconds / _SMOOTHING, 1.0)
        inertial = self._sensors.newest.inertial
        return (
            self._walking()
            or max(abs(inertial.roll), abs(inertial.pitch)) > TILT
            or float(self._loads.sum()) < WEIGHT
            or float(self._simulator.motors.stiffnesses[self._legs].min()) < FIRM
        )

    def _wanted(self, support: Support, seconds: float) -> Array:
        """Return the corrections that bring the center of mass to its place."""
        qpos = self._simulator.data.qpos
        commanded = self._figure(self._robot.commanded(self._simulator.setpoints.setpoints, qpos))
        inertial = self._sensors.newest.inertial
        angles = self._simulator.newest().measured[self._joints]
        measured = self._figure(self._sensors.encoded(angles))
        reference, carrying = self._carrying(support, commanded)
        if reference != self._reference:
            self._reference = reference
            self._begin()
        upright = _upright(measured.axes[reference], inertial.roll, inertial.pitch)
        place = commanded.seen_from(reference, commanded.axes[reference]).center[:2]
        now = measured.seen_from(reference, upright)
        corners = self._corners[reference][:, :2]
        if len(carrying) > 1:
            corners = np.concatenate([corners, now.seen(self._corners[1 - reference], 1 - reference)[:, :2]])
        goal = nearest_within(convex_hull(corners), place, _MARGIN)
        center = now.center[:2]
        arm = measured.center - measured.feet[reference]
        if self._arm is not None:
            # The gyroscope measures a turn of the body better than two readings of its attitude do.
            speed = (arm - self._arm) / seconds + np.cross(inertial.angular_velocity, arm)
            self._motion += ((speed @ upright)[:2] - self._motion) * (1.0 - _SMOOTHING_MOTION)
        self._arm = arm
        height = max(float(now.center[2]) + self._foot_height, _LEAST_HEIGHT)
        shift = goal - place - _GAIN * (center - goal) - _DAMPING * self._motion
        forward, left = np.clip(shift / height, -_LARGEST_CORRECTION, _LARGEST_CORRECTION).tolist()
        wanted = np.zeros((2, 3))
        # On both feet, the hips keep the torso upright while it moves sideways.
        wanted[list(carrying)] = -forward, left, -left if len(carrying) > 1 else 0.0
        return wanted.ravel()

    def _carrying(self, support: Support, commanded: _Figure) -> tuple[int, tuple[int, ...]]:
        """Return the foot in whose frame it balances, and the feet that carry the robot."""
        if support is not Support.LEGS:
            foot = _LEFT if support is Support.LEFT else _RIGHT
            return foot, (foot,)
        left = float(self._loads[_LEFT] / self._loads.sum())
        right = commanded.seen_from(_LEFT, commanded.axes[_LEFT]).seen(self._corners[_RIGHT], _RIGHT)
        heights = right[:, 2] + self._foot_height
        lowest, highest = float(heights.min()), float(heights.max())
        if highest - lowest < _LEVEL and abs(lowest) < _STEP:
            share = (left, 1.0 - left)[self._reference]
            return (self._reference if share > _CHANGES else 1 - self._reference), _BOTH
        reference = _LEFT if left >= 0.5 else _RIGHT
        return reference, (_BOTH if min(left, 1.0 - left) > _CARRIES else (reference,))

    def _figure(self, angles: Array) -> _Figure:
        """Return where the feet and the center of mass are at angles of the joints in rad."""
        data = self._scratch
        data.qpos[self._joints] = angles
        mujoco.mj_kinematics(self._mj, data)
        mujoco.mj_comPos(self._mj, data)
        left, right = self._feet
        return _Figure(
            data.subtree_com[self._base.body].copy(),
            (data.xpos[left].copy(), data.xpos[right].copy()),
            (data.xmat[left].reshape(3, 3).copy(), data.xmat[right].reshape(3, 3).copy()),
        )
