"""The walk of the simulated robot: begun and ended by commands, a part of every control tick."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple
from enum import Enum, auto
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.capabilities import Odometry, WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver_sim.model import Model
from naoserver_sim.senses.record import SensorRecord, encoded
from naoserver_sim.simulator import Simulator
from naoserver_sim.walk.controller import WalkController
from naoserver_sim.walk.kinematics import LEG_JOINTS, LEG_MOTORS, Legs
from naoserver_sim.walk.odometry import Odometer
from naoserver_sim.walk.upper_body import ArmSwing, Trim

__all__ = ["LIMITS", "SimulatedWalker"]

LIMITS: Final = WalkVelocity(forward=0.3, left=0.12, turn=0.9)
"""The highest velocity of each kind."""
_STILL: Final = WalkVelocity()
_SLOWEST: Final = 1e-3
"""Velocity in m/s and rad/s below which there is nothing to walk for."""

# What a commanded velocity is multiplied by: the feet follow late and slip, so that the robot walks a little
# slower than commanded. Measured by benchmarks/bench_walk.py.
_FORWARD_GAIN: Final = 1.16
_LEFT_GAIN: Final = 1.17
_TURN_GAIN: Final = 1.14

_PACE: Final = 1.0
"""Speed in rad/s at which the legs come from where they are into the stance of the walk."""
_CLOSE: Final = 0.01
"""Distance in rad from the stance at which there is nothing to come from."""
_SETTLING: Final = 0.3
"""Seconds for which it stands before the walk counts as ended."""
_TILT: Final = math.radians(50)
"""Tilt of the torso from which on it falls, and walks no more."""
_WEIGHT: Final = 25.0
"""Least load on the soles in N with which it stands on its feet: half its weight."""
_FIRM: Final = 0.5
"""Least stiffness of the legs with which it walks."""


class _Stage(Enum):
    RESTING = auto()
    RISING = auto()
    STEPPING = auto()
    SETTLING = auto()


class SimulatedWalker:
    """Walk by setting the setpoints of the legs, and of arms that hang, at each control tick.

    Implements `naoserver.capabilities.Walker`, whose methods may be called from any thread; `tick` and
    `abandon` belong to the thread of the physics. With `noise` the odometry has the angles of the legs as
    their encoders report them.
    """

    limits = LIMITS

    def __init__(
        self,
        model: Model,
        simulator: Simulator,
        sensors: SensorRecord,
        *,
        noise: bool = False,
    ) -> None:
        self._data = simulator.data
        self._setpoints = simulator.setpoints
        self._simulator = simulator
        self._sensors = sensors
        self._noise = noise
        names = [joint.name for joint in model.robot.joints]
        joints = [names.index(name) for name in LEG_JOINTS]
        motors = [names.index(name) for name in LEG_MOTORS]
        self._joints = model.robot.qpos[joints]
        self._motors: NDArray[np.intp] = model.robot.motors[motors]
        self._trim = Trim(model.mj, self._data, model.body)
        self._arms = ArmSwing(model.robot, self._setpoints)
        self._controller = WalkController()
        self._odometer = Odometer(Legs())
        self._stage = _Stage.RESTING
        self._time = 0.0  # since the stage began
        self._start = np.zeros(len(LEG_MOTORS))
        self._rising = 0.0
        self._newest = self._commanded = _STILL
        self._velocity = _STILL  # the commanded velocity
        self._inertial = sensors.newest.inertial
        self._loads = sensors.loads()

    def command(self, velocity: WalkVelocity) -> None:
        """Walk at a velocity until the next command; all 0 ends the walk on both feet.

        Raises InvalidCommand when it does not stand on its feet or its legs are limp.
        """
        if max(map(abs, astuple(velocity))) < _SLOWEST:
            velocity = _STILL
        snapshot = self._simulator.newest()
        if velocity != _STILL and not self.walking:
            hindrance = self._hindrance(snapshot.stiffnesses)
            if hindrance:
                raise InvalidCommand("walk", f"the robot cannot walk: {hindrance}")
        self._newest = self._commanded = velocity
        self._simulator.order(lambda: self._take(velocity))

    def commanded(self) -> WalkVelocity:
        """Return the newest command; all 0 once it has ended, also by a fall."""
        self._simulator.catch_up()
        return self._commanded

    @property
    def walking(self) -> bool:
        """Whether it moves the legs: from a command until it stands on both feet again."""
        self._simulator.catch_up()
        return self._commanded != _STILL or self._stage is not _Stage.RESTING

    def odometry(self) -> Odometry:
        """Return where the robot believes to be, by its joints and its inertial unit."""
        time = self._simulator.newest().time
        return Odometry(time, *self._odometer.pose)

    def tick(self, seconds: float) -> None:
        """Set the setpoints of legs and arms while it walks, and follow where it gets to."""
        sensors = self._sensors
        self._inertial = sensors.newest.inertial
        self._loads = sensors.loads()
        resting = self._stage is _Stage.RESTING
        joints: Sequence[float] = self._data.qpos[self._joints].tolist()
        if self._noise:
            joints = encoded(joints)
        self._odometer.tick(seconds, joints, self._inertial, self._loads, resting=resting)
        if resting and self._velocity == _STILL:
            return
        if self._hindrance(self._simulator.motors.stiffnesses):
            self.abandon()
            return
        self._trim.tick(seconds)
        if resting:
            self._rise()
        self._time += seconds
        if self._stage is _Stage.RISING:
            self._come_into_stance()
        else:
            self._step(seconds)

    def abandon(self) -> None:
        """End the walk at once, the legs where they are: it fell, or was put elsewhere."""
        self._controller.reset()
        self._odometer.lose_footing()
        self._commanded = self._velocity = _STILL
        self._enter(_Stage.RESTING)

    def _take(self, velocity: WalkVelocity) -> None:
        if velocity is self._newest:
            self._commanded = velocity  # also when a walk was ended since it was commanded
        self._velocity = WalkVelocity(
            velocity.forward * _FORWARD_GAIN, velocity.left * _LEFT_GAIN, velocity.turn * _TURN_GAIN
        )

    def _hindrance(self, stiffnesses: NDArray[np.float64]) -> str:
        """Return why it cannot walk; empty when it can."""
        if max(abs(self._inertial.roll), abs(self._inertial.pitch)) > _TILT:
            return "it lies, or it falls; make it stand up first"
        if self._stage is _Stage.RESTING and sum(self._loads) < _WEIGHT:
            return "it does not stand on its feet"
        if stiffnesses[self._motors].min() < _FIRM:
            return f"its legs are limp; make them stiff, {_FIRM:g} at least"
        return ""

    def _enter(self, stage: _Stage) -> None:
        self._stage = stage
        self._time = 0.0

    def _rise(self) -> None:
        self._start = self._setpoints.setpoints[self._motors]
        self._trim.begin()
        distance = float(np.abs(self._stance() - self._start).max())
        self._rising = distance / _PACE if distance > _CLOSE else 0.0
        self._controller.reset()
        self._arms.begin()
        self._enter(_Stage.RISING)

    def _come_into_stance(self) -> None:
        done = min(self._time / self._rising, 1.0) if self._rising else 1.0
        eased = done * done * (3.0 - 2.0 * done)
        self._place(self._start + (self._stance() - self._start) * eased)
        if done == 1.0:
            self._enter(_Stage.STEPPING)

    def _stance(self) -> NDArray[np.float64]:
        return np.array(self._controller.stance(self._trim.shift))

    def _step(self, seconds: float) -> None:
        controller = self._controller
        turning, shift = self._inertial.angular_velocity, self._trim.shift
        angles = controller.tick(seconds, self._velocity, turning, self._loads, shift)
        self._place(np.array(angles))
        self._arms.tick(controller.gait.feet, self._data.ctrl)
        if controller.gait.walking:
            self._stage = _Stage.STEPPING
        elif self._stage is _Stage.STEPPING:
            self._enter(_Stage.SETTLING)
        elif self._time >= _SETTLING:
            self._enter(_Stage.RESTING)

    def _place(self, angles: NDArray[np.float64]) -> None:
        self._setpoints.place(self._motors, angles, self._data.ctrl)
