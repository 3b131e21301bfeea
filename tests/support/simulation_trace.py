"""The digests of simulations' traces: `python -m tests.support.simulation_trace SEED BODY...` prints them."""

from __future__ import annotations

import hashlib
import sys

from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.parts import Axis
from naoserver_sim.robot import SimulatedRobot
from tests.support.present import present
from zenoh_ice import VirtualClock

__all__ = ["trace"]


def trace(seed: int | None, name: str = DEFAULT_BODY, *, period: float = 0.1, seconds: float = 5.0) -> str:
    """Return the digest of all that a robot with noise measures while it walks, waves and is pushed.

    `name` is that of its body; `period` is the step of the clock in s; measurements are recorded every 0.1 s.
    """
    clock = VirtualClock()
    body = find_body(name)
    robot = SimulatedRobot(clock=clock, skin=False, noise=True, seed=seed, body=body)
    digest = hashlib.sha256()
    speeds = {joint.name: joint.max_velocity for joint in robot.joints}
    pan = present(body.neck).axes[Axis.PAN]
    raised = body.hinges.get("LeftShoulder", {}).get(Axis.TILT, pan)
    walker = present(robot.walker)
    for tenth in range(round(seconds / 0.1)):
        if tenth == 5:
            walker.command(WalkVelocity(0.2, min(0.05, walker.limits.left), 0.3))
        if tenth == 10:
            robot.stage.push((0.0, 10.0, 0.0), 0.1)
            goals = {raised.joint: raised.joint_angle(0.0), pan.joint: pan.joint_angle(0.7)}
            robot.command_positions(goals, speeds)
        if tenth == 15:
            for sensor in body.touch_sensors[:1]:
                robot.stage.press(sensor, 1.0)
            walker.command(WalkVelocity(0.25))
        if tenth == 40:
            robot.command_stiffnesses({raised.joint: 0.0}, 0.2)
            walker.command(STILL)
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
        rest = (senses.sonar, senses.battery, robot.stage.truth(), walker.odometry())
        digest.update(repr((reported, rest)).encode())  # of a float, all its digits
    robot.close()
    return digest.hexdigest()


if __name__ == "__main__":
    seed, *names = sys.argv[1:]
    for name in names:
        sys.stdout.write(f"{name} {trace(int(seed), name)}\n")
