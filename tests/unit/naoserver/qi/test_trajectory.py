"""The trajectories of NAOqi's interpolations."""

import math
from itertools import accumulate

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("qi")

from naoserver.errors import InvalidCommand
from naoserver.qi._trajectory import Key, Trajectory, smooth_trajectory

angles = st.floats(-3.0, 3.0)
keys = st.lists(st.tuples(st.floats(0.05, 2.0), angles), min_size=1, max_size=6)


def smooth(start, steps):
    times = list(accumulate(seconds for seconds, _ in steps))
    return times, smooth_trajectory("HeadYaw", start, times, [angle for _, angle in steps])


@given(angles, keys)
def test_a_smooth_one_goes_through_every_key(start, steps):
    times, path = smooth(start, steps)
    assert path.at(0.0) == start
    assert [path.at(time) for time in times] == pytest.approx([angle for _, angle in steps], abs=1e-9)


@given(angles, keys, st.floats(0.0, 1.0))
def test_a_smooth_one_never_leaves_the_range_of_the_keys_beside(start, steps, share):
    times, path = smooth(start, steps)
    bounds = [start, *(angle for _, angle in steps)]
    for i, (begin, end) in enumerate(zip([0.0, *times], times, strict=False)):
        low, high = sorted(bounds[i : i + 2])
        assert low - 1e-9 <= path.at(begin + share * (end - begin)) <= high + 1e-9


def test_a_smooth_one_begins_and_ends_at_rest():
    path = smooth_trajectory("HeadYaw", 0.0, [1.0], [1.0])
    assert path.at(0.01) < 0.001
    assert path.at(0.5) == pytest.approx(0.5)
    assert path.at(0.99) > 0.999


def test_a_smooth_one_passes_a_key_without_a_stop():
    path = smooth_trajectory("HeadYaw", 0.0, [1.0, 2.0], [1.0, 2.0])
    assert (path.at(1.01) - path.at(0.99)) / 0.02 == pytest.approx(1.0, rel=0.01)


@given(angles, keys)
def test_a_bezier_one_goes_through_every_key(start, steps):
    times = list(accumulate(seconds for seconds, _ in steps))
    path = Trajectory(
        "HeadYaw",
        Key(0.0, start),
        [Key(t, angle, (-0.01, 0.1), (0.01, -0.1)) for t, (_, angle) in zip(times, steps, strict=True)],
    )
    assert path.at(0.0) == start
    assert [path.at(time) for time in times] == pytest.approx([angle for _, angle in steps], abs=1e-6)


def test_a_bezier_one_follows_its_handles():
    # Handles of a third of the way at the height of their keys give Hermite's cubic from rest to rest.
    key = Key(3.0, 1.0, before=(-1.0, 0.0))
    path = Trajectory("HeadYaw", Key(0.0, 0.0), [Key(1e-9, 0.0, after=(1.0, 0.0)), key])
    for time in (0.3, 1.0, 1.5, 2.4):
        share = time / 3.0
        assert path.at(time) == pytest.approx(share * share * (3 - 2 * share), abs=1e-6)


def test_handles_beyond_the_next_key_do_not_turn_time_back():
    path = Trajectory("HeadYaw", Key(0.0, 0.0), [Key(1.0, 1.0, before=(-5.0, 0.0))])
    values = [path.at(i / 100) for i in range(101)]
    assert values == sorted(values)


@pytest.mark.parametrize("times", [[], [0.0], [-1.0], [1.0, 1.0], [2.0, 1.0], [1.0, 2.0, 3.0]])
def test_times_that_are_none(times):
    with pytest.raises(InvalidCommand, match="HeadYaw"):
        smooth_trajectory("HeadYaw", 0.0, times, [1.0, 2.0] if len(times) != 1 else [1.0])


def test_before_and_after_it_stands():
    path = smooth_trajectory("HeadYaw", 0.2, [1.0], [0.7])
    assert (path.at(-math.inf), path.at(math.inf)) == (0.2, 0.7)
