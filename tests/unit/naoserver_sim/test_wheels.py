"""The cart drives where it is sent, knows how far it came, and stops when it cannot go on."""

import math
from typing import cast

import pytest

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.parts import Wheels
from naoserver.errors import InvalidCommand
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world, parse_world
from tests.support.present import present
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

CART = find_body("Cart")
WHEELS = cast("Wheels", CART.walk)
FORWARD = WalkVelocity(forward=WHEELS.fastest)
TURN = WalkVelocity(turn=1.0)
WALL = "walls = [{ begin = [0.6, -2.0], end = [0.6, 2.0] }]"
OBLIQUE_WALL = "walls = [{ begin = [0.45, -0.3], end = [0.75, 1.2] }]"
RAMP = WHEELS.fastest / WHEELS.acceleration
"""Seconds to the fastest speed, and from it."""


class Drive:
    """A cart at the origin of a world, and the clock that moves it."""

    def __init__(self, world=""):
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(
            clock=self.clock, body=CART, world=parse_world(world, "test") if world else load_world("empty")
        )
        self.robot.start()
        self.walker = present(self.robot.walker)
        self.turned = 0.0
        self.most_tilted = 0.0

    def go(self, velocity, seconds):
        self.walker.command(velocity)
        self.pass_time(seconds)

    def pass_time(self, seconds):
        for _ in range(round(seconds / 0.02)):
            before = self.heading
            self.clock.advance(0.02)
            self.turned += math.remainder(self.heading - before, math.tau)
            self.most_tilted = max(self.most_tilted, self.robot.state().torso_tilt)

    @property
    def place(self):
        return self.robot.stage.truth().torso.position

    @property
    def heading(self):
        w, _, _, z = self.robot.stage.truth().torso.orientation
        return 2 * math.atan2(z, w)

    @property
    def odometry(self):
        odometry = self.walker.odometry()
        return odometry.x, odometry.y, odometry.heading

    @property
    def touched(self):
        return self.robot.senses.read().touched


@pytest.fixture
def drives():
    """Return a function that puts a cart into a world."""
    made = []

    def drive(world=""):
        made.append(Drive(world))
        return made[-1]

    yield drive
    for each in made:
        each.robot.close()


@pytest.mark.parametrize("forward", [WHEELS.fastest, -WHEELS.fastest, 0.05])
def test_it_drives_straight(drives, forward):
    drive = drives()
    drive.go(WalkVelocity(forward=forward), 4.0)
    drive.go(STILL, 1.0)
    x, y, _ = drive.place
    assert x == pytest.approx(4.0 * forward, abs=0.01)
    assert y == pytest.approx(0.0, abs=0.005)
    assert drive.turned == pytest.approx(0.0, abs=0.01)
    assert not drive.walker.walking


@pytest.mark.parametrize("turn", [1.0, -1.0, WHEELS.fastest_turn])
def test_it_turns_on_the_spot(drives, turn):
    drive = drives()
    drive.go(WalkVelocity(turn=turn), 4.0)
    drive.go(STILL, 1.0)
    assert drive.turned == pytest.approx(4.0 * turn, rel=0.02)
    assert drive.place[:2] == pytest.approx((0.0, 0.0), abs=0.01)


def test_it_drives_a_circle(drives):
    drive = drives()
    drive.go(WalkVelocity(forward=0.2, turn=0.5), math.tau / 0.5)
    drive.go(STILL, 1.0)
    assert drive.turned == pytest.approx(math.tau, rel=0.02)
    assert drive.place[:2] == pytest.approx((0.0, 0.0), abs=0.03)


def test_its_odometry_is_where_it_is(drives):
    drive = drives()
    for velocity in (
        FORWARD,
        WalkVelocity(0.2, 0.0, 1.0),
        WalkVelocity(turn=-1.5),
        WalkVelocity(forward=-0.2),
    ):
        drive.go(velocity, 2.0)
    drive.go(STILL, 1.0)
    x, y, heading = drive.odometry
    assert (x, y) == pytest.approx(drive.place[:2], abs=0.03)
    assert math.remainder(heading - drive.heading, math.tau) == pytest.approx(0.0, abs=0.03)


