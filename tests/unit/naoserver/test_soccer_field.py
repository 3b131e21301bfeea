"""The model of a soccer field."""

import numpy as np
import pytest

from naoserver.soccer_field import Field, FieldLines


@pytest.mark.parametrize(
    ("point", "off"),
    [
        ((0.0, 2.0), 0.0),
        ((0.1, 2.0), 0.1),
        ((4.6, -1.0), 0.1),  # beyond the goal line
        ((-2.0, 3.2), 0.2),
        ((4.5 - 1.65, 1.9), 0.0),
        ((-3.9, -1.0), 0.0),
        ((0.85, 0.0), 0.1),  # outside the circle
        ((0.0, 0.75), 0.0),
        ((3.2, 0.2), 0.175),  # from the end of the penalty mark
    ],
)
def test_it_knows_how_far_a_point_is_off_the_nearest_line(point, off):
    (found,), (normal,) = FieldLines(Field()).offsets(np.array([point]))
    assert abs(found) == pytest.approx(off, abs=1e-6)
    there = np.array([np.array(point) - found * normal])
    assert FieldLines(Field()).offsets(there)[0] == pytest.approx(0.0, abs=1e-6)
    assert np.hypot(*normal) == pytest.approx(1.0)


def test_the_samples_lie_on_the_lines_of_the_whole_field():
    lines = FieldLines(Field(length=6.0, width=4.0))
    off, _ = lines.offsets(lines.samples)
    assert off == pytest.approx(0.0, abs=1e-6)
    assert np.abs(lines.samples).max(axis=0) == pytest.approx((3.0, 2.0), abs=0.05)


def test_posts_stand_beside_the_goals():
    assert Field(length=6.0, goal_width=1.0).posts == ((3.0, 0.55), (3.0, -0.55), (-3.0, 0.55), (-3.0, -0.55))
