"""Meshes are found in the folders of a model, and brought into a format of MuJoCo."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from tests.support.meshes import cone, write_stl
from visualhfsm_own_robots import _meshes as meshes
from visualhfsm_own_robots._meshes import Files, MeshError, packages_near, read_mesh
from visualhfsm_own_robots._model_file import read_model

CUBE = """v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1
f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"""
POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 84284\n"
KINDS = ("stl", "obj", "msh", "dae", "ply", "off", "glb")
POINT = (
    b"ply\nformat ascii 1.0\nelement vertex 1\n"
    + b"".join(b"property float %c\n" % axis for axis in b"xyz")
    + b"end_header\n1 2 3\n"
)
TRIANGLES = cone(0.1, 0.2, sides=6)


@pytest.fixture
def files(tmp_path):
    """The files of a model that lies in a ROS package beside another one."""
    for package in ("arm_description", "hand_description", "elsewhere"):
        (tmp_path / "ws" / package).mkdir(parents=True)
    for package in ("arm_description", "hand_description"):
        (tmp_path / "ws" / package / "package.xml").write_text(
            f"<package><name>{package[:-12]}</name></package>"
        )
    model = tmp_path / "ws/arm_description/urdf/arm.urdf"
    return Files(model, model.parent, packages_near(model))


def place(tmp_path, name):
    path = tmp_path / "ws" / name
    write_stl(path, TRIANGLES)
    return path


@pytest.mark.parametrize(
    ("name", "where"),
    [
        ("a.stl", "arm_description/urdf/a.stl"),
        ("../meshes/a.stl", "arm_description/meshes/a.stl"),
        ("package://arm/meshes/v/a.stl", "arm_description/meshes/v/a.stl"),
        ("package://arm_description/meshes/v/a.stl", "arm_description/meshes/v/a.stl"),
        ("model://arm/a.stl", "arm_description/a.stl"),
        ("package://other_name/meshes/v/a.stl", "arm_description/meshes/v/a.stl"),
        ("package://hand/meshes/a.stl", "hand_description/meshes/a.stl"),
        ("file:///opt/robot/meshes/a.stl", "arm_description/meshes/a.stl"),
        ("C:\\robot\\meshes\\a.stl", "arm_description/meshes/a.stl"),
    ],
)
def test_a_mesh_is_found_in_the_packages_of_a_model(files, tmp_path, name, where):
    path = place(tmp_path, where)
    assert files.find(name, files.model) == path


@pytest.mark.parametrize(
    ("name", "where"),
    [
        ("../parts/meshes/a.stl", "parts/meshes/a.stl"),
        ("package://robot/meshes/a.stl", "urdf/meshes/a.stl"),
        ("package://ws/urdf/stl/a.stl", "urdf/stl/a.stl"),
        ("../parts/deep/down/meshes/a.stl", "parts/deep/down/meshes/a.stl"),
    ],
)
def test_without_a_package_it_is_found_beside_the_model(tmp_path, name, where):
    model = tmp_path / "ws/urdf/arm.urdf"
    model.parent.mkdir(parents=True)
    path = place(tmp_path, where)
    assert Files(model, model.parent).find(name, model) == path


def test_of_several_with_one_name_the_folder_counts(files, tmp_path):
    seen = place(tmp_path, "arm_description/meshes/visual/a.stl")
    touched = place(tmp_path, "arm_description/meshes/collision/a.stl")
    assert files.find("package://x/meshes/visual/a.stl", files.model) == seen
    assert files.find("package://x/meshes/collision/a.stl", files.model) == touched


@pytest.mark.parametrize("name", ["../../elsewhere/a.stl", "WS/elsewhere/a.stl", "package://elsewhere/a.stl"])
def test_what_lies_elsewhere_is_not_read(files, tmp_path, name):
    place(tmp_path, "elsewhere/a.stl")
    with pytest.raises(MeshError, match=r"there is no such file|it lies outside"):
        files.find(name.replace("WS", str(tmp_path / "ws")), files.model)


def test_a_link_to_elsewhere_is_not_followed(files, tmp_path):
    secret = place(tmp_path, "elsewhere/a.stl")
    files.model.parent.mkdir()
    (files.model.parent / "a.stl").symlink_to(secret)
    with pytest.raises(MeshError, match="it lies outside the folder of the model"):
        files.find("a.stl", files.model)


def test_a_link_beside_the_model_is_not_followed(tmp_path):
    place(tmp_path, "elsewhere/a.stl")
    model = tmp_path / "ws/urdf/arm.urdf"
    model.parent.mkdir(parents=True)
    (tmp_path / "ws/meshes").symlink_to(tmp_path / "ws/elsewhere")
    with pytest.raises(MeshError, match="it lies outside the folder of the model"):
        Files(model, model.parent).find("../meshes/a.stl", model)


def test_a_link_to_a_package_does_not_hide_it(tmp_path):
    (tmp_path / "ws").mkdir()
    (tmp_path / "ws/first").symlink_to(tmp_path / "ws/hand_description")  # listed before it, or the other is
    model = tmp_path / "ws/arm/arm.urdf"
    path = place(tmp_path, "hand_description/a.stl")
    for package in (path.parent, model.parent):
        package.mkdir(exist_ok=True)
        (package / "package.xml").write_text("<package/>")
    (path.parent / "package.xml").write_text("<package><name>hand</name></package>")
    (tmp_path / "ws/second").symlink_to(tmp_path / "ws/hand_description")
    assert Files(model, model.parent, packages_near(model)).find("package://hand/a.stl", model) == path


@pytest.mark.parametrize(
    "name",
    [
        "package://home/ana/private/a.stl",
        "package://ana/private/a.stl",
        "model://ana/private/a.stl",
        "package://robots/../private/a.stl",
        "package://ana/private/meshes/a.stl",
        "../private/meshes/a.stl",
        "package://ana/meshes/a.stl",
        "../assets/a.stl",
    ],
)
def test_a_model_in_a_home_folder_reads_no_other_of_its_folders(tmp_path, monkeypatch, name):
    home = tmp_path / "home/ana"
    for where in ("private/a.stl", "private/meshes/a.stl", "meshes/a.stl", "assets/a.stl"):
        write_stl(home / where, TRIANGLES)
    monkeypatch.setenv("HOME", str(home))
    model = home / "robots/r.urdf"
    model.parent.mkdir()
    with pytest.raises(MeshError, match=r"it lies outside the folder of the model"):
        Files(model, model.parent, packages_near(model)).find(name, model)


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("package://arm/meshes/v/a.stl", True),
        ("package://arm/meshes_old/a.stl", True),
        ("package://arm/parts/a.stl", False),
        ("package://arm/parts/meshes/a.stl", False),
        ("package://arm/meshes/../parts/a.stl", False),
        ("package://arm/meshes/link/a.stl", False),
        ("package://ws/parts/meshes/a.stl", False),
        ("package://ws/arm/meshes/v/a.stl", False),
        ("../../parts/a.stl", False),
    ],
)
def test_of_a_folder_above_the_model_only_meshes_are_read(tmp_path, name, read):
    model = tmp_path / "ws/arm/robots/one/arm.urdf"
    model.parent.mkdir(parents=True)
    for where in ("meshes/v/a.stl", "meshes_old/a.stl", "parts/a.stl", "parts/meshes/a.stl"):
        place(tmp_path, f"arm/{where}")
    (tmp_path / "ws/arm/meshes/link").symlink_to(tmp_path / "ws/arm/parts")
    place(tmp_path, "parts/meshes/a.stl")
    files = Files(model, model.parent, packages_near(model))
    if read:
        assert files.find(name, model).is_file()
        return
    with pytest.raises(MeshError, match=r"it lies outside the folder of the model"):
        files.find(name, model)


@pytest.mark.parametrize("top", ["thing", "other"])
def test_a_package_may_be_laid_out_as_it_is_installed(tmp_path, top):
    model = tmp_path / "ws" / top / "share/thing/robots/a/model.urdf"
    model.parent.mkdir(parents=True)
    (tmp_path / "ws" / top / "package.xml").write_text("<package><name>thing</name></package>")
    path = place(tmp_path, f"{top}/share/thing/meshes/sub/c.stl")
    files = Files(model, model.parent, packages_near(model))
    assert files.find("package://thing/meshes/sub/c.stl", model) == path
    place(tmp_path, "elsewhere/c.stl")
    with pytest.raises(MeshError, match=r"it lies outside the folder of the model"):
        files.find("package://thing/../../../elsewhere/c.stl", model)


def test_a_package_that_says_no_name_has_that_of_its_folder(tmp_path):
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm/package.xml").write_text("<package/>")
    assert packages_near(tmp_path / "arm/r.urdf") == {"arm": tmp_path / "arm"}


def test_a_pipe_is_no_package(tmp_path):
    os.mkfifo(tmp_path / "package.xml")
    assert packages_near(tmp_path / "r.urdf") == {}


@pytest.mark.parametrize(
    "name", ["", "/", "..", "a/" * 5000, "x" * 5000, "a\0b.stl", "package://", "file://"]
)
def test_odd_names_are_those_of_no_file(files, name):
    with pytest.raises(MeshError, match="there is no such file"):
        files.find(name, files.model)


def test_a_mesh_that_is_named_twice_is_read_once(files, tmp_path):
    place(tmp_path, "arm_description/meshes/a.stl")
    assert files.mesh("a.stl", files.model) == files.mesh("package://arm/meshes/a.stl", files.model)
    assert list(files.assets) == ["0.stl"]


def test_more_files_and_larger_ones_than_allowed_are_left_out(files, tmp_path, monkeypatch):
    monkeypatch.setattr(meshes, "_MOST_FILES", 1)
    for name in "ab":
        place(tmp_path, f"arm_description/meshes/{name}.stl")
        files.mesh(f"{name}.stl", files.model)
    assert files.left_out == {"b.stl": "it is one of more than 1 files"}


def test_after_many_that_are_not_there_no_more_are_looked_for(files, tmp_path, monkeypatch):
    monkeypatch.setattr(meshes, "_MOST_FILES", 2)
    place(tmp_path, "arm_description/meshes/a.stl")
    found = [files.mesh(name, files.model) for name in ("none.stl", "a.stl", "none.stl", "a.stl", "a.stl")]
    assert [each is not None for each in found] == [False, True, False, False, False]
    assert files.left_out["a.stl"] == "it comes after 2 that cannot be used"


def test_a_file_that_is_too_large_is_not_read_whole(files, tmp_path, monkeypatch):
    monkeypatch.setattr(meshes, "LARGEST_MESH", 1 << 20)
    path = place(tmp_path, "arm_description/meshes/a.stl")
    with path.open("ab") as file:
        file.truncate(1 << 40)
    assert files.mesh("a.stl", files.model) is None
    assert files.left_out == {"a.stl": "it is larger than 1 MB"}


def test_a_mesh_that_is_gone_when_it_is_read_is_left_out(files, tmp_path, monkeypatch):
    gone = tmp_path / "ws/arm_description/meshes/a.stl"
    monkeypatch.setattr(files, "find", lambda *_: gone)
    assert files.mesh("a.stl", files.model) is None
    assert files.left_out == {"a.stl": "it cannot be read: No such file or directory"}


def test_a_mesh_counts_as_often_as_it_is_used(files, tmp_path, monkeypatch):
    monkeypatch.setattr(meshes, "_MOST_USED", 3000)
    place(tmp_path, "arm_description/meshes/a.stl")
    used = [files.mesh("a.stl", files.model) for _ in range(30)]
    assert used[0] is not None
    assert used[-1] is None
    assert "each as often as it is used" in files.left_out["a.stl"]


def ascii_stl(triangles):
    facets = "".join(
        "facet normal 0 0 1\n outer loop\n"
        + "".join("  vertex {:e} {:e} {:e}\n".format(*corner) for corner in triangle)
        + " endloop\nendfacet\n"
        for triangle in triangles
    )
    return f"solid cone\n{facets}endsolid cone\n"


def corners(mesh):
    return np.frombuffer(mesh.content, meshes._TRIANGLE, offset=84)["corners"]


def exported(kind):
    trimesh = pytest.importorskip("trimesh")
    solid = trimesh.Trimesh(
        TRIANGLES.reshape(-1, 3), np.arange(TRIANGLES.size // 3).reshape(-1, 3), process=False
    )
    solid.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.SimpleMaterial())
    content = solid.export(file_type=kind)
    return content if isinstance(content, bytes) else content.encode()


def test_an_stl_of_text_becomes_a_binary_one(tmp_path):
    (tmp_path / "a.STL").write_text(ascii_stl(TRIANGLES))
    assert corners(read_mesh(tmp_path / "a.STL")) == pytest.approx(TRIANGLES, abs=1e-6)


def test_an_stl_may_be_written_in_capitals(tmp_path):
    (tmp_path / "a.stl").write_text(ascii_stl(TRIANGLES).upper())
    assert corners(read_mesh(tmp_path / "a.stl")) == pytest.approx(TRIANGLES, abs=1e-6)


@pytest.mark.sim
@pytest.mark.parametrize(
    "changed",
    [
        CUBE.replace("f 1 2", "o second\nf 1 2").replace("f 2 4", "g third group\nf 2 4"),
        "\ufeffo first\n" + CUBE.replace("f 1 2", "o second\nf 1 2"),
        CUBE.replace("f 1 3 4 2", "vt 0 0\nf 1/1 3/1 4/1 2/1"),
        CUBE.replace("f 1 2", "g\nf 1 2").replace("\n", "\r\n"),
    ],
)
def test_of_an_obj_all_is_read(tmp_path, changed):
    (tmp_path / "a.obj").write_bytes(changed.encode())
    (tmp_path / "r.xml").write_text(
        '<mujoco><asset><mesh name="a" file="a.obj"/></asset><worldbody><body><geom type="mesh" mesh="a"/>'
        "<body><joint/><geom size='1'/></body></body></worldbody></mujoco>"
    )
    model = read_model(tmp_path / "r.xml", tmp_path)
    assert (model.compiled.nmeshface, model.compiled.nmeshvert, model.notes) == (12, 8, ())


@pytest.mark.parametrize("kind", ["dae", "ply", "off", "glb"])
def test_other_formats_become_an_stl(tmp_path, kind):
    (tmp_path / f"a.{kind}").write_bytes(exported(kind))
    found = corners(read_mesh(tmp_path / f"a.{kind}")).reshape(-1, 3)
    assert (found.min(axis=0), found.max(axis=0)) == (
        pytest.approx(TRIANGLES.reshape(-1, 3).min(axis=0), abs=1e-6),
        pytest.approx(TRIANGLES.reshape(-1, 3).max(axis=0), abs=1e-6),
    )


def test_the_unit_and_the_colors_of_a_collada_file_count(tmp_path):
    content = exported("dae").replace(b"<up_axis>", b'<unit meter=" 0.01 "/><up_axis>')
    content = re.sub(rb"(<diffuse>\s*<color>)[^<]*", rb"\g<1>1 0 0 1", content)
    (tmp_path / "a.dae").write_bytes(content)
    mesh = read_mesh(tmp_path / "a.dae")
    assert np.ptp(corners(mesh).reshape(-1, 3), axis=0)[2] == pytest.approx(0.002)
    assert mesh.color == pytest.approx((1.0, 0.0, 0.0, 1.0))


def test_a_collada_file_whose_material_is_missing_keeps_its_triangles(tmp_path):
    content = re.sub(rb'(<instance_material[^>]*target=")#[^"]*', rb"\g<1>#lost", exported("dae"))
    (tmp_path / "a.dae").write_bytes(content)
    assert corners(read_mesh(tmp_path / "a.dae")).shape == TRIANGLES.shape


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("a.stl", b"", "it is empty"),
        ("a.stl", bytes(84), "it has no triangles"),
        ("a.stl", bytes(80) + b"\x05\0\0\0" + bytes(60), "it is cut off"),
        ("a.stl", bytes(80) + (200_001).to_bytes(4, "little") + bytes(50 * 200_001), "200001 triangles"),
        ("a.stl", b"solid nothing\nendsolid\n", "it has 0 triangles"),
        ("a.stl", b"solid\nvertex 0 0 x\n" * 3, "cut off, or has a vertex that is no number"),
        ("a.dae", b"<COLLADA>", "it is broken"),
        ("a.ply", POINT, "it has no triangles"),
        ("a.dae", b'<!DOCTYPE c [<!ENTITY e "x">]><COLLADA/>', "a document type"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 999999999999\n", "it is broken"),
        ("a.glb", b"glTF" + bytes(20), "it is broken"),
        *((f"a.{kind}", POINTER, "it is a pointer of Git LFS: run git lfs pull") for kind in KINDS),
        ("a.step", b"x", ".step is no format of meshes that is read"),
    ],
)
def test_a_mesh_that_cannot_be_used_says_why(tmp_path, name, content, problem):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshError, match=problem):
        read_mesh(tmp_path / name)


def test_without_the_library_it_is_said_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    Path(tmp_path / "a.dae").write_text("<COLLADA/>")
    with pytest.raises(MeshError, match=r"for \.dae files, pip install 'visualhfsm\[models\]'"):
        read_mesh(tmp_path / "a.dae")
