"""The ways in which simulated robots move over the floor, by the kind of their body's walk."""

from __future__ import annotations

from typing import Protocol

from naoserver.body import Body
from naoserver.capabilities import Walker
from naoserver.errors import RobotError
from naoserver.footsteps import Footsteps
from naoserver.parts import Steps, Wheels
from naoserver_sim._footsteps.estimator import BodySensors
from naoserver_sim._footsteps.limbs import limbs_of
from naoserver_sim._footsteps.walker import FootstepWalker
from naoserver_sim._gears import gear_noise
from naoserver_sim._senses.record import SenseNoise, SensorRecord
from naoserver_sim._simulator import Simulator
from naoserver_sim._walk.walker import SimulatedWalker
from naoserver_sim._wheels import DifferentialDrive
from naoserver_sim.model import Model


class Way(Walker, Protocol):
    """A walk, or a drive, in the simulation."""

    def tick(self, seconds: float) -> None:
        """Set the setpoints of its motors for the next control tick; for the thread of the physics only."""

    def abandon(self, why: str = "the robot was moved") -> None:
        """End the motion at once: the robot fell, or was placed elsewhere; for that thread, too."""


def way_of(model: Model, simulator: Simulator, sensors: SensorRecord, *, noise: bool) -> Way | None:
    """Return the part that moves a robot over the floor; None for one that stays where it is."""
    match model.body.walk:
        case Steps():
            _require_limbs_of_nao(model.body)
            return SimulatedWalker(model, simulator, sensors, noise=noise)
        case Footsteps() as footsteps:
            return _walker(model, simulator, sensors, footsteps, noise=noise)
        case Wheels() as wheels:
            return DifferentialDrive(model, simulator, sensors, wheels)
        case None:
            return None


def _require_limbs_of_nao(body: Body) -> None:
    """Raise RobotError when a body lacks legs or arms that the walk of a Nao moves."""
    groups = body.groups
    shoulders = {"LeftShoulder", "RightShoulder"}
    if (len(groups.left_leg), len(groups.right_leg)) != (6, 6) or not shoulders <= body.hinges.keys():
        raise RobotError("walk: steps are for the legs and arms of a Nao; use footsteps for other bodies")


def _walker(
    model: Model, simulator: Simulator, sensors: SensorRecord, footsteps: Footsteps, *, noise: bool
) -> FootstepWalker:
    limbs = limbs_of(simulator.mj, model.body)
    delay = SenseNoise().delay if noise else 0
    return FootstepWalker(
        footsteps,
        limbs,
        simulator,
        BodySensors(simulator, limbs, lambda: sensors.newest.inertial, noise=noise, delay=delay),
        joints=model.body.groups.legs,
        latency=gear_noise(model.body).delay * simulator.tick_period if noise else 0.0,
    )
