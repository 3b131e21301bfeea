"""The balance of the simulated robot, which stands motions of its legs that it cannot stand unaided."""

import math
from contextlib import contextmanager

import pytest

pytest.importorskip("qi")

from naoserver.bodies.capabilities import Support, WalkVelocity
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from plugins.naoqi.tests.support.rig import Rig
from tests.support.leg_motions import KICK, ONE_LEG
from tests.support.motion_rig import MotionRig
from tests.support.present import present
from tests.support.soak import cases
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

UPRIGHT = math.radians(30)


@contextmanager
def standing(**options):
    """A robot in StandInit, behind its guards and ALMotion."""
    world = load_world("empty")
    rig = Rig(lambda clock: SimulatedRobot(clock=clock, world=world, skin=False, **options))
    rig.advance(0.5)
    try:
        yield rig
    finally:
        rig.close()


def largest_tilt(rig, motion, seconds=5.0):
    """Play a motion, and return the largest tilt of the torso in rad; no longer than until it falls."""
    call = rig.begin(rig.motion.angleInterpolation, *motion)
    largest = 0.0
    end = rig.clock.now() + seconds
    while rig.clock.now() < end and largest < math.radians(60):
        rig.advance(0.02)
        largest = max(largest, rig.robot.state().torso_tilt)
    call.call.stopped.set()
    rig.advance(0.04)
    call.join()
    return largest


@pytest.mark.slow
@pytest.mark.parametrize(
    "motion", cases([pytest.param(KICK, id="kick")], [pytest.param(ONE_LEG, id="one leg")])
)
def test_it_stands_a_motion_that_it_cannot_stand_unaided(motion):
    with standing() as rig:
        assert largest_tilt(rig, motion) < UPRIGHT
        assert rig.robot.senses.read().right_foot.total == 0.0, "the right foot is on the floor"
    with standing() as rig:
        rig.access.balance = lambda _joints: None
        assert largest_tilt(rig, motion) > UPRIGHT


@pytest.mark.slow
@pytest.mark.parametrize("seed", cases([1], [2]))
def test_it_stands_on_one_leg_with_the_noise_of_sensors(seed):
    with standing(noise=True, seed=seed) as rig:
        assert largest_tilt(rig, ONE_LEG) < UPRIGHT


@pytest.mark.slow
def test_the_setpoints_are_those_that_were_commanded():
    with standing() as rig:
        largest_tilt(rig, ONE_LEG)
        names, angles, _, _ = ONE_LEG
        assert rig.motion.getAngles(names, False) == pytest.approx([keys[-1] for keys in angles])
        assert rig.robot.balancer.support() is Support.LEGS


@pytest.mark.slow
def test_an_emergency_stop_holds_the_joints_and_it_goes_on_balancing():
    with standing() as rig:
        call = rig.begin(rig.motion.angleInterpolation, *ONE_LEG)
        rig.advance(2.2)
        rig.assembly.gate.stop("test")
        rig.advance(0.04)
        call.join()
        held = rig.access.angles(measured=False)
        rig.advance(4.0)
        assert rig.access.angles(measured=False) == held
        assert rig.robot.state().torso_tilt < UPRIGHT


def test_limp_legs_are_not_corrected():
    with standing() as rig:
        rig.robot.balancer.command(Support.LEFT)
        rig.advance(1.0)
        corrected = (
            rig.access.angles(measured=True)["LAnkleRoll"] - rig.access.angles(measured=False)["LAnkleRoll"]
        )
        assert corrected > 0.02
        rig.motion.setStiffnesses("Body", 0.0)
        rig.advance(3.0)
        measured, setpoints = (rig.access.angles(measured=way) for way in (True, False))
        assert measured["LAnkleRoll"] == pytest.approx(setpoints["LAnkleRoll"], abs=1e-3)


@pytest.mark.slow
def test_motions_postures_and_walks_of_the_server_are_left_as_they_are():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, world=load_world("empty"), skin=False)
    try:
        rig = MotionRig(robot, clock)
        present(robot.balancer).command(Support.LEGS)
        rig.begin("wave")
        assert present(robot.balancer).support() is None
        rig.finish()
        present(robot.balancer).command(Support.LEFT)
        clock.advance(0.5)
        present(robot.walker).command(WalkVelocity(forward=0.1))
        clock.advance(4.0)
        assert present(robot.walker).walking
        assert robot.state().torso_tilt < UPRIGHT
    finally:
        robot.close()


def test_a_robot_that_is_placed_elsewhere_is_not_corrected():
    with standing() as rig:
        rig.robot.balancer.command(Support.LEFT)
        rig.advance(1.0)
        rig.robot.balancer.command(None)
        rig.robot.stage.reset()
        rig.advance(0.04)
        measured, setpoints = (rig.access.angles(measured=way) for way in (True, False))
        assert measured["LAnkleRoll"] == pytest.approx(setpoints["LAnkleRoll"], abs=0.01)
