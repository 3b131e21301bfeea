"""The motors of the model: setpoints that move at limited speed, stiffness, gains, heat; and their gears."""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import JointCommand
from naoserver.bodies.parts import MotorHeat, Play
from naoserver_sim._share import ALONE, RobotData, Share

Array = NDArray[np.float64]


class SetpointController:
    """Move setpoints towards their targets, never faster than the speeds of the command and of the motor.

    For the thread of the physics only. Positions are in rad for a hinge and m for a slide, speeds in rad/s
    and m/s; motors are given by their indices.
    """

    def __init__(self, initial: Array, lower: Array, upper: Array, max_speeds: Array) -> None:
        self._lower = lower
        self._upper = upper
        self._max_speeds = max_speeds
        self.setpoints: Array = np.clip(initial, lower, upper)
        """The setpoints: an array that is replaced when they change, never modified."""
        self._targets = self.setpoints.copy()
        self._speeds = np.zeros_like(self.setpoints)
        self._moving = False
        self.commands = np.zeros(len(self.setpoints), dtype=np.int64)
        """Number of commands to each motor: an array that is replaced, never modified."""

    def move(self, motors: NDArray[np.intp], targets: Array, speeds: Array) -> None:
        """Move some setpoints to targets, or without end to infinite ones; a speed of 0 holds one."""
        self.count(motors)
        self._targets[motors] = np.clip(targets, self._lower[motors], self._upper[motors])
        self._speeds[motors] = np.minimum(speeds, self._max_speeds[motors])
        self._moving = True

    def count(self, motors: NDArray[np.intp]) -> None:
        """Count a command to some motors."""
        self.commands = self.commands.copy()
        self.commands[motors] += 1

    def place(self, motors: NDArray[np.intp], positions: Array, out: Array) -> None:
        """Set the setpoints of some motors to fixed positions at once; fill `out`."""
        positions = np.minimum(np.maximum(positions, self._lower[motors]), self._upper[motors])
        self.setpoints = self.setpoints.copy()
        self.setpoints[motors] = self._targets[motors] = positions
        out[:] = self.setpoints

    def tick(self, period: float, out: Array) -> None:
        """Move the setpoints for `period` s and fill `out`."""
        if not self._moving:
            return
        reach = self._speeds * period
        change = np.minimum(np.maximum(self._targets - self.setpoints, -reach), reach)
        self.setpoints = self.setpoints + change
        self._moving = bool(np.count_nonzero(change))
        out[:] = self.setpoints


AMBIENT: Final = 25.0
"""Temperature of the air, and of idle motors, in degrees Celsius."""
_TIME_CONSTANT: Final = 300.0
"""Seconds in which a motor gets 63 % nearer to the temperature that its torque leads to; assumed."""
_WARMING: Final = 0.1
"""Seconds over which torques are squared and added before the temperatures change: that takes minutes."""

_BRAKING: Final = 0.05
"""Seconds in which a motor that follows a command with gains could stop before the end of its range."""
_SPEED_BAND: Final = 0.2
"""Part of its highest speed in which such a motor loses its torque."""
_CALM: Final = 0.5
"""Part of a joint's momentum that such a motor may take in a step of the physics: with 2, it would swing."""


