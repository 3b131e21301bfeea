"""The simulated robot's walk, in virtual time."""

import math
from dataclasses import astuple

import pytest

from naoserver.bodies.capabilities import STILL, Walker, WalkVelocity
from naoserver.bodies.nao import H25
from naoserver.errors import InvalidCommand
from naoserver_sim._walk.walker import LIMITS
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.present import present
from tests.support.soak import cases
from tests.support.walking import mean_velocity
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

TICK = 0.01


class Rig:
    """A robot that has stood for a moment, and where it has really got to."""

    def __init__(self, **options):
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(clock=self.clock, skin=False, world=load_world("empty"), **options)
        self.walker = self.robot.walker
        self.go(0.2)

    def go(self, seconds):
        self.clock.advance(seconds)
        self.robot.read()

    def truth(self):
        """Return place and heading on the floor."""
        torso = self.robot.stage.truth().torso
        return torso.position[0], torso.position[1], torso.heading

    def speeds(self, seconds):
        """Walk on for some seconds; return the mean velocity in the robot's own frame."""
        return mean_velocity(self.truth, self.go, seconds, 0.05)

    def end(self):
        """End the walk; return the seconds until it stands."""
        present(self.walker).command(STILL)
        seconds = 0.0
        while present(self.walker).walking:
            self.go(TICK)
            seconds += TICK
            assert seconds < 5.0
        return seconds

    def commands(self):
        names = [joint.name for joint in self.robot.joints]
        return dict(zip(names, self.robot.read().commands, strict=True))


@pytest.fixture
def rig():
    return Rig()


def test_it_is_a_walker_that_rests(rig):
    assert isinstance(rig.walker, Walker)
    assert not rig.walker.walking
    assert rig.walker.commanded() == STILL


@pytest.mark.parametrize(
    "velocity",
    [
        WalkVelocity(forward=0.25),
        WalkVelocity(left=0.1),
        WalkVelocity(turn=-0.8),
        WalkVelocity(0.15, 0.05, 0.4),
    ],
)
def test_it_walks_as_fast_as_commanded_and_ends_on_both_feet(velocity):
    rig = Rig(noise=True, seed=1)
    present(rig.walker).command(velocity)
    rig.go(2.0)
    reached = rig.speeds(2.0)
    for value, wanted in zip(reached, astuple(velocity), strict=True):
        assert value == pytest.approx(wanted, rel=0.15, abs=0.03)
    rig.end()
    rig.go(1.0)
    before = rig.truth()
    rig.go(1.0)
    assert rig.truth() == pytest.approx(before, abs=0.002)
    assert rig.robot.state().torso_tilt < 0.1


@pytest.mark.parametrize("walked", cases([2.1], [2.0, 2.2]))
@pytest.mark.parametrize("velocity", [LIMITS, WalkVelocity(forward=LIMITS.forward)])
def test_even_at_full_speed_it_comes_to_a_stand_within_a_second(velocity, walked):
    rig = Rig()
    present(rig.walker).command(velocity)
    rig.go(walked)
    present(rig.walker).command(STILL)
    rig.go(1.0)
    there = rig.commands()
    rig.go(1.0)
    assert rig.commands() == pytest.approx(there, abs=0.005)
    assert rig.robot.stage.truth().torso.position[2] > 0.28


def test_the_odometry_knows_where_it_has_got_to():
    rig = Rig(noise=True, seed=2)
    rig.go(2.0)
    begin, odometry = rig.truth(), present(rig.walker).odometry()
    for velocity in (WalkVelocity(0.25), WalkVelocity(0.1, 0.05, 0.6), WalkVelocity(left=-0.1)):
        present(rig.walker).command(velocity)
        rig.go(4.0)
    rig.end()
    end, believed = rig.truth(), present(rig.walker).odometry()
    way = math.hypot(end[0] - begin[0], end[1] - begin[1])
    assert way > 0.8
    missed = math.hypot(
        (believed.x - odometry.x) - (end[0] - begin[0]), (believed.y - odometry.y) - (end[1] - begin[1])
    )
    assert missed < 0.1 * way
    turned = math.remainder(end[2] - begin[2] - believed.heading + odometry.heading, math.tau)
    assert abs(turned) < 0.1


@pytest.mark.parametrize("posture", cases(["Crouch"], ["Stand", "StandZero"]))
def test_it_begins_from_any_posture_on_its_feet(posture):
    rig = Rig(posture=posture)
    present(rig.walker).command(WalkVelocity(forward=0.2))
    rig.go(5.0)
    assert present(rig.walker).walking
    assert rig.truth()[0] > 0.5


def test_the_legs_are_never_asked_to_jump(rig):
    fastest = {joint.name: joint.max_velocity for joint in rig.robot.joints if joint.name in H25.groups.legs}
    rig.walker.command(WalkVelocity(0.2, 0.05, 0.3))
    last = rig.commands()
    for tick in range(350):
        if tick == 150:
            rig.walker.command(STILL)
        rig.go(TICK)
        now = rig.commands()
        for name, speed in fastest.items():
            assert abs(now[name] - last[name]) / TICK <= 1.25 * speed  # so that motors nearly keep up
        last = now
    assert not rig.walker.walking


def test_a_walk_that_begins_again_before_it_has_ended_goes_on(rig):
    rig.walker.command(WalkVelocity(forward=0.2))
    rig.go(2.0)
    for _ in range(6):
        rig.walker.command(STILL)
        rig.go(0.3)
        rig.walker.command(WalkVelocity(forward=0.2))
        rig.go(0.3)
    assert rig.walker.walking
    assert rig.robot.state().torso_tilt < 0.2


