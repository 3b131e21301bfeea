"""What is seen of a user's model: in the simulated cameras, and by `Description` in the page."""

import base64
import json
import logging
import re

import numpy as np
import pytest

from naoserver.bodies.description import looks_of, plain_looks, write_looks
from naoserver.body import LARGEST_DESCRIPTION, write_body
from naoserver.errors import RobotError
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.meshes import cone, write_stl
from tests.support.models import FOLDER
from visualhfsm_own_robots import read_own_body
from visualhfsm_own_robots._looks import MOST_TRIANGLES, MOST_VERTICES
from visualhfsm_own_robots._meshes import LARGEST_MESH
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

ARM = (FOLDER / "painted_arm.urdf").read_text("utf-8")
BALL = '<geom type="sphere" size="0.02" group="{group}" contype="0" conaffinity="0"/>'
CUBE = """v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1
f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"""
TOML = 'model = "arm.urdf"\nmounted = true\n'


def mjcf(geoms, assets="", compiler=""):
    """Return an MJCF of one link that carries another, whose joint is beside its origin."""
    return f"""<mujoco>{compiler}<asset>{assets}</asset><worldbody><body name="base"><freejoint/>
      <geom name="touched" type="box" size="0.1 0.1 0.05" mass="1"/>
      <body name="arm" pos="0 0 0.1"><joint name="pan" axis="0 0 1" pos="0.02 0 0" actuatorfrcrange="-2 2"/>
        <inertial mass="0.5" pos="0 0 0" diaginertia="0.001 0.001 0.001"/>{geoms}
      </body></body></worldbody></mujoco>"""


@pytest.fixture
def write(tmp_path):
    """Write a model, and return the body that is read from it."""

    def written(model, toml=TOML):
        (tmp_path / "arm.urdf").write_text(model)
        (tmp_path / "my_robot.toml").write_text(toml)
        return read_own_body(tmp_path / "my_robot.toml")

    return written


@pytest.fixture
def arm(write, tmp_path):
    write_stl(tmp_path / "meshes/visual/base.stl", cone(150.0, 300.0, sides=12))
    write_stl(tmp_path / "meshes/collision/base.stl", cone(0.1, 0.2, sides=6))
    return write(ARM)


def shell(body):
    """Return link, kind, and color with opacity of what is seen of a body."""
    skin = looks_of(body).skin
    found = [(shape, skin.materials[shape.material]) for shape in skin.shapes.shell]
    return [(shape.link, shape.kind, (*material.color, material.opacity)) for shape, material in found]


def test_of_a_link_its_visual_shapes_are_seen_in_their_colors(arm):
    assert shell(arm) == [
        ("base", "mesh", pytest.approx((0.0, 0.8, 0.1, 1.0))),
        ("upper", "disc", pytest.approx((0.6, 0.0, 0.8, 0.5))),
        ("hand", "box", (0.72, 0.74, 0.77, 1.0)),
    ]


def test_meshes_of_the_same_name_in_two_folders_are_not_confused(arm):
    (mesh,) = looks_of(arm).meshes.values()
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx((0.3, 0.3, 0.3))
    box = next(shape for shape in arm.shapes if shape.link == "base").boxed()
    assert sorted(box.size) == pytest.approx([0.0866, 0.1, 0.1], abs=1e-3)  # of the hexagon of `collision`


@pytest.mark.gl
def test_the_cameras_show_them(arm):
    robot = SimulatedRobot(clock=VirtualClock(), world=load_world("empty"), body=arm)
    pixels = robot.capture("CameraOutside", 320, 240).pixels.astype(int)
    red, green, blue = np.moveaxis(pixels, 2, 0)
    robot.close()
    assert ((green > 2 * red) & (green > 2 * blue)).sum() > 300


def test_edges_of_its_meshes_stay_sharp(write, tmp_path):
    (tmp_path / "cube.obj").write_text(CUBE)
    asset, geom = '<mesh file="cube.obj"/>', '<geom type="mesh" mesh="cube"/>'
    mj = build_model(load_world("empty"), body=write(mjcf(geom, asset))).mj
    normals = mj.mesh_normal[mj.mesh_normaladr[-1] :]
    assert np.abs(normals).max(axis=1) == pytest.approx(1.0, abs=1e-3), "those of a cube's faces"


def test_the_page_gets_what_the_cameras_show(arm):
    served = json.loads(write_looks(arm))
    base, upper, hand = served["shapes"]
    vertices = np.frombuffer(
        base64.b64decode(served["meshes"][base.get("mesh", 0)]["vertices"]), "<i2"
    ).reshape(-1, 3)
    placed = vertices * served["meshUnit"] + base["position"]
    assert (placed.min(axis=0), placed.max(axis=0)) == (
        pytest.approx((-0.15, -0.15, 0.0), abs=1e-3),
        pytest.approx((0.15, 0.15, 0.3), abs=1e-3),
    )
    assert (upper["kind"], upper["size"][:2], upper["opacity"]) == ("cylinder", [0.03, 0.1], 0.5)
    assert (hand["kind"], hand["position"]) == ("box", [0.0, 0.0, 0.05])