class Motors:
    """Stiffness and temperature of every motor of a robot; `tick` belongs to the thread of the physics.

    A motor's maximum torque and its gains are proportional to its stiffness, which in NAOqi limits the
    current. A motor warms by the square of its torque, as by the current in its winding: the continuous
    torque of its data sheet heats it to `heat.hot`, above which it gives less torque; without `heat`, motors
    stay as they are.

    A limp motor gives no torque, but its gear holds the joint where it stuck, as far as its friction goes:
    MuJoCo's own friction lets a load creep, so that a robot that rests in a crouch slowly falls.

    A motor follows a position with the gains of its gear, or a command that brings its own. It then gives no
    torque that would take its joint out of the command's range or beyond its speed: the torque decreases with
    the distance to the highest speed, as in a real motor, and this speed with that to the end of the range.
    """

    def __init__(
        self,
        mj: mujoco.MjModel,
        heat: MotorHeat | None = None,
        *,
        whole: mujoco.MjModel | None = None,
        share: Share = ALONE,
    ) -> None:
        """Control the motors of the robot `mj`: those of its `share` of the `whole` that is simulated."""
        self._heat = heat
        whole = whole or mj
        motors = share.motors
        self.gains: Final[Array] = whole.actuator_gainprm[motors]
        """What MuJoCo computes each motor's force with, as are the two below: they change with stiffness."""
        self.biases: Final[Array] = whole.actuator_biasprm[motors]
        self.ranges: Final[Array] = whole.actuator_forcerange[motors]
        self._gains = self.gains[:, 0].copy()
        self._biases = self.biases[:, 1:3].copy()
        self._forces = self.ranges.copy()
        self._heating = np.zeros(mj.nu)
        if heat is not None:
            self._heating += (heat.hot - AMBIENT) / np.maximum(mj.actuator_user[:, 0], 1e-9) ** 2
        self._squares = np.zeros(mj.nu)  # of the torques, added since the temperatures changed
        self._square = np.zeros(mj.nu)
        self._ticks = 0  # since then
        self._warmed = 0.0  # seconds since then
        self.stiffnesses: Array = np.ones(mj.nu)
        """From 0 to 1: an array that is replaced, never modified, as are the temperatures."""
        self.temperatures: Array = np.full(mj.nu, AMBIENT)
        self.limp: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        """The limp motors."""
        self._stuck = np.zeros(mj.nu, dtype=bool)  # those without torque that follow no commands with gains
        self._sticks = False  # whether there are any
        self._powers = np.ones(mj.nu)
        self._hot = np.full(mj.nu, np.nan)
        self.follows: NDArray[np.bool_] = np.zeros(mj.nu, dtype=bool)
        """True for each motor that follows commands with gains."""
        self.following: NDArray[np.intp] = self.limp
        """The motors that do."""
        self.loose: NDArray[np.intp] = self.limp
        """Both: the setpoints of these motors follow their joints."""
        self._followed = np.zeros((mj.nu, len(JointCommand._fields)))
        self.targets: Array = self._followed[:, 0]
        """Where the motors that do are to be."""
        self._most = self._forces[:, 1].copy()
        joints = mj.actuator_trnid[:, 0]
        self._qpos, self._dofs = mj.jnt_qposadr[joints], mj.jnt_dofadr[joints]
        self._frictions = whole.dof_frictionloss[share.dofs]
        self._friction = self._frictions[self._dofs]
        self._places = np.zeros(mj.nu)  # where limp gears stuck
        self._yielding = self._friction / np.maximum(self._gains, 1e-9)  # how far from there they slip
        self._calm = _CALM * mj.dof_M0[self._dofs] / mj.opt.timestep
        self._wanted = self.stiffnesses.copy()
        self._rates = np.zeros(mj.nu)
        self._changing = False
        self._derated = False

    def stiffen(self, motors: NDArray[np.intp], stiffnesses: Array, seconds: float) -> None:
        """Change some motors to stiffnesses within some seconds, from now on."""
        self._wanted[motors] = stiffnesses
        change = np.abs(self._wanted[motors] - self.stiffnesses[motors])
        self._rates[motors] = change / seconds if seconds > 0.0 else np.inf
        self._changing = True

    def follow(self, motors: NDArray[np.intp], commands: Array) -> None:
        """Let some motors follow commands with gains: a row of fields of `JointCommand` for each."""
        self._followed[motors] = commands
        _, velocities, torques, kp, kd = commands.T[:5]
        self.gains[motors, 0] = kp
        self.biases[motors, 0] = torques + kd * velocities
        self.biases[motors, 1], self.biases[motors, 2] = -kp, -kd
        if not self.follows[motors].all():
            self.follows[motors] = True
            self._sort()
            self._apply()

    def obey(self, motors: NDArray[np.intp]) -> None:
        """Let some motors follow their setpoints."""
        if self.follows[motors].any():
            self.follows[motors] = False
            self.biases[motors, 0] = 0.0
            self._sort()
            self._apply()

    def limit(self, data: RobotData) -> None:
        """Limit the torques of motors of `following` by range and speed, before each step of the physics."""
        if not (motors := self.following).size:
            return
        _, _, _, _, _, lower, upper, highest = self._followed[motors].T
        dofs, most = self._dofs[motors], self._most[motors]
        angles, speeds, loads = data.qpos[self._qpos[motors]], data.qvel[dofs], data.qfrc_bias[dofs]
        braking = np.minimum(most / (_SPEED_BAND * highest), self._calm[motors])
        for column, end in enumerate((lower, upper)):
            allowed = np.minimum(np.maximum((end - angles) / _BRAKING, -highest), highest)
            torques = np.minimum(np.maximum(loads + braking * (allowed - speeds), -most), most)
            self.ranges[motors, column] = torques

    def fail(self, powers: Array, hot: Array) -> None:
        """Let each motor give a share of its torque; keep some at a temperature, those that are not nan."""
        self._powers, self._hot = powers, hot
        self._burn()
        self._sort()
        self._apply()

    def _burn(self) -> None:
        self.temperatures = np.where(np.isnan(self._hot), self.temperatures, self._hot)

    def stick(self, lengths: Array, out: Array) -> None:
        """Fill `out` with where limp gears stuck, while the joints of all motors are at `lengths`."""
        if self._sticks:
            places, most = self._places, self._yielding
            np.clip(places, lengths - most, lengths + most, out=places)
            np.copyto(out, places, where=self._stuck)

    def torques(self, forces: Array) -> Array:
        """Return the torques of the motors in N m: their forces without the friction of limp gears."""
        return np.where(self._stuck, 0.0, forces)

    def _sort(self) -> None:
        self.following = np.flatnonzero(self.follows)
        limp = self.stiffnesses == 0.0
        self._stuck = (limp | (self._powers == 0.0)) & ~self.follows
        self._sticks = bool(self._stuck.any())
        self.limp = np.flatnonzero(limp)
        self.loose = np.union1d(self.following, self.limp)

    def cool(self) -> None:
        """Give every motor the temperature of the air."""
        self.temperatures = np.full_like(self.temperatures, AMBIENT)
        self._burn()

    def tick(self, seconds: float, torques: Array) -> None:
        """Advance by some seconds, during which the motors gave `torques` in N m."""
        if self._heat is not None:
            self._warm(seconds, torques, self._heat)
        if self._changing:
            reach = self._rates * seconds
            self.stiffnesses = self.stiffnesses + np.clip(self._wanted - self.stiffnesses, -reach, reach)
            self._changing = bool((self.stiffnesses != self._wanted).any())
            self._sort()
            self._apply()

    def _warm(self, seconds: float, torques: Array, heat: MotorHeat) -> None:
        np.multiply(torques, torques, out=self._square)
        self._squares += self._square
        self._ticks += 1
        self._warmed += seconds
        if self._warmed < _WARMING:
            return
        warmer = self._heating * self._squares * (self._warmed / self._ticks) + self._warmed * (
            AMBIENT - self.temperatures
        )
        self.temperatures = self.temperatures + warmer / _TIME_CONSTANT
        self._burn()
        self._squares[:] = self._warmed = self._ticks = 0
        if self._derated or np.count_nonzero(self.temperatures > heat.hot):
            self._apply()

    def _apply(self) -> None:
        cool = np.ones(len(self.temperatures))
        if (heat := self._heat) is not None:
            cool = np.clip((heat.too_hot - self.temperatures) / (heat.too_hot - heat.hot), 0.0, 1.0)
        self._derated = bool((cool < 1.0).any())
        obeying, stuck = ~self.follows, self._stuck
        strengths = np.where(stuck, 1.0, self.stiffnesses)
        self.gains[obeying, 0] = (self._gains * strengths)[obeying]
        self.biases[obeying, 1:3] = (self._biases * strengths[:, None])[obeying]
        self.ranges[:] = self._forces * (self.stiffnesses * cool * self._powers)[:, None]
        self.ranges[stuck] = np.outer(self._friction[stuck], (-1.0, 1.0))
        self._frictions[self._dofs] = np.where(stuck, 0.0, self._friction)
        self._most = self.ranges[:, 1].copy()


