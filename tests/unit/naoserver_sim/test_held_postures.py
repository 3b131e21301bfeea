"""Each posture of each humanoid for a minute, stiff and limp, with noise, on a slope."""

import math

import pytest

from naoserver.bodies import find_body
from naoserver.bodies.parts import Stance
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.motion_rig import MotionRig
from tests.support.soak import cases
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

MINUTE = 60.0
SLOPE = 3.0  # degrees
SLOPES = {("G1", "StandInit"): 1.0}
"""A G1 that balances takes its soles for level: on a steeper slope behind it, it falls."""
BEAR_THEMSELVES = {
    "H25": {"Crouch", "Sit", "SitRelax", "LyingBelly", "LyingBack"},
    "T1": set(),
    "G1": set(),
}
"""Of each body the postures that it keeps limp; it sinks or falls out of all others."""


def rig_in(body, posture, direction, seed=1):
    """Return a robot in a posture, on a floor that goes down in a direction in degrees: gravity is turned."""
    clock = VirtualClock()
    start = posture if body.postures[posture].stance is Stance.STANDING else None
    world = load_world("empty")
    robot = SimulatedRobot(
        clock=clock, body=body, posture=start, world=world, skin=False, noise=True, seed=seed
    )
    rig = MotionRig(robot, clock)
    rig.let_go(0.5)
    if start is None:
        assert rig.go(posture).message == ""
    slope, way = math.radians(SLOPES.get((body.name, posture), SLOPE)), math.radians(direction)
    down = math.sin(slope)
    robot._simulator.physics.mj.opt.gravity[:] = [
        9.81 * part for part in (down * math.cos(way), down * math.sin(way), -math.cos(slope))
    ]
    return rig


@pytest.mark.parametrize("direction", cases([180.0], [0.0, 90.0, 225.0, 270.0]))
@pytest.mark.parametrize("name", BEAR_THEMSELVES)
def test_a_posture_is_kept_by_stiff_motors_and_by_limp_ones_where_it_bears_itself(name, direction):
    body, bear_themselves = find_body(name), set()
    for posture in body.postures:
        rig = rig_in(body, posture, direction)
        rig.clock.advance(MINUTE)
        assert rig.posture == posture
        rig.robot.command_stiffnesses(dict.fromkeys(body.motors, 0.0), 1.0)
        end = rig.clock.now() + MINUTE
        while rig.clock.now() < end and rig.posture == posture:
            rig.clock.advance(1.0)
        if rig.posture == posture:
            bear_themselves.add(posture)
    assert bear_themselves == BEAR_THEMSELVES[name]
