from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver_sim.mesh import Section, loft

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
