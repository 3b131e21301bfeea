"""The digest of a simulation's trace: `python -m tests.support.simulation_trace SEED` prints it."""

from __future__ import annotations

import hashlib
import sys

from naoserver.capabilities import WalkVelocity
from naoserver_sim.robot import SimulatedRobot
from zenoh_ice import VirtualClock

__all__ = ["trace"]


def trace(seed: int, *, period: float = 0.1, seconds: float = 5.0) -> str:
    """Return the digest of all that a robot with noise measures while it walks, waves and is pushed.

    `period` is the step of the clock in s; measurements are recorded every 0.1 s.
    """
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, noise=True, seed=seed)
    digest = hashlib.sha256()
    speeds = {joint.name: joint.max_velocity for joint in robot.joints}
    for tenth in range(round(seconds / 0.1)):
        if tenth == 5:
            robot.walker.command(WalkVelocity(0.2, 0.05, 0.3))
        if tenth == 10:
            robot.stage.push((0.0, 10.0, 0.0), 0.1)
            robot.command_positions({"LShoulderPitch": 0.0, "HeadYaw": 0.7}, speeds)
        if tenth == 15:
            robot.stage.press("HeadFront", 1.0)
            robot.walker.command(WalkVelocity(0.25))
        if tenth == 40:
            robot.command_stiffnesses({"LShoulderPitch": 0.0}, 0.2)
            robot.walker.command(WalkVelocity())
        for _ in range(round(0.1 / period)):
            clock.advance(period)
            robot.state()
        senses = robot.senses.read()
        reported = (
            robot.read(),
            sorted(senses.touched),
            senses.inertial,
            senses.left_foot,
            senses.right_foot,
        )
        rest = (senses.sonar, senses.battery, robot.stage.truth(), robot.walker.odometry())
        digest.update(repr((reported, rest)).encode())  # of a float, all its digits
    robot.close()
    return digest.hexdigest()


if __name__ == "__main__":
    sys.stdout.write(trace(int(sys.argv[1])) + "\n")
