"""Outlines of soles, and the points within them."""

import numpy as np
import pytest

from naoserver_sim.support_polygon import convex_hull, nearest_within, room_within

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def test_a_hull_has_the_outer_points_only():
    inner = [[0.5, 0.5], [0.5, 0.0], [0.2, 0.7]]
    hull = convex_hull(np.concatenate([SQUARE, inner]))
    assert sorted(map(tuple, hull.tolist())) == sorted(map(tuple, SQUARE.tolist()))


def test_a_hull_is_counter_clockwise():
    hull = convex_hull(SQUARE[::-1])
    edges = np.roll(hull, -1, axis=0) - hull
    following = np.roll(edges, -1, axis=0)
    assert (edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0] > 0.0).all()


@pytest.mark.parametrize(
    ("point", "nearest"),
    [
        ((0.5, 0.4), (0.5, 0.4)),
        ((0.5, 3.0), (0.5, 0.9)),
        ((0.05, 0.5), (0.1, 0.5)),
        ((-1.0, 2.0), (0.1, 0.9)),
    ],
)
def test_a_point_is_moved_into_the_polygon_and_off_its_edges(point, nearest):
    found = nearest_within(SQUARE, np.array(point), 0.1)
    assert found.tolist() == pytest.approx(nearest, abs=1e-3)


def test_a_polygon_without_room_for_the_margin_still_gives_a_point():
    found = nearest_within(SQUARE * 0.1, np.array([0.3, 0.05]), 0.2)
    assert np.isfinite(found).all()


def test_the_room_is_the_distance_from_the_nearest_edge():
    rooms = [room_within(SQUARE, np.array(point)) for point in ((0.5, 0.4), (0.9, 0.5), (1.2, 0.5))]
    assert rooms == pytest.approx([0.4, 0.1, -0.2])
