"""The drive of a simulated robot on two wheels."""

from __future__ import annotations

import math
from dataclasses import astuple
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import STILL, Odometry, WalkVelocity
from naoserver.bodies.parts import Wheels
from naoserver.errors import InvalidCommand
from naoserver_sim._locomotion import MOVED, TILT, Locomotion, limp
from naoserver_sim._senses.record import SensorRecord
from naoserver_sim._simulator import Simulator
from naoserver_sim.model import Model
from zenoh_ice.data.text import sentence

_LEAD: Final = 0.5
"""Angle in rad by which a wheel may be ahead of where it is: a blocked one does not wind up."""


class DifferentialDrive(Locomotion):
    """Drive by setting the setpoints of the wheels at each control tick, and count their turns."""

    def __init__(self, model: Model, simulator: Simulator, sensors: SensorRecord, wheels: Wheels) -> None:
        limits = WalkVelocity(wheels.fastest, 0.0, wheels.fastest_turn)
        super().__init__(simulator, (wheels.left, wheels.right), limits, does=sentence("drive"))
        body = model.body
        self._wheels = wheels
        self._sensors = sensors
        places = [body.joint_names.index(name) for name in self.joints]
        self._fastest_wheel = wheels.radius * min(body.joint[name].max_velocity for name in self.joints)
        self._qpos: NDArray[np.intp] = model.robot.qpos[places]
        self._motors: NDArray[np.intp] = model.robot.motors[places]
        self._speeds = (0.0, 0.0)  # of the robot: forwards in m/s, turn in rad/s
        self._turned = simulator.newest().measured[self._qpos]
        self._pose = (0.0, 0.0, 0.0)

    def command(self, velocity: WalkVelocity) -> None:
        if velocity.left:
            raise InvalidCommand("left", "the robot has wheels: it cannot drive sideways")
        super().command(velocity)

    @property
    def walking(self) -> bool:
        return self._commanded != STILL or any(self._speeds)

    def odometry(self) -> Odometry:
        return Odometry(self._simulator.newest().time, *self._pose)

    def tick(self, seconds: float) -> None:
        """Turn the wheels on, and update the odometry."""
        self._count()
        if self._velocity == STILL and not any(self._speeds):
            return
        if hindrance := self._hindrance(self._simulator.motors.stiffnesses):
            self.abandon(hindrance)
            return
        self._check_following(seconds, self._velocity, self._sensors.newest.inertial.tilt)
        forward, turn = self._speeds = self._ramped(seconds)
        wheels = self._wheels
        rates = np.array([forward - turn * wheels.distance / 2, forward + turn * wheels.distance / 2])
        setpoints = self._simulator.setpoints
        wanted = setpoints.setpoints[self._motors] + rates * (seconds / wheels.radius)
        wanted = np.clip(wanted, self._turned - _LEAD, self._turned + _LEAD)
        setpoints.place(self._motors, wanted, self._simulator.commands)

    def abandon(self, why: str = MOVED) -> None:
        """Stop at once: the robot toppled over, or was placed elsewhere."""
        self._end(why)
        self._speeds = (0.0, 0.0)
        self._turned = self._simulator.newest().measured[self._qpos]

    def _ramped(self, seconds: float) -> tuple[float, float]:
        """Return the speeds that follow the present ones on the way to the commanded ones."""
        wheels = self._wheels
        change = wheels.acceleration * seconds
        turn_change = 2 * change / wheels.distance
        present = self._speeds
        forward, _, turn = astuple(self._velocity)
        # A wheel that cannot turn as fast slows down both, so that the robot stays on its curve.
        outer = abs(forward) + abs(turn) * wheels.distance / 2
        if outer > self._fastest_wheel:
            forward, turn = forward * self._fastest_wheel / outer, turn * self._fastest_wheel / outer
        return (
            present[0] + min(max(forward - present[0], -change), change),
            present[1] + min(max(turn - present[1], -turn_change), turn_change),
        )

    def _count(self) -> None:
        """Add the turns of the wheels since the last tick to the odometry."""
        turned = self._simulator.newest().measured[self._qpos]
        left, right = (self._wheels.radius * (turned - self._turned)).tolist()
        self._turned = turned
        x, y, heading = self._pose
        turn = (right - left) / self._wheels.distance
        middle = heading + turn / 2
        way = (left + right) / 2
        heading = math.pi - (math.pi - heading - turn) % math.tau
        self._pose = (x + way * math.cos(middle), y + way * math.sin(middle), heading)

    def _hindrance(self, stiffnesses: NDArray[np.float64]) -> str:
        """Return why it cannot drive; empty when it can."""
        if self._sensors.newest.inertial.tilt > TILT:
            return sentence("it has toppled over; put it on its wheels first")
        return limp(stiffnesses[self._motors], sentence("its wheels are limp"))
