from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver_sim.mesh import Section, band, loft, panel

lengths = st.floats(0.005, 0.1)
sections = st.lists(
    st.builds(
        lambda half, center, squareness: (half, center, squareness),
        st.tuples(lengths, lengths),
        st.tuples(st.floats(-0.01, 0.01), st.floats(-0.01, 0.01)),
        st.floats(2.0, 3.0),
    ),
    min_size=2,
    max_size=5,
)


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def edges(mesh):
    return Counter(
        (int(face[corner]), int(face[(corner + 1) % 3])) for face in mesh.faces for corner in range(3)
    )


@given(sections, st.sampled_from("xyz"), st.booleans())
def test_a_loft_is_closed_and_faces_outward(shapes, axis, domed):
    mesh = loft(
        [Section(0.03 * i, *shape) for i, shape in enumerate(shapes)],
        axis=axis,
        domes=(0.01, 0.01) if domed else (0.0, 0.0),
    )
    counted = edges(mesh)
    assert set(counted.values()) == {1}
    assert all((end, start) in counted for start, end in counted)
    assert volume(mesh) > 0


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_straight_loft_has_the_volume_of_a_cylinder(axis):
    mesh = loft([Section(0.0, (0.1, 0.1)), Section(0.5, (0.1, 0.1))], axis=axis, slices=64)
    assert volume(mesh) == pytest.approx(np.pi * 0.1**2 * 0.5, rel=0.01)
    assert np.ptp(mesh.vertices, axis=0)["xyz".index(axis)] == pytest.approx(0.5)


def test_a_mirror_image_faces_outward_too():
    mesh = loft([Section(0.0, (0.1, 0.05), (0.0, 0.02)), Section(0.2, (0.1, 0.05))])
    assert volume(mesh.mirrored()) == pytest.approx(volume(mesh))
    assert mesh.mirrored().vertices[:, 1] == pytest.approx(-mesh.vertices[:, 1])


PIPE = [Section(-0.1, (0.05, 0.05), (0.01, 0.0)), Section(0.1, (0.05, 0.05), (0.01, 0.0))]


def from_axis(points, axis):
    """How far points are from the axis of the pipe."""
    first, second = (("xyz".index(axis) + step) % 3 for step in (1, 2))
    return np.hypot(points[:, first] - 0.01, points[:, second])


@pytest.mark.parametrize("angle", [(-50.0, 50.0), (60.0, 120.0), (130.0, 230.0)])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_panel_lies_above_its_loft_and_faces_outward(angle, axis):
    plate = panel(PIPE, at=(-0.06, 0.06), angle=angle, axis=axis, lift=0.002, grid=(9, 9))
    top = slice(0, 9 * 9)
    assert from_axis(plate.vertices[top], axis) == pytest.approx(0.052, abs=1e-6)
    assert from_axis(plate.vertices[9 * 9 :], axis) == pytest.approx(0.048, abs=1e-6)
    a, b, c = (plate.vertices[plate.faces[: 2 * 8 * 8, corner]] for corner in range(3))
    outside = (a + b + c) / 3 + 1e-3 * np.cross(b - a, c - a) / np.linalg.norm(
        np.cross(b - a, c - a), axis=1, keepdims=True
    )
    assert (from_axis(outside, axis) > from_axis((a + b + c) / 3, axis)).all()


def test_a_panel_reaches_as_far_as_it_is_told():
    plate = panel(PIPE, at=(-0.03, 0.05), angle=(-30.0, 30.0), lift=0.0)
    assert plate.vertices[:, 2].min() == pytest.approx(-0.03)
    assert plate.vertices[:, 2].max() == pytest.approx(0.05)
    turns = np.degrees(np.arctan2(plate.vertices[:, 1], plate.vertices[:, 0] - 0.01))
    assert turns.min() == pytest.approx(-30.0, abs=0.1)
    assert turns.max() == pytest.approx(30.0, abs=0.1)


def test_a_band_is_thicker_than_its_loft_all_round():
    ring = band(PIPE, at=(-0.005, 0.005), lift=0.001, slices=40)
    assert from_axis(ring.vertices[:-2], "z") == pytest.approx(0.051, abs=1e-6)
    assert np.ptp(ring.vertices[:, 2]) == pytest.approx(0.01)
    assert volume(ring) > 0