def test_the_arms_swing_against_the_legs_and_come_to_rest(rig):
    rest = rig.commands()["LShoulderPitch"]
    rig.walker.command(WalkVelocity(forward=0.25))
    rig.go(2.0)
    swings = []
    for _ in range(100):
        rig.go(TICK)
        now = rig.commands()
        swings.append((now["LShoulderPitch"] - rest, now["RShoulderPitch"] - rest))
    assert max(left for left, _ in swings) > 0.05
    assert min(left for left, _ in swings) < -0.05
    assert sum(left * right for left, right in swings) < 0.0
    rig.end()
    assert rig.commands()["LShoulderPitch"] == pytest.approx(rest)


def test_an_arm_that_is_commanded_does_not_swing_and_the_head_is_free(rig):
    rig.walker.command(WalkVelocity(forward=0.2))
    rig.go(2.0)
    rig.robot.command_positions({"LElbowRoll": -0.5, "HeadYaw": 0.7}, {"LElbowRoll": 2.0, "HeadYaw": 2.0})
    rig.go(1.0)
    seen = set()
    for _ in range(60):
        rig.go(TICK)
        now = rig.commands()
        seen.add((now["LShoulderPitch"], now["LElbowRoll"], now["HeadYaw"]))
    assert len(seen) == 1
    _, elbow, yaw = seen.pop()
    assert (elbow, yaw) == pytest.approx((-0.5, 0.7))


def test_an_arm_that_was_put_somewhere_before_stays_there(rig):
    rig.robot.command_positions({"RShoulderPitch": 0.2}, {"RShoulderPitch": 2.0})
    rig.go(1.0)
    rig.walker.command(WalkVelocity(forward=0.2))
    for _ in range(20):
        rig.go(0.1)
        assert rig.commands()["RShoulderPitch"] == pytest.approx(0.2)


def test_where_the_walk_has_left_the_legs_they_stay_until_commanded(rig):
    rig.walker.command(WalkVelocity(forward=0.2))
    rig.go(2.0)
    rig.robot.command_positions({"LKneePitch": 2.0}, {"LKneePitch": 6.0})
    rig.go(1.0)
    rig.end()
    left = rig.commands()["LKneePitch"]
    assert left < 1.5
    rig.go(1.0)
    assert rig.commands()["LKneePitch"] == left
    rig.robot.command_positions({"LKneePitch": left + 0.05}, {"LKneePitch": 1.0})
    rig.go(1.0)
    assert rig.commands()["LKneePitch"] == pytest.approx(left + 0.05)


def test_it_walks_on_after_a_push(rig):
    rig.walker.command(WalkVelocity(forward=0.15))
    rig.go(2.0)
    rig.robot.stage.push((0.0, 8.0, 0.0), 0.1)
    rig.go(4.0)
    assert rig.walker.walking
    assert rig.robot.state().torso_tilt < 0.2


def test_a_fall_ends_the_walk_and_one_that_lies_does_not_begin(rig):
    rig.walker.command(WalkVelocity(forward=0.2))
    rig.go(2.0)
    rig.robot.stage.push((0.0, 80.0, 0.0), 0.3)
    rig.go(3.0)
    assert rig.robot.state().fallen
    assert not rig.walker.walking
    assert rig.walker.commanded() == STILL
    assert rig.walker.ended.startswith("it lies, or it falls")
    with pytest.raises(InvalidCommand, match="it lies"):
        rig.walker.command(WalkVelocity(forward=0.2))
    rig.walker.command(STILL)


def test_a_robot_that_is_put_elsewhere_stands_there_and_can_walk_again(rig):
    rig.walker.command(WalkVelocity(forward=0.2))
    rig.go(2.0)
    before = rig.walker.odometry()
    rig.robot.stage.place_robot(1.0, -1.0, 0.5)
    rig.go(0.5)
    assert not rig.walker.walking
    assert rig.walker.commanded() == STILL
    after = rig.walker.odometry()
    assert (after.x, after.y) == pytest.approx((before.x, before.y), abs=0.01)
    rig.robot.stage.reset()
    rig.walker.command(WalkVelocity(forward=0.2))
    rig.go(4.0)
    assert rig.walker.commanded() == WalkVelocity(forward=0.2)
    assert rig.truth()[0] > 0.3


def test_of_two_commands_at_once_the_last_one_counts(rig):
    rig.walker.command(WalkVelocity(forward=0.2))
    rig.walker.command(STILL)
    rig.go(1.0)
    assert not rig.walker.walking
    rig.walker.command(WalkVelocity(forward=0.2))
    rig.robot.stage.reset()
    rig.go(1.0)
    assert rig.walker.commanded() == STILL
    assert not rig.walker.walking


def test_limp_legs_do_not_walk(rig):
    rig.robot.command_stiffnesses({"LKneePitch": 0.2}, 0.0)
    rig.go(0.1)
    with pytest.raises(InvalidCommand, match="limp"):
        rig.walker.command(WalkVelocity(forward=0.2))
    assert not rig.walker.walking
    rig.robot.command_stiffnesses({"LKneePitch": 1.0}, 0.0)
    rig.go(0.1)
    rig.walker.command(WalkVelocity(forward=0.2))


def test_what_is_as_good_as_nothing_is_no_walk(rig):
    rig.walker.command(WalkVelocity(forward=1e-6, turn=-5e-324))
    rig.go(1.0)
    assert rig.walker.commanded() == STILL
    assert not rig.walker.walking


def test_legs_are_those_of_the_body():
    assert set(H25.groups.legs) == {name for name in H25.joint_names if name[1:4] in ("Hip", "Kne", "Ank")}
