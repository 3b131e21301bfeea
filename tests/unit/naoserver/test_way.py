"""The velocities on the way to a place, for robots that go in every direction, and for those on wheels."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.capabilities import STILL, Odometry, WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver.fake.robot import LIMITS, FakeWalker
from naoserver.moves.walk import way_to
from zenoh_ice import VirtualClock

START = Odometry(0.0, 0.0, 0.0, 0.0)
WHEELS = WalkVelocity(forward=0.5, left=0.0, turn=1.5)
_PERIOD = 0.05


class Drive:
    """A robot on wheels on its way to a place, and what it does on it."""

    def __init__(self, place, start=(0.0, 0.0, 0.0)):
        self.clock = VirtualClock()
        self.walker = FakeWalker(self.clock, (), WHEELS)
        self.way = way_to(place, Odometry(0.0, *start), WHEELS)
        self.start = start
        self.velocities = []
        self.places = []

    def here(self):
        """Return where it is, in the frame in which the start is given."""
        x, y, heading = self.start
        now = self.walker.odometry()
        cos, sin = math.cos(heading), math.sin(heading)
        turned = math.remainder(heading + now.heading, math.tau)
        return Odometry(now.time, x + cos * now.x - sin * now.y, y + sin * now.x + cos * now.y, turned)

    def go(self):
        """Go until the way ends; return where it ends."""
        while self.clock.now() < self.way.patience:
            velocity = self.way.velocity(self.here())
            if velocity == STILL:
                return self.here()
            self.velocities.append(velocity)
            self.places.append(self.here())
            self.walker.command(velocity)
            self.clock.advance(_PERIOD)
        raise AssertionError("it is still on its way")


def test_its_velocity_is_within_the_limits_on_a_straight_line():
    velocity = way_to((2.0, 1.0, 0.0), START, WalkVelocity(0.3, 0.1, 0.9)).velocity(START)
    assert (velocity.forward, velocity.left) == pytest.approx((0.2, 0.1))


def test_who_turns_goes_at_the_share_of_its_speed_that_the_turn_leaves():
    velocity = way_to((1.0, 0.0, 0.3), START, WalkVelocity(0.4, 0.1, 0.6)).velocity(START)
    assert (velocity.forward, velocity.left, velocity.turn) == pytest.approx((0.1, 0.0, 0.45))


@pytest.mark.parametrize("turn", [0.06, -0.06])
def test_a_turn_that_is_left_is_fast_enough_to_overcome_the_backlash_of_legs(turn):
    velocity = way_to((0.0, 0.0, turn), START, LIMITS).velocity(START)
    assert velocity == WalkVelocity(turn=math.copysign(0.2, turn))
    slow = WalkVelocity(0.3, 0.1, 0.15)
    assert way_to((0.0, 0.0, turn), START, slow).velocity(START) == WalkVelocity(
        turn=math.copysign(0.15, turn)
    )


@pytest.mark.parametrize(("lag", "gain"), [(0.0, 1.5), (0.1, 1.5), (1.2, 0.5)])
@pytest.mark.parametrize("limits", [LIMITS, WHEELS], ids=["legs", "wheels"])
def test_who_lags_behind_slows_down_earlier(limits, lag, gain):
    assert way_to((0.06, 0.0, 0.0), START, limits, lag).velocity(START).forward == pytest.approx(gain * 0.06)


def test_without_a_word_of_it_nothing_lags():
    assert way_to((0.06, 0.0, 0.0), START, LIMITS).velocity(START).forward == pytest.approx(1.5 * 0.06)


@pytest.mark.parametrize(
    ("place", "limits", "seconds"),
    [
        ((0.9, 0.0, 0.0), LIMITS, 3.0),
        ((0.9, 0.48, 0.0), LIMITS, 5.0),
        ((0.9, 0.48, -0.9), LIMITS, 6.0),
        ((1.0, 0.0, 0.0), WHEELS, 2.0),
        ((-1.0, 0.0, 0.0), WHEELS, 2.0),
        ((0.0, 1.0, math.pi / 2 - 0.3), WHEELS, 2.0 + (math.pi / 2 + 0.3) / 1.5),
        ((0.8, 0.6, 0.5), WHEELS, 2.0 + (2 * math.atan2(0.6, 0.8) - 0.5) / 1.5),
    ],
)
def test_it_may_take_three_times_as_long_as_at_full_speed(place, limits, seconds):
    assert way_to(place, START, limits).patience == pytest.approx(10.0 + 3.0 * seconds)


def test_its_progress_is_the_share_of_way_and_turn():
    way = way_to((1.0, 0.0, 1.0), START, LIMITS)
    assert way.progress(START) == 0.0
    assert way.progress(Odometry(0.0, 0.5, 0.0, 0.0)) == pytest.approx(0.25)
    assert way.progress(Odometry(0.0, 1.0, 0.0, 0.5)) == pytest.approx(0.75)
    assert way.progress(Odometry(0.0, 1.0, 0.0, 1.0)) == 1.0
    assert way.progress(Odometry(0.0, -9.0, 0.0, 0.0)) == 0.0


@given(
    st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-math.pi, math.pi)),
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-math.pi, math.pi)),
)
def test_on_wheels_it_gets_to_every_place_without_going_sideways(place, start):
    drive = Drive(place, start)
    end = drive.go()
    x, y, heading = place
    cos, sin = math.cos(start[2]), math.sin(start[2])
    assert (end.x, end.y) == pytest.approx(
        (start[0] + cos * x - sin * y, start[1] + sin * x + cos * y), abs=0.06
    )
    assert math.remainder(end.heading - start[2] - heading, math.tau) == pytest.approx(0.0, abs=0.05)
    for velocity in drive.velocities:
        assert velocity.left == 0.0
        assert abs(velocity.forward) <= WHEELS.forward
        assert abs(velocity.turn) <= WHEELS.turn


def test_on_wheels_it_turns_to_the_place_drives_there_and_turns_to_the_heading():
    drive = Drive((0.0, 1.0, 0.0))
    drive.go()
    forward = [bool(velocity.forward) for velocity in drive.velocities]
    begin, end = forward.index(True), len(forward) - forward[::-1].index(True)
    assert begin > 0
    assert all(forward[begin:end])
    assert not any(forward[end:])
    assert all(velocity.turn > 0.0 for velocity in drive.velocities[:begin])
    assert all(velocity.turn < 0.0 for velocity in drive.velocities[end:])


@pytest.mark.parametrize(
    ("place", "backwards"),
    [
        ((-1.0, 0.0, 0.0), True),
        ((-1.0, 0.3, 0.0), True),
        ((-1.0, 0.0, math.pi), False),
        ((1.0, 0.2, 0.0), False),
    ],
)
def test_on_wheels_it_drives_backwards_where_that_takes_less_turning(place, backwards):
    drive = Drive(place)
    drive.go()
    assert {velocity.forward < 0.0 for velocity in drive.velocities if velocity.forward} == {backwards}


def test_on_wheels_that_passed_the_place_it_returns_without_turning_round():
    way = way_to((1.0, 0.0, 0.0), START, WHEELS)
    back = way.velocity(Odometry(0.0, 1.05, 0.0, 0.0))
    assert back.forward < 0.0
    assert back.turn == 0.0


def test_on_wheels_that_slip_while_it_turns_at_the_place_it_does_not_drive_again():
    way = way_to((1.0, 0.0, 1.0), START, WHEELS)
    assert way.velocity(Odometry(0.0, 0.99, 0.0, 0.0)).turn > 0.0
    slipped = way.velocity(Odometry(0.0, 0.96, 0.02, 0.5))
    assert slipped.forward == 0.0
    assert slipped.turn > 0.0
    assert way.velocity(Odometry(0.0, 0.9, 0.0, 0.0)).forward > 0.0


def test_on_wheels_its_progress_backwards_needs_no_turns():
    way = way_to((-1.0, 0.0, 0.0), START, WHEELS)
    assert way.progress(Odometry(0.0, -0.5, 0.0, 0.0)) == pytest.approx(0.5)


def test_on_wheels_its_progress_counts_the_turns_to_the_place_and_there():
    way = way_to((0.0, 1.0, 0.0), START, WHEELS)
    turned = way.progress(Odometry(0.0, 0.0, 0.0, math.pi / 2))
    there = way.progress(Odometry(0.0, 0.0, 1.0, math.pi / 2))
    assert way.progress(START) == 0.0 < turned < there < way.progress(Odometry(0.0, 0.0, 1.0, 0.0)) == 1.0


@pytest.mark.parametrize(
    ("limits", "lacks"), [(WalkVelocity(forward=0.5), "turn"), (WalkVelocity(turn=1.0), "drive forwards")]
)
def test_a_robot_that_cannot_get_everywhere_says_so(limits, lacks):
    with pytest.raises(InvalidCommand, match=f"^the robot cannot {lacks}, so") as refusal:
        way_to((1.0, 0.0, 0.0), START, limits)
    assert refusal.value.field == "walk"
