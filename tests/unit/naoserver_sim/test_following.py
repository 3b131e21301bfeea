"""A walk or a drive ends when one of its joints does not follow, and goes on while all do."""

import pytest

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver_sim.robot import SimulatedRobot
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

GAITS = [
    ("H25", "LAnklePitch"),
    ("H25", "LHipPitch"),
    ("T1", "Left_Knee_Pitch"),
    ("G1", "left_knee_joint"),
    ("Cart", "LeftWheel"),
]


@pytest.fixture
def go():
    """Return a function that lets a robot go forward for a second at half its speed, and returns its clock."""
    robots = []

    def begin(body, **options):
        clock = VirtualClock()
        facts = find_body(body)
        posture = "StandInit" if facts.postures else None
        robot = SimulatedRobot(clock=clock, body=facts, posture=posture, skin=False, **options)
        robots.append(robot)
        robot.start()
        clock.advance(1.0)
        walker = robot.walker
        assert walker is not None
        walker.command(WalkVelocity(0.5 * walker.limits.forward, 0.0, 0.0))
        clock.advance(1.0)
        return robot, clock

    yield begin
    for robot in robots:
        robot.close()


@pytest.mark.parametrize(("body", "joint"), GAITS)
def test_a_way_with_a_stuck_joint_ends_within_a_second_with_its_name(go, body, joint):
    robot, clock = go(body)
    robot.faults.inject(joint, "stuck")
    clock.advance(1.0)
    assert robot.walker.ended == f"{joint} does not follow its commands"
    assert robot.walker.commanded() == STILL


@pytest.mark.parametrize("body", ["H25", "T1", "G1", "Cart"])
def test_a_way_with_noise_goes_on(go, body):
    robot, clock = go(body, noise=True, seed=3)
    clock.advance(4.0)
    assert robot.walker.ended == ""
    assert robot.walker.commanded() != STILL
