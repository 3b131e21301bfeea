"""The files of the looks of robots: shapes that fit together, of few triangles."""

import numpy as np
import pytest

from naoserver.bodies.looks import Skin, read_looks, skin_names
from naoserver.errors import RobotError
from zenoh_ice.data.toml_file import parse_toml

ROBOTS = ("booster_t1", "cart", "nao", "unitree_g1")


def parts_of(name):
    skin = read_looks(name).skin
    return [*skin.parts(), *skin.parts(shell=False)]


def triangles_of(name):
    meshes = read_looks(name).meshes
    return sum(
        len(meshes[part.shape.mesh].faces) for part in read_looks(name).skin.parts() if part.shape.mesh
    )


def volume(mesh):
    """Return the volume in m3 that a mesh encloses; negative when its faces look inwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_each_robot_has_looks():
    assert skin_names() == ROBOTS


@pytest.mark.parametrize("name", ["pepper", "../looks/nao", ""])
def test_other_names_are_refused(name):
    with pytest.raises(RobotError, match=r"no looks of .* booster_t1, cart, nao, unitree_g1"):
        read_looks(name)


@pytest.mark.parametrize("name", ROBOTS)
def test_no_mesh_and_no_material_is_missing_or_needless(name):
    shapes = [part.shape for part in parts_of(name)]
    assert {shape.mesh for shape in shapes if shape.kind == "mesh"} == set(read_looks(name).meshes)
    assert {shape.material for shape in shapes if shape.material} == set(read_looks(name).skin.materials)


@pytest.mark.parametrize(
    ("shape", "problem"),
    [
        ('kind = "disc"', "either its material or its light"),
        ('kind = "disc", material = "white", light = "Eye"', "either its material or its light"),
        ('kind = "disc", material = "pink"', "no material pink"),
    ],
)
def test_a_shape_of_no_color_or_of_two_is_refused(shape, problem):
    file = f"""
        materials.white = {{ color = [1.0, 1.0, 1.0], specular = 0.0, shininess = 0.0 }}
        mirror = {{}}
        shapes = {{ shell = [{{ link = "head", {shape} }}], blocks = [] }}
    """
    with pytest.raises(RobotError, match=f"on head: .*{problem}"):
        parse_toml(file, Skin, "looks.toml", RobotError)


@pytest.mark.parametrize("name", ROBOTS)
def test_what_closes_encloses_something_and_faces_outwards(name):
    for title, mesh in read_looks(name).meshes.items():
        assert set(np.unique(mesh.faces)) == set(range(len(mesh.vertices))), title
        edges = {(a, b) for face in mesh.faces for a, b in zip(face, np.roll(face, -1), strict=True)}
        assert len(edges) == mesh.faces.size, f"{title}: neighbors look to different sides"
        if all((b, a) in edges for a, b in edges):
            assert volume(mesh) > 1e-6, title


@pytest.mark.parametrize("name", sorted({*ROBOTS} - {"nao"}))
def test_no_robot_has_more_triangles_than_the_nao(name):
    """Without a GPU, they determine how long a picture of a camera takes."""
    assert triangles_of(name) <= triangles_of("nao")