def test_blocks_are_the_contact_shapes(arm):
    assert looks_of(arm).skin.shapes.blocks == plain_looks(arm).skin.shapes.blocks


def test_a_huge_mesh_is_served_in_a_larger_unit(write, tmp_path):
    write_stl(tmp_path / "meshes/visual/base.stl", cone(9_000.0, 300.0, sides=12))
    write_stl(tmp_path / "meshes/collision/base.stl", cone(0.1, 0.2, sides=6))
    served = json.loads(write_looks(write(ARM)))
    vertices = np.frombuffer(base64.b64decode(served["meshes"][0]["vertices"]), "<i2")
    assert np.abs(vertices * served["meshUnit"]).max() == pytest.approx(9.0, rel=1e-3)


@pytest.mark.parametrize(
    ("geoms", "seen"),
    [
        # As in models with classes `visual` and `collision`.
        (
            f'{BALL.format(group=2)}<geom type="box" size="0.1 0.1 0.1" group="3"/>',
            ["ellipsoid"],
        ),
        # As MuJoCo converts a URDF.
        (
            f'{BALL.format(group=1)}<geom type="box" size="0.1 0.1 0.1"/>',
            ["ellipsoid"],
        ),
        ('<geom type="capsule" size="0.02 0.1"/><geom type="box" size="0.1 0.1 0.1" group="2"/>', ["box"]),
        # Eyes on a shape that is touched, too.
        (
            '<geom type="sphere" size="0.02"/><geom type="cylinder" size="0.01 0.01" contype="0" conaffinity="0"/>',
            ["ellipsoid", "disc"],
        ),
        ('<geom type="box" size="0.1 0.1 0.1" group="3"/>', ["box"]),
        ('<geom type="box" size="0.1 0.1 0.1"/><geom type="sphere" size="0.3" rgba="1 0 0 0"/>', ["box"]),
    ],
)
def test_the_groups_of_an_mjcf_say_what_is_seen(write, geoms, seen):
    kinds = [kind for link, kind, _ in shell(write(mjcf(geoms))) if link == "arm"]
    assert kinds == seen


def test_a_shape_stands_in_the_frame_of_its_link_which_is_at_the_joint(write):
    body = write(mjcf('<geom type="box" size="0.1 0.1 0.1" pos="0.05 0 0.01" quat="0.5 0.5 0.5 0.5"/>'))
    shape = next(shape for shape in looks_of(body).skin.shapes.shell if shape.link == "arm")
    assert shape.at == pytest.approx((0.03, 0.0, 0.01))
    assert shape.turn == pytest.approx((0.5, 0.5, 0.5, 0.5))


def test_a_material_gives_color_and_shine(write):
    asset = '<material name="brass" rgba="0.9 0.7 0.2 1" specular="0.8" shininess="0.9" emission="0.1"/>'
    body = write(mjcf('<geom size="0.1" material="brass"/>', asset))
    shape = next(shape for shape in looks_of(body).skin.shapes.shell if shape.link == "arm")
    material = looks_of(body).skin.materials[shape.material]
    assert material.color == pytest.approx((0.9, 0.7, 0.2))
    assert (material.specular, material.shininess, material.emission) == pytest.approx((0.8, 0.9, 0.1))


def test_a_mesh_in_the_folder_of_the_compiler_is_found(write, tmp_path):
    write_stl(tmp_path / "assets/shell/arm.stl", cone(0.1, 0.2, sides=8))
    body = write(
        mjcf(
            '<geom type="mesh" mesh="arm" contype="0" conaffinity="0"/>',
            '<mesh file="shell/arm.stl"/>',
            '<compiler meshdir="assets"/>',
        )
    )
    assert [kind for link, kind, _ in shell(body) if link == "arm"] == ["mesh"]


def test_large_meshes_are_coarsened_and_it_is_said(write, tmp_path, caplog):
    whole = cone(150.0, 300.0, sides=500, rings=60)
    write_stl(tmp_path / "meshes/visual/base.stl", whole)
    write_stl(tmp_path / "meshes/collision/base.stl", cone(0.1, 0.2, sides=6))
    body = write(ARM)
    (mesh,) = looks_of(body).meshes.values()
    assert MOST_TRIANGLES / 2 < len(mesh.faces) <= MOST_TRIANGLES
    assert len(mesh.vertices) <= MOST_VERTICES
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx((0.3, 0.3, 0.3), abs=5e-3)
    assert f"my_robot is drawn with {len(mesh.faces)} of the {len(whole)} triangles" in caplog.text
    assert len(write_looks(body)) <= LARGEST_DESCRIPTION


def test_a_mesh_that_many_shapes_use_counts_as_often_as_it_is_drawn(write, tmp_path):
    write_stl(tmp_path / "arm.stl", cone(0.1, 0.2, sides=200, rings=5))
    geoms = "".join(f'<geom type="mesh" mesh="arm" pos="0 0 {number}"/>' for number in range(100))
    meshes = looks_of(write(mjcf(geoms, '<mesh file="arm.stl"/>'))).meshes
    assert len(meshes) == 1
    assert 100 * sum(len(mesh.faces) for mesh in meshes.values()) <= MOST_TRIANGLES


