"""Arms and head in the walk: the swing of the arms, and the shift of the feet by the weight of both."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.body import Body
from naoserver_sim._motors import SetpointController
from naoserver_sim._walk.gait import FootOffset
from naoserver_sim.model import DeviceIndex

_SMOOTHING: Final = 0.3
"""Time constant in s with which the feet follow."""


class Trim:
    """Report the shift of the center of mass by arms and head, in the torso's frame."""

    def __init__(self, mj: mujoco.MjModel, data: mujoco.MjData, body: Body) -> None:
        self._data = data
        self._torso = mj.body(body.root.name).id
        upper = [
            link.name
            for link in body.links
            if link is not body.root and body.moved_by[link.name].name not in body.groups.legs
        ]
        self._bodies = np.array([mj.body(name).id for name in upper], dtype=np.intp)
        weights = mj.body_mass[self._bodies]
        self._shares = weights / float(mj.body_subtreemass[self._torso])
        self._share = float(self._shares.sum())
        self._mj, self._posture = mj, body.resting_angles
        self._x, self._y = 0.0, 0.0

    @property
    def shift(self) -> tuple[float, float]:
        """Displacement forwards and to the left of its usual place in m, smoothed."""
        return self._x, self._y

    def begin(self) -> None:
        """Begin with the present positions of arms and head."""
        self.tick(_SMOOTHING)

    def tick(self, seconds: float) -> None:
        """Advance by some seconds to the present positions of arms and head."""
        x, y = self._measure(self._data)
        part = min(seconds / _SMOOTHING, 1.0)
        self._x += (x - self._usual[0] - self._x) * part
        self._y += (y - self._usual[1] - self._y) * part

    def _measure(self, data: mujoco.MjData) -> tuple[float, float]:
        """Return the contribution of arms and head to the center of mass along the torso's x and y axes."""
        center = self._shares @ data.xipos[self._bodies] - self._share * data.xpos[self._torso]
        axes = data.xmat[self._torso]
        return float(center @ axes[0::3]), float(center @ axes[1::3])

    @cached_property
    def _usual(self) -> tuple[float, float]:
        data = mujoco.MjData(self._mj)
        for name, angle in self._posture.items():
            data.joint(name).qpos[0] = angle
        mujoco.mj_kinematics(self._mj, data)
        return self._measure(data)


_HANGING: Final = 1.4
"""Tilt in rad of the shoulder of an arm that hangs down."""
_ABOUT: Final = 0.5
"""Distance in rad from it up to which an arm counts as hanging."""
_SWING: Final = 3.0
"""Radians of a shoulder per metre of the foot on the same side."""
_PARTS: Final = ("Shoulder", "Elbow", "Wrist")
"""The hinges of an arm that hangs, without its hand."""


class ArmSwing:
    """Swing the arms that hang when the walk begins, each until one of its joints is commanded."""

    def __init__(self, body: Body, robot: DeviceIndex, setpoints: SetpointController) -> None:
        motors = dict(zip(body.joint_names, robot.motors, strict=True))
        hinges = ([body.hinge(f"{side}{part}") for part in _PARTS] for side in ("Left", "Right"))
        self._setpoints = setpoints
        # The motors of each arm, left and right; the shoulder's tilt, which swings, comes first.
        self._motors: NDArray[np.intp] = np.array(
            [[motors[joint] for hinge in arm if hinge for joint in hinge.joints] for arm in hinges],
            dtype=np.intp,
        )
        self.begin()

    def begin(self) -> None:
        """Swing the hanging arms from now on."""
        self._begun = self._commands()
        self._rests = self._setpoints.setpoints[self._motors[:, 0]]
        self._swinging = np.abs(self._rests - _HANGING) <= _ABOUT

    def tick(self, feet: Sequence[FootOffset], out: NDArray[np.float64]) -> None:
        """Fill the setpoints of the shoulders in `out`, according to the left and the right foot."""
        self._swinging &= self._commands() == self._begun
        # An arm that swings forwards pitches up, which is negative: back when its foot is ahead.
        angles = self._rests + [_SWING * foot.x for foot in feet]
        self._setpoints.place(self._motors[self._swinging, 0], angles[self._swinging], out)

    def _commands(self) -> NDArray[np.int64]:
        """Return the numbers of commands to the joints of each arm."""
        counted: NDArray[np.int64] = self._setpoints.commands[self._motors].sum(axis=1)
        return counted