def test_its_odometry_errs_when_its_wheels_slip(drives):
    drive = drives()
    drive.robot.stage.push((0.0, 60.0, 0.0), 0.2)
    drive.pass_time(1.0)
    assert math.hypot(*drive.place[:2]) > 0.05
    assert math.hypot(*drive.odometry[:2]) < 0.02


def test_it_neither_tips_over_nor_jumps_at_its_full_acceleration(drives):
    drive = drives()
    for sign in (1.0, -1.0, 1.0, -1.0):
        drive.go(WalkVelocity(forward=sign * WHEELS.fastest), 1.0)
    drive.go(STILL, 1.0)
    assert drive.most_tilted < math.radians(1.0)


def test_it_accelerates_no_faster_than_it_may(drives):
    drive = drives()
    drive.go(FORWARD, RAMP / 2)
    speed = drive.robot.stage.truth().velocity[0]
    assert speed == pytest.approx(WHEELS.fastest / 2, abs=0.05)
    drive.pass_time(1.0)
    assert drive.robot.stage.truth().velocity[0] == pytest.approx(WHEELS.fastest, abs=0.01)


def test_wheels_turn_no_faster_than_their_motors_and_it_stays_on_its_curve(drives):
    drive = drives()
    wanted = WalkVelocity(WHEELS.fastest, 0.0, WHEELS.fastest_turn)
    drive.go(wanted, 1.0)
    fastest = CART.joint[WHEELS.right].max_velocity
    before = drive.turned
    drive.pass_time(1.0)
    assert max(map(abs, drive.robot.read().velocities)) < 1.02 * fastest
    truth = drive.robot.stage.truth()
    radius = math.hypot(*truth.velocity[:2]) / (drive.turned - before)
    assert radius == pytest.approx(wanted.forward / wanted.turn, rel=0.1)


def test_it_stays_where_it_stands(drives):
    drive = drives()
    drive.pass_time(5.0)
    assert drive.place[:2] == pytest.approx((0.0, 0.0), abs=0.001)
    assert drive.odometry == pytest.approx((0.0, 0.0, 0.0), abs=0.001)
    assert not drive.walker.walking


def test_a_wall_stops_it_and_it_does_not_wind_up(drives):
    drive = drives(WALL)
    drive.go(FORWARD, 5.0)
    x, _, _ = drive.place
    assert x == pytest.approx(0.6 - 0.025 - 0.17, abs=0.01)
    assert drive.odometry[0] == pytest.approx(x, abs=0.03)
    assert drive.walker.walking
    drive.go(WalkVelocity(forward=-0.2), 1.0)
    assert drive.place[0] < x - 0.08


def test_both_bumpers_feel_a_wall_ahead(drives):
    drive = drives(WALL)
    drive.go(FORWARD, 1.0)
    assert drive.touched == frozenset()
    drive.pass_time(1.0)
    assert drive.touched == {"BumperLeft", "BumperRight"}
    drive.go(WalkVelocity(forward=-0.2), 1.0)
    assert drive.touched == frozenset()


def test_one_bumper_feels_a_wall_on_its_side(drives):
    drive = drives(OBLIQUE_WALL)
    drive.walker.command(FORWARD)
    while not drive.touched and drive.clock.now() < 3.0:
        drive.pass_time(0.02)
    assert drive.touched == {"BumperRight"}


def test_its_sonars_measure_the_way_to_a_wall(drives):
    drive = drives(WALL)
    sonar = drive.robot.senses.read().sonar
    # From the sensors to the wall, at the angle at which they look outwards.
    assert sonar.left == pytest.approx(0.42, abs=0.05)
    assert sonar.right == pytest.approx(sonar.left, abs=0.01)


