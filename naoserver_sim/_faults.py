"""What fails in a simulated body: joints, motors, gears and encoders, a trunk that is held, a load.

Each failure acts where the real one would. A stuck joint is held by the constraint of its range, however
strong its motor is; a motor that is weak or limp has less torque, a hot one as its heat says
(`_motors.Motors`). A servo compares what its own encoder reports with its goal: where that is wrong, the
joint goes as far astray, and runs away while it is frozen.
"""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np

from naoserver.bodies.faults import ROBOT, Present
from naoserver.protocol.faults import Faults
from naoserver_sim._motors import Array
from naoserver_sim._simulator import Simulator
from naoserver_sim.model import Model

_FIRM: Final = (0.006, 1.0)
"""Time constant in s and damping ratio of what holds a stuck joint: MuJoCo's `solref`, above two steps."""
_HOLD: Final = 12.0
"""Frequency in rad/s of the hands that hold a trunk, critically damped; assumed."""


class FailingBody:
    """Let the body of a simulated robot fail. Implements `Failing`; for the thread of the physics only."""

    def __init__(
        self, model: Model, simulator: Simulator, faults: Faults, random: np.random.Generator
    ) -> None:
        self._model: Final = model
        self._whole: Final = model.whole
        self._simulator: Final = simulator
        self._faults: Final = faults
        self._random: Final = random
        self._known: Present = {}
        robot, motors = model.robot, model.mj.nu
        self._places: Final = {name: place for place, name in enumerate(model.body.joint_names)}
        self._leading: Final = robot.leading
        self._speeds: Final = np.full(motors, math.inf)
        self._speeds[robot.own_motors] = [robot.joints[place].max_velocity for place in robot.leading]
        self._slowest = np.full(motors, math.inf)
        self._gaps = np.zeros(motors)
        self._ctrl: Array | None = None  # of the last tick
        self._offsets = np.zeros(model.mj.nq)
        self._scatter = np.zeros(model.mj.nq)
        self._frozen: dict[int, float] = {}  # what encoders report, by the places of the joints
        self._locked: dict[int, tuple[Array, Array, int]] = {}  # what joints of the whole were before
        self._held: tuple[Array, Array] | None = None
        trunk = model.base.dof + (model.share.dofs.start or 0)
        self._trunk: Final = slice(trunk, trunk + 6)
        self._inertia: Final[Array] = model.mj.dof_M0[model.base.dof : model.base.dof + 6].copy()
        self._pushing: Final[Array] = simulator.physics.data.qfrc_applied[self._trunk]  # a view
        self._loads: dict[int, float] = {}  # by links of the whole

    def begin(self) -> bool:
        present = self._faults.current()
        if present is not self._known:
            self._change(present)
            self._known = present
        self._hold()
        return bool(present)

    def command(self, ctrl: Array, lengths: Array, seconds: float) -> None:
        robot, snapshot = self._model.robot, self._simulator.newest()
        if snapshot.measured is not snapshot.qpos:
            at, own = robot.qpos[self._leading], robot.own_motors
            ctrl[own] -= snapshot.measured[at] - snapshot.qpos[at]
        ctrl -= np.minimum(np.maximum(ctrl - lengths, -self._gaps), self._gaps)
        before = lengths if self._ctrl is None else self._ctrl
        reach = self._slowest * seconds
        slow = np.isfinite(reach)
        ctrl[slow] = np.minimum(np.maximum(ctrl, before - reach), before + reach)[slow]
        self._ctrl = ctrl.copy()

    def measure(self, qpos: Array, qvel: Array) -> tuple[Array, Array]:
        if not (self._frozen or self._offsets.any() or self._scatter.any()):
            return qpos, qvel
        robot, measured = self._model.robot, qpos + self._offsets
        if self._scatter.any():
            measured += self._scatter * self._random.standard_normal(len(measured))
        if self._frozen:
            places = [*self._frozen]
            measured[robot.qpos[places]] = [*self._frozen.values()]
            qvel = qvel.copy()
            qvel[robot.dofs[places]] = 0.0
        return measured, qvel

    def settle(self) -> None:
        """Stick and be held where the robot is now: it was placed there."""
        for joint in self._locked:
            self._lock(joint)
        if self._held is not None:
            self._held = self._pose()

    def _change(self, present: Present) -> None:
        """Let that fail which fails now, and heal the rest."""
        robot, motors = self._model.robot, self._model.mj.nu
        powers, hot = np.ones(motors), np.full(motors, np.nan)
        self._slowest, self._gaps = np.full(motors, math.inf), np.zeros(motors)
        self._ctrl = None
        self._offsets[:] = self._scatter[:] = 0.0
        frozen: dict[int, float] = {}
        stuck: set[int] = set()
        loads: dict[int, float] = {}
        now = self._simulator.newest().measured
        for (part, kind), fault in present.items():
            if kind == "loaded":
                loads[self._whole.body(self._model.share.prefix + part).id] = fault.amount
            if (place := self._places.get(part)) is None:
                continue
            motor, at = robot.motors[place], robot.qpos[place]
            match kind:
                case "stuck":
                    stuck.add(self._whole.joint(self._model.share.prefix + part).id)
                case "limp":
                    powers[motor] = 0.0
                case "weak":
                    powers[motor] *= fault.amount
                case "hot":
                    hot[motor] = fault.amount
                case "slow":
                    self._slowest[motor] = fault.amount * self._speeds[motor]
                case "backlash":
                    self._gaps[motor] = fault.amount / 2
                case "offset":
                    self._offsets[at] = fault.amount
                case "noisy":
                    self._scatter[at] = fault.amount
                case "frozen":
                    frozen[place] = self._frozen.get(place, float(now[at]))
        self._frozen = frozen
        self._simulator.motors.fail(powers, hot)
        for joint in stuck - self._locked.keys():
            mj = self._whole
            before = mj.jnt_range[joint].copy(), mj.jnt_solref[joint].copy(), int(mj.jnt_limited[joint])
            self._locked[joint] = before
            self._lock(joint)
        for joint in self._locked.keys() - stuck:
            mj = self._whole
            mj.jnt_range[joint], mj.jnt_solref[joint], mj.jnt_limited[joint] = self._locked.pop(joint)
        for link in self._loads.keys() | loads.keys():
            self._load(link, loads.get(link, 0.0) - self._loads.get(link, 0.0))
        self._loads = loads
        is_held = (ROBOT, "held") in present
        if is_held != (self._held is not None):
            self._held = self._pose() if is_held else None
            self._whole.dof_damping[self._trunk] = 2.0 * _HOLD * self._inertia if is_held else 0.0
            self._pushing[:] = 0.0

    # -- the physics of each ---------------------------------------------------------------------------

    def _lock(self, joint: int) -> None:
        """Leave a joint of the whole no range but where it is."""
        mj = self._whole
        mj.jnt_range[joint] = self._simulator.physics.data.qpos[mj.jnt_qposadr[joint]]
        mj.jnt_solref[joint] = _FIRM
        mj.jnt_limited[joint] = 1

    def _load(self, link: int, mass: float) -> None:
        """Add a mass in kg at the center of mass of a link of the whole."""
        mj = self._whole
        mj.body_mass[link] += mass
        while link > 0:
            mj.body_subtreemass[link] += mass
            link = int(mj.body_parentid[link])
        mj.body_subtreemass[0] += mass

    def _pose(self) -> tuple[Array, Array]:
        """Return position and quaternion of the trunk."""
        at, data = self._model.base.qpos, self._simulator.data
        return data.qpos[at : at + 3].copy(), data.qpos[at + 3 : at + 7].copy()

    def _hold(self) -> None:
        """Bear the trunk's weight, and push it to where it is held: MuJoCo damps that."""
        if self._held is None:
            return
        (place, turn), (held_at, held_turn) = self._pose(), self._held
        away = np.zeros(3)
        mujoco.mju_subQuat(away, held_turn, turn)
        self._pushing[:] = _HOLD**2 * self._inertia * (*(held_at - place), *away)
        self._pushing[:3] -= self._inertia[:3] * self._whole.opt.gravity
