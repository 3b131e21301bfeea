import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from naoserver.capabilities import Walker, WalkVelocity
from naoserver.fake.robot import FakeWalker
from zenoh_ice import VirtualClock

velocities = st.builds(WalkVelocity, st.floats(-0.3, 0.3), st.floats(-0.12, 0.12), st.floats(-0.9, 0.9))


def test_it_is_a_walker():
    assert isinstance(FakeWalker(VirtualClock(), H25.groups.legs), Walker)


@given(velocities, st.lists(st.floats(0.01, 2.0), min_size=1, max_size=8))
def test_how_often_it_is_asked_makes_no_difference(velocity, pauses):
    clock = VirtualClock()
    often, once = FakeWalker(clock, H25.groups.legs), FakeWalker(clock, H25.groups.legs)
    for walker in (often, once):
        walker.command(velocity)
    for pause in pauses:
        clock.advance(pause)
        often.odometry()
    one, other = often.odometry(), once.odometry()
    assert (one.x, one.y) == pytest.approx((other.x, other.y), abs=1e-9)
    assert math.remainder(one.heading - other.heading, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_circle_ends_where_it_began():
    clock = VirtualClock()
    walker = FakeWalker(clock, H25.groups.legs)
    walker.command(WalkVelocity(forward=0.2, turn=0.5))
    clock.advance(math.pi / 0.5)
    half = walker.odometry()
    assert (half.x, half.y) == pytest.approx((0.0, 2 * 0.2 / 0.5), abs=1e-9)
    clock.advance(math.pi / 0.5)
    assert (walker.odometry().x, walker.odometry().y) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_forward_is_where_it_looks():
    clock = VirtualClock()
    walker = FakeWalker(clock, H25.groups.legs)
    walker.command(WalkVelocity(turn=0.5))
    clock.advance(math.pi)
    walker.command(WalkVelocity(forward=0.2, left=0.1))
    clock.advance(2.0)
    walker.command(WalkVelocity())
    clock.advance(5.0)
    odometry = walker.odometry()
    assert (odometry.x, odometry.y) == pytest.approx((-0.2, 0.4))
    assert odometry.heading == pytest.approx(math.pi / 2)
    assert not walker.walking


def test_once_closed_it_stays_where_it_is():
    clock = VirtualClock()
    walker = FakeWalker(clock, H25.groups.legs)
    walker.command(WalkVelocity(forward=0.2))
    clock.advance(1.0)
    walker.close()
    clock.advance(1.0)
    walker.command(WalkVelocity(forward=0.2))
    clock.advance(1.0)
    assert walker.odometry().x == pytest.approx(0.2)