PLAY: Final = Play(delay=2, least_backlash=math.radians(0.5), most_backlash=math.radians(2.0))
"""The play of a body that names none: the gears of a Nao.

A joint moves 30 to 40 ms after the command. B-Human finds a request in the angles of a NAO 6 three cycles of
12 ms later, and expects the ankles of a good robot within 1.0 deg of the requested angles, its hips and knees
within 1.4 deg, the yielding of the motors included; it reports a joint that jumps by more than 5 deg as
damaged (`motionDelay` and others in `jointPlayProvider.cfg`, code release 2025).
"""


class Gears:
    """Bring commands to the motors, and let joints move freely within the backlash of their gears.

    A motor holds its own side of the gear where it is commanded to be. Within half the backlash on either
    side of that it exerts no force on the joint, so that a load leans the joint against one side, and against
    the other when it reverses. The encoders of a Nao are behind the gears: they measure most of the backlash
    (docs.b-human.de, "Sensor Analysis"), so that readings of the joints show it, too.

    The forces are those of the position servos of MuJoCo towards a command that is moved by the slack, once
    in a control tick: no further degrees of freedom. The damping and friction of motor and gear act within
    the backlash, too, so that joints cross it more slowly than real ones. For the thread of the physics only.
    """

    def __init__(self, play: Play, commands: Array, joints: int, random: np.random.Generator) -> None:
        """Begin at rest at the `commands` of all motors, the first `joints` of which move the robot."""
        half = random.uniform(play.least_backlash, play.most_backlash, joints) / 2
        self._joints: Final = slice(joints)
        self._highest, self._lowest = half, -half
        self._slack = np.zeros(joints)
        # The newest commands on their way, oldest first.
        self._commands = deque((commands[:joints].copy() for _ in range(play.delay + 1)), play.delay + 1)

    @property
    def backlash(self) -> Array:
        """The backlash of each motor's gear in rad."""
        return self._highest - self._lowest

    def tick(self, commands: Array, positions: Array, out: Array) -> None:
        """Fill `out` with the commands of the servos, while the joints of all motors are at `positions`."""
        joints = self._joints
        self._commands.append(commands[joints].copy())
        arrived, slack = self._commands[0], self._slack
        np.subtract(arrived, positions[joints], out=slack)
        np.minimum(slack, self._highest, out=slack)
        np.maximum(slack, self._lowest, out=slack)
        out[:] = commands
        np.subtract(arrived, slack, out=out[joints])

    def settle(self, motors: NDArray[np.intp], positions: Array) -> None:
        """Let some motors have been commanded to be at `positions` all the time."""
        own = motors < len(self._slack)
        for commands in self._commands:
            commands[motors[own]] = positions[own]
