"""The gait alone: the feet that a walk requests for any command and any measurement."""

import math
from dataclasses import astuple
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver_sim._walk import gait as options
from naoserver_sim._walk.gait import AT_REST, LEFT, RIGHT, Gait
from tests.support.examples import examples

TICK = 0.01
AIRBORNE = (0.0, 0.0)

velocities = st.builds(WalkVelocity, st.floats(-0.35, 0.35), st.floats(-0.14, 0.14), st.floats(-1.0, 1.0))
loads = st.tuples(st.floats(0.0, 60.0), st.floats(0.0, 60.0))


def carried(gait):
    """Return the loads of a foot that touches once it is down again."""
    down = gait.phase >= 0.95
    swing, support = (10.0 if down else 0.0), 40.0
    return (swing, support) if gait.swing == LEFT else (support, swing)


def walk(gait, velocity, seconds):
    for _ in range(round(seconds / TICK)):
        gait.tick(TICK, velocity, carried(gait))


def test_it_stands_until_something_is_wanted():
    gait = Gait()
    walk(gait, STILL, 1.0)
    assert not gait.walking
    assert gait.feet == [AT_REST, AT_REST]
    assert gait.steps == 0


@given(st.lists(st.tuples(velocities, st.integers(1, 60), loads), min_size=1, max_size=12))
@settings(max_examples=examples(60))
def test_whatever_is_commanded_and_felt_feet_stay_in_reach_and_one_of_them_on_the_floor(programme):
    gait = Gait()
    for velocity, ticks, felt in programme:
        for _ in range(ticks):
            gait.tick(TICK, velocity, felt)
            left, right = gait.feet
            if gait.phase >= options.LOWERING:
                assert min(left.lift, right.lift) == 0.0
            assert max(left.lift, right.lift) <= options.LIFT
            for foot in gait.feet:
                assert abs(foot.x) <= 0.35 * options.PERIOD / 2 + 1e-9
                assert abs(foot.y) <= 0.14 * options.PERIOD + 1e-9
                assert abs(foot.yaw) <= 1.0 * options.PERIOD + 1e-9


@given(velocities, st.floats(0.3, 3.0))
@settings(max_examples=examples(40))
def test_a_walk_that_is_to_end_ends_with_the_feet_together(velocity, seconds):
    gait = Gait()
    walk(gait, velocity, seconds)
    walk(gait, STILL, 5.0)
    assert not gait.walking
    assert gait.feet == [AT_REST, AT_REST]


@given(velocities.filter(lambda velocity: max(map(abs, astuple(velocity))) > 1e-3))
@settings(max_examples=examples(40))
def test_feet_take_turns(velocity):
    gait = Gait()
    swings = [gait.swing for _ in range(300) if gait.tick(TICK, velocity, carried(gait))]
    assert len(swings) >= 8
    assert all(now != following for now, following in pairwise(swings))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_to_the_mirrored_side_it_walks_mirrored(sign):
    one, other = Gait(), Gait()
    for _ in range(400):
        one.tick(TICK, WalkVelocity(0.2, 0.08 * sign, 0.5 * sign), carried(one))
        other.tick(TICK, WalkVelocity(0.2, -0.08 * sign, -0.5 * sign), carried(other))
        for foot in (LEFT, RIGHT):
            here, there = one.feet[foot], other.feet[1 - foot]
            assert (here.x, here.y, here.yaw) == pytest.approx((there.x, -there.y, -there.yaw), abs=1e-12)


@pytest.mark.parametrize(
    ("velocity", "expected"),
    [
        (WalkVelocity(forward=0.2), (0.2, 0.0, 0.0)),
        (WalkVelocity(forward=-0.2), (-0.2, 0.0, 0.0)),
        (WalkVelocity(left=0.1), (0.0, 0.1, 0.0)),
        (WalkVelocity(turn=-0.8), (0.0, 0.0, -0.8)),
    ],
)
def test_the_foot_that_carries_moves_back_below_the_body_at_the_velocity(velocity, expected):
    gait = Gait()
    walk(gait, velocity, 4.0)
    moved, seconds = [0.0, 0.0, 0.0], 0.0
    while seconds < 4.0:
        support, before = gait.support, gait.feet[gait.support]
        gait.tick(TICK, velocity, carried(gait))
        if gait.support == support:
            after = gait.feet[support]
            for axis, change in enumerate((before.x - after.x, before.y - after.y, before.yaw - after.yaw)):
                moved[axis] += change
            seconds += TICK
    assert [way / seconds for way in moved] == pytest.approx(expected, rel=0.1, abs=1e-9)


def test_a_step_ends_when_the_foot_touches_but_not_while_it_rises():
    gait = Gait()
    heavy = (30.0, 30.0)
    ended = [gait.tick(TICK, WalkVelocity(forward=0.1), heavy) for _ in range(40)]
    assert ended.index(True) + 1 == math.ceil(options.EARLIEST_TOUCH * options.PERIOD / TICK - 1e-9)


def test_a_step_whose_foot_never_touches_ends_all_the_same():
    gait = Gait()
    ended = [gait.tick(TICK, WalkVelocity(forward=0.1), AIRBORNE) for _ in range(60)]
    assert ended.index(True) * TICK == pytest.approx(options.LATEST_TOUCH * options.PERIOD, abs=2 * TICK)


def test_a_foot_that_touches_early_comes_down_without_a_jump():
    gait, heavy = Gait(), (30.0, 30.0)
    last = [foot.lift for foot in gait.feet]
    most = options.LIFT * TICK / options.PERIOD * max(4.0, 1.0 / options.LOWERING)
    for tick in range(400):
        gait.tick(TICK, WalkVelocity(forward=0.1) if tick < 200 else STILL, heavy)
        now = [foot.lift for foot in gait.feet]
        assert all(abs(a - b) <= most + 1e-9 for a, b in zip(now, last, strict=True))
        last = now
    assert not gait.walking


def test_a_walk_ends_in_fewer_steps_than_it_begins():
    gait = Gait()
    velocity = WalkVelocity(forward=0.3)
    steps_until_full = math.ceil(velocity.forward * options.PERIOD / options.FORWARD_CHANGE)
    walk(gait, velocity, 4.0)
    begun = gait.steps
    walk(gait, STILL, 4.0)
    assert not gait.walking
    assert gait.steps - begun < steps_until_full


def test_steps_grow_little_by_little():
    gait, lengths = Gait(), []
    for _ in range(300):
        if gait.tick(TICK, WalkVelocity(forward=0.3), carried(gait)):
            left, right = gait.feet
            lengths.append(abs(left.x - right.x))
    assert lengths[0] < 0.4 * lengths[-1]
    assert all(later - earlier <= 2 * options.FORWARD_CHANGE for earlier, later in pairwise(lengths))