def test_of_a_model_with_too_many_visual_shapes_the_contact_shapes_are_seen(write, caplog):
    geoms = '<geom size="0.01" contype="0" conaffinity="0"/>' * 1001
    body = write(mjcf(f'<geom type="box" size="0.1 0.1 0.1"/>{geoms}'))
    assert [kind for _, kind, _ in shell(body)] == ["box", "box"]
    assert "drawn by its contact shapes: it has 1003 visual shapes, and at most 1000" in caplog.text


def test_of_a_mesh_that_is_too_large_or_of_another_format_the_contact_shape_is_seen(write, tmp_path, caplog):
    model = ARM.replace("visual/base.stl", "visual/base.step").replace("collision/base.stl", "big.stl")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/base.step").write_text("solid")
    (tmp_path / "meshes/big.stl").write_bytes(bytes(LARGEST_MESH + 1))
    body = write(
        model.replace("<sphere", '<box size="1 1 1"/></geometry></collision><collision><geometry><sphere', 1)
    )
    assert [link for link, _, _ in shell(body)] == ["upper", "hand"]
    assert "base.step is left out: .step is no format of meshes that is read" in caplog.text
    assert "big.stl is left out: it is larger than 30 MB" in caplog.text


def test_only_some_of_many_meshes_that_are_left_out_are_named(write, caplog):
    meshes = "".join(f'<mesh name="m{number}" file="{number}.stl"/>' for number in range(300))
    with caplog.at_level(logging.WARNING):
        write(mjcf('<geom size="0.1"/>', meshes))
    assert len(caplog.records) == 6
    assert "and 295 more such notes" in caplog.text


@pytest.mark.parametrize(
    "name", ["../secret.stl", "/secret.stl", "a/" * 40 + "../secret.stl", "x" * 5000 + ".stl"]
)
def test_meshes_outside_the_folder_are_not_read(write, tmp_path, caplog, name):
    write_stl(tmp_path.parent / "secret.stl", cone(0.1, 0.2, sides=6))
    body = write(mjcf('<geom type="mesh" mesh="m"/><geom size="0.1"/>', f'<mesh name="m" file="{name}"/>'))
    assert [kind for link, kind, _ in shell(body) if link == "arm"] == ["ellipsoid"]
    assert re.search("is left out: (there is no such file|it lies outside the folder)", caplog.text)


def test_a_link_out_of_the_folder_is_not_followed(write, tmp_path, caplog):
    write_stl(tmp_path.parent / "elsewhere.stl", cone(0.1, 0.2, sides=6))
    (tmp_path / "arm.stl").symlink_to(tmp_path.parent / "elsewhere.stl")
    write(mjcf('<geom type="mesh" mesh="arm"/><geom size="0.1"/>', '<mesh file="arm.stl"/>'))
    assert "arm.stl is left out: it lies outside the folder" in caplog.text


def test_a_mesh_that_is_cut_off_is_left_out_by_its_name(write, tmp_path, caplog):
    write_stl(tmp_path / "arm.stl", cone(0.1, 0.2, sides=6))
    (tmp_path / "arm.stl").write_bytes((tmp_path / "arm.stl").read_bytes()[:100])
    write(mjcf('<geom type="mesh" mesh="arm"/>', '<mesh file="arm.stl"/>'))
    assert "arm.stl is left out: it is cut off" in caplog.text


def test_a_body_that_no_answer_could_hold_is_refused_at_the_start(write):
    with pytest.raises(RobotError, match=r"my_robot\.toml: its description is too large: \d+ bytes"):
        write(mjcf('<geom size="0.1"/>'), f'notes = ["{"x" * LARGEST_DESCRIPTION}"]\nmodel = "arm.urdf"\n')


def test_the_looks_are_not_in_the_description_of_the_body(arm):
    assert "looks" not in json.loads(write_body(arm))


@pytest.mark.gl
def test_the_cameras_show_more_shapes_than_any_known_robot_has(write):
    rows = "".join(
        f'<geom type="box" size="0.01 0.01 0.01" pos="{x / 25:g} {y / 25:g} 0.3" rgba="0 0.9 0 1"/>'
        for x in range(-11, 12)
        for y in range(-11, 12)
    )
    blue = '<geom type="box" size="0.02 0.02 0.2" pos="0 0 0.6" rgba="0 0 1 1"/>'
    robot = SimulatedRobot(clock=VirtualClock(), world=load_world("empty"), body=write(mjcf(rows + blue)))
    red, green, blue = np.moveaxis(robot.capture("CameraOutside", 320, 240).pixels.astype(int), 2, 0)
    robot.close()
    assert ((blue > 2 * red) & (blue > 2 * green)).sum() > 20, "the last of 530 shapes is missing"