def test_a_push_turns_limp_wheels_and_the_odometry_counts_it(drives):
    drive = drives()
    drive.robot.command_stiffnesses({WHEELS.left: 0.0, WHEELS.right: 0.0}, 0.0)
    drive.pass_time(0.1)
    drive.robot.stage.push((10.0, 0.0, 0.0), 0.2)
    drive.pass_time(2.0)
    assert drive.place[0] > 0.1
    assert drive.odometry[0] == pytest.approx(drive.place[0], abs=0.01)


def test_limp_wheels_do_not_drive(drives):
    drive = drives()
    drive.robot.command_stiffnesses({WHEELS.left: 0.0}, 0.0)
    drive.pass_time(0.1)
    with pytest.raises(InvalidCommand, match="wheels are limp"):
        drive.walker.command(FORWARD)
    drive.walker.command(STILL)
    drive.robot.command_stiffnesses({WHEELS.left: 1.0}, 0.0)
    drive.pass_time(0.1)
    drive.go(FORWARD, 1.0)
    assert drive.place[0] > 0.2


def test_wheels_that_become_limp_end_the_drive(drives):
    drive = drives()
    drive.go(FORWARD, 0.5)
    drive.robot.command_stiffnesses({WHEELS.left: 0.0, WHEELS.right: 0.0}, 0.0)
    drive.pass_time(1.0)
    assert "limp" in drive.walker.ended
    assert drive.walker.commanded() == STILL
    assert not drive.walker.walking
    drive.robot.command_stiffnesses({WHEELS.left: 1.0, WHEELS.right: 1.0}, 0.0)
    x = drive.place[0]
    drive.pass_time(1.0)
    assert drive.place[0] == pytest.approx(x, abs=0.01)


def test_a_cart_that_toppled_over_stops_and_refuses_to_drive(drives):
    drive = drives()
    drive.go(FORWARD, 0.5)
    drive.robot.stage.push((0.0, 130.0, 60.0), 0.1)
    drive.pass_time(2.0)
    assert drive.robot.state().torso_tilt > math.radians(60)
    assert "toppled over" in drive.walker.ended
    assert not drive.walker.walking
    with pytest.raises(InvalidCommand, match="toppled over"):
        drive.walker.command(FORWARD)
    drive.robot.stage.place_robot(0.0, 0.0, 0.0)
    drive.pass_time(0.5)
    drive.go(FORWARD, 1.0)
    assert drive.walker.ended == ""
    assert drive.place[0] > 0.2


def test_a_cart_that_is_placed_elsewhere_stops_and_its_odometry_does_not_jump(drives):
    drive = drives()
    drive.go(FORWARD, 1.0)
    before = drive.odometry
    drive.robot.stage.place_robot(1.0, 1.0, 1.0)
    drive.pass_time(0.5)
    assert drive.place[:2] == pytest.approx((1.0, 1.0), abs=0.01)
    assert "moved" in drive.walker.ended
    assert drive.odometry == pytest.approx(before, abs=0.01)


def test_it_cannot_drive_sideways(drives):
    drive = drives()
    assert drive.walker.limits.left == 0.0
    with pytest.raises(InvalidCommand, match="sideways"):
        drive.walker.command(WalkVelocity(left=0.1))


def test_the_same_drives_lead_to_the_same_place(drives):
    places = []
    for _ in range(2):
        drive = drives(WALL)
        drive.go(FORWARD, 2.0)
        drive.go(WalkVelocity(0.1, 0.0, -1.0), 1.0)
        places.append((drive.place, drive.odometry))
    assert places[0] == places[1]


def test_its_head_turns_the_camera_while_it_drives(drives):
    drive = drives()
    drive.walker.command(FORWARD)
    drive.robot.command_positions({"NeckPan": 1.0, "NeckTilt": 0.3}, {"NeckPan": 2.0, "NeckTilt": 2.0})
    drive.pass_time(2.0)
    place, axes = drive.robot.camera_pose("Camera")
    ahead = -axes[:, 2]
    assert math.atan2(ahead[1], ahead[0]) == pytest.approx(1.0 + drive.heading, abs=0.03)
    assert math.asin(-ahead[2]) == pytest.approx(0.3, abs=0.03)
    assert 0.35 < place[2] < 0.45
