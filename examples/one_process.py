"""Simulate a Nao in this process, without servers and as fast as the processor goes.

It walks a square and prints its estimated and its true place: `python examples/one_process.py`.
"""

from __future__ import annotations

import math
import sys
import time

from naoserver.bodies.capabilities import WalkVelocity

try:
    from naoserver_sim.robot import SimulatedRobot
except ModuleNotFoundError as error:
    sys.exit(f"{error.name} is not installed; type: pip install 'visualhfsm[sim]'")
from zenoh_ice import VirtualClock

SPEED = 0.2  # m/s
TURN = 0.6  # rad/s
SIDE = 0.5  # m
PERIOD = 0.02  # s


def main() -> None:
    """Walk each side of the square and turn by a quarter to the left."""
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, noise=True, seed=1)
    walker = robot.walker
    assert walker is not None  # as other robots may have none
    began = time.perf_counter()
    for side in range(4):
        for velocity, seconds in (
            (WalkVelocity(forward=SPEED), SIDE / SPEED),
            (WalkVelocity(turn=TURN), math.pi / 2 / TURN),
        ):
            walker.command(velocity)
            until = clock.now() + seconds
            while clock.now() < until:  # here a controller of your own reads and commands
                clock.advance(PERIOD)
                if robot.state().fallen:
                    sys.exit("it fell")
        odometry, truth = walker.odometry(), robot.stage.truth().torso.position
        believed = f"({odometry.x:+.2f}, {odometry.y:+.2f}) m"
        print(f"side {side + 1}: believes to be at {believed}, is at ({truth[0]:+.2f}, {truth[1]:+.2f}) m")
    robot.close()
    wall = time.perf_counter() - began
    print(f"{clock.now():.0f} s of robot time in {wall:.1f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
