"""The sensors of the body as the walk reads them: joints and inertial unit at the same moment."""

from __future__ import annotations

from collections.abc import Callable

from naoserver.capabilities import InertialReading
from naoserver_sim._footsteps.limbs import Limbs
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
        angles = then.qpos[limbs.qpos]
        self.angles = encoded(angles) if self._noise else angles
        self.speeds = then.qvel[limbs.dofs]
        self.torques = then.forces[limbs.leg_motors]
