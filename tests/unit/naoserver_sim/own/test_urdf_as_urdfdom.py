"""What urdfdom, the reader of ROS, takes of a URDF is served, and what it leaves is said.

What it takes was seen with urdfdom 6.0.0 in Pinocchio 4.1.0 (`pin.buildModelFromXML`).
"""

import math

import mujoco
import pytest

from naoserver_sim._own.model_file import read_model
from naoserver_sim.appearance import NO_COLOR, color_of
from tests.support.meshes import cone, write_stl
from tests.support.robot_files import BOX, INERTIAL, joint, link

pytestmark = pytest.mark.sim

BASE, ARM, SHOULDER = link("base"), link("arm"), joint("shoulder", "base", "arm")
BLACK = '<material name="black"><color rgba="0 0 0 1"/></material>'
WHITE = '<material name="white"><color rgba="1 1 1 1"/></material>'
CUBE = '<geometry><box size="0.1 0.1 0.1"/></geometry>'


@pytest.fixture
def read(tmp_path):
    def written(*parts, version=""):
        of = f' version="{version}"' if version else ""
        (tmp_path / "r.urdf").write_text(f'<robot name="r"{of}>\n' + "".join(parts) + "</robot>\n")
        return read_model(tmp_path / "r.urdf", tmp_path)

    return written


def test_of_two_materials_the_first_is_seen_and_it_is_said_once(read):
    seen = f"<visual>{CUBE}{BLACK}{WHITE}</visual>"
    model = read(link("base", BOX + seen), link("arm", BOX + seen + seen), SHOULDER)
    colors = [color_of(model.compiled, geom) for geom in (1, 3, 4)]
    assert colors == [(0.0, 0.0, 0.0, 1.0)] * 3
    said = "r.urdf:2: a second <material> in one <visual>, and 2 more such: the first one counts"
    assert [note.endswith(said) for note in model.notes] == [True]


def colors_of(model):
    return [color_of(model.compiled, geom) for geom in range(model.compiled.ngeom)]


def test_a_visual_without_a_color_does_not_get_that_of_the_one_before_it(read):
    texture = '<material name="cloth"><texture filename="cloth.png"/></material>'
    seen = [BLACK, "", '<material name="unknown"/>', texture, '<material name=""/>']
    shapes = "".join(f"<visual>{CUBE}{material}</visual>" for material in seen)
    model = read(link("base", shapes), link("arm", f"<visual>{CUBE}</visual>"), SHOULDER)
    assert colors_of(model) == [(0.0, 0.0, 0.0, 1.0), *[NO_COLOR] * 5]


def test_a_material_has_the_color_that_its_name_has_first(read):
    red, blue = (WHITE.replace("1 1 1 1", rgba) for rgba in ("1 0 0 1", "0 0 1 1"))
    seen = link("base", f"<visual>{CUBE}{blue}</visual><visual>{CUBE}<material name='white'/></visual>")
    assert colors_of(read(seen, ARM, SHOULDER, red))[:2] == [(1.0, 0.0, 0.0, 1.0)] * 2
    unnamed = "".join(f"<visual>{CUBE}{each.replace('white', '')}</visual>" for each in (red, blue))
    assert colors_of(read(link("base", unnamed), ARM, SHOULDER))[:2] == [
        (1.0, 0.0, 0.0, 1.0),
        (0.0, 0.0, 1.0, 1.0),
    ]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("<inertial>", INERTIAL + "<inertial>"),
        ("<mass", '<mass value="1"/><mass'),
        ("<inertia ", '<inertia ixx="0.01" iyy="0.01" izz="0.002" ixy="0" ixz="0" iyz="0"/><inertia '),
        ("<geometry>", f"{CUBE}<geometry>"),
        ("<box", '<box size="0.1 0.1 0.1"/><sphere radius="2"/><box'),
        ('<origin xyz="0 0 0.2"', '<origin xyz="0 0 0.2"/><origin xyz="1 1 1"'),
        ("<parent", '<parent link="base"/><parent'),
        ("<child", '<child link="arm"/><child'),
        ("<axis", '<axis xyz="0 1 0"/><axis'),
        ("<limit", '<limit lower="-1" upper="1" effort="5" velocity="2"/><limit'),
        ("</joint>", '<dynamics damping="1"/><dynamics damping="2"/></joint>'),
    ],
)
def test_of_what_may_be_there_once_the_first_counts(read, old, new):
    plain, arm = BASE + ARM + SHOULDER, BASE + ARM + SHOULDER
    changed = read(arm[::-1].replace(old[::-1], new[::-1], 1)[::-1])
    before, after = read(plain).compiled, changed.compiled
    for what in ("body_mass", "body_ipos", "body_pos", "geom_size", "jnt_axis", "jnt_range"):
        assert getattr(after, what).tolist() == getattr(before, what).tolist()
    assert after.dof_damping.tolist() == ([1.0] if "dynamics" in new else [0.0])
    assert ": a second <" in changed.notes[0]


def test_of_two_shapes_of_other_kinds_the_first_counts(read):
    both = '<geometry><sphere radius="0.07"/><box size="1 1 1"/></geometry>'
    model = read(BASE, link("arm", f"<collision>{both}</collision>"), SHOULDER)
    assert model.compiled.geom_size[1].tolist() == [0.07, 0.0, 0.0]
    assert model.notes[0].endswith("r.urdf:3: a second <box> in one <geometry>: the first one counts")


@pytest.mark.parametrize(
    ("quaternion", "turned"),
    [
        ("0 0.7071068 0 0.7071068", (0.70710678, 0.0, 0.70710678, 0.0)),
        ("0 0 3 0", (0.0, 0.0, 0.0, 1.0)),  # of any length
        ("0 0 0 0", (1.0, 0.0, 0.0, 0.0)),
        ("0 0 1e300 0", (0.0, 0.0, 0.0, 1.0)),
        ("0 0 1e-30 0", (0.0, 0.0, 0.0, 1.0)),
        ("0.1 -0.2 0.3 0.9", (0.92338, 0.10260, -0.20520, 0.30779)),
        ("0.5 0.5 -0.5 0.5", (0.5, 0.5, 0.5, -0.5)),  # pitch 90 degrees
        ("0.5 -0.5 0.5 0.5", (0.5, 0.5, -0.5, 0.5)),
    ],
)
def test_a_quaternion_turns_as_rpy_does(read, quaternion, turned):
    turning = SHOULDER.replace('rpy="0 0 0"', f'quat_xyzw="{quaternion}"')
    assert read(BASE, ARM, turning, version="1.1").compiled.body("arm").quat == pytest.approx(
        turned, abs=1e-5
    )


def test_a_quaternion_turns_shapes_inertias_and_sensors_too(read):
    pose = '<origin xyz="0 0 0.1" quat_xyzw="0 0 0.7071068 0.7071068"/>'
    shape = f'<collision>{pose}<geometry><box size="0.1 0.2 0.1"/></geometry></collision>'
    heavy = INERTIAL.replace('<origin xyz="0 0 0.1"/>', pose).replace('ixx="0.01"', 'ixx="0.009"')
    eye = f'<sensor name="eye"><parent link="arm"/>{pose}<camera/></sensor>'
    model = read(BASE, link("arm", shape, heavy), SHOULDER, eye, version="1.2")
    assert model.compiled.geom_quat[1] == pytest.approx((0.70710678, 0.0, 0.0, 0.70710678))
    inertia = mujoco.MjData(model.compiled)
    mujoco.mj_forward(model.compiled, inertia)
    frame = inertia.ximat[2].reshape(3, 3)
    tensor = frame @ (model.compiled.body_inertia[2][:, None] * frame.T)
    assert tensor.diagonal() == pytest.approx((0.01, 0.009, 0.002), abs=1e-6)
    assert model.sensors[0].pose == pytest.approx((0.0, 0.0, 0.1, 0.0, 0.0, math.pi / 2), abs=1e-6)


@pytest.mark.parametrize("version", ["1.1", " 1.1", "1.2", "1.10", "2", "1.1.0"])
def test_a_newer_urdf_has_quaternions(read, version):
    model = read(BASE, ARM, SHOULDER.replace('rpy="0 0 0"', 'quat_xyzw="0 0 1 0"'), version=version)
    assert model.compiled.body("arm").quat == pytest.approx((0.0, 0.0, 0.0, 1.0))
    assert model.notes == ()


@pytest.mark.parametrize("version", ["", "1.0", " 1.0 ", "1"])
def test_an_old_urdf_has_no_quaternions(read, version):
    model = read(BASE, ARM, SHOULDER.replace('rpy="0 0 0"', 'quat_xyzw="0 1 0 1"'), version=version)
    assert model.compiled.body("arm").quat.tolist() == [1.0, 0.0, 0.0, 0.0]
    assert model.notes[0].endswith(
        "r.urdf:5: quat_xyzw is not read: it counts in URDFs of version 1.1 and newer"
    )


def test_limits_that_a_simulated_joint_has_not_are_named(read):
    model = read(BASE, ARM, SHOULDER.replace("effort", 'jerk="9" acceleration="3" effort'), version="1.2")
    assert model.notes[0].endswith(
        "r.urdf:6: of limits, acceleration, jerk are not kept: torques limit how joints move"
    )


@pytest.mark.parametrize(
    ("shape", "why"),
    [
        ('<box size="0.1"/>', "size of its <box> is '0.1', not 3 numbers"),
        ('<box size="0.1 0.1 0.1 0.1"/>', "size of its <box> is '0.1 0.1 0.1 0.1', not 3 numbers"),
        ('<box size="1 1 wide"/>', "size of its <box> is '1 1 wide', not 3 numbers"),
        ('<cylinder radius="0.1"/>', "length of its <cylinder> is '', not a number"),
        ('<mesh filename="a.stl" scale="2"/>', "scale of its <mesh> is '2', not 3 numbers"),
    ],
)
def test_a_shape_with_other_sizes_is_left_out(read, shape, why):
    model = read(BASE, link("arm", f"{BOX}<visual><geometry>{shape}</geometry></visual>"), SHOULDER)
    assert model.compiled.ngeom == 2
    assert model.notes[0].endswith(f"r.urdf:3: a <visual> of link 'arm' is left out: {why}")


@pytest.mark.parametrize("color", ["0 0 0", "1 0 0 1 1", "red"])
def test_a_color_that_is_none_is_left_out(read, color):
    model = read(
        BASE, link("arm", f"{BOX}<visual>{CUBE}{BLACK.replace('0 0 0 1', color)}</visual>"), SHOULDER
    )
    assert model.compiled.ngeom == 3
    assert model.notes[0].endswith(f"r.urdf:3: a color is left out: its rgba is {color!r}, not 4 numbers")


@pytest.mark.parametrize(
    ("leader", "why"),
    [
        ("nobody", "there is no joint 'nobody'"),
        ("shoulder", "that is itself"),
        ("mount", "joint 'mount' is fixed"),
        ("table", "joint 'table' is planar"),
    ],
)
def test_a_joint_without_a_leader_moves_by_itself(read, leader, why):
    follower = joint("shoulder", "base", "arm", f'<mimic joint="{leader}"/>')
    others = joint("mount", "arm", "hand", kind="fixed"), joint("table", "arm", "plate", kind="planar")
    model = read(BASE, ARM, link("hand"), link("plate"), follower, *others)
    assert model.compiled.neq == 0
    note = f"r.urdf:8: joint 'shoulder' moves by itself, not after {leader!r}: {why}"
    assert [each.endswith(note) for each in model.notes] == [True]


def test_of_a_leader_of_what_does_not_move_nothing_is_said(read):
    mount = joint("mount", "arm", "hand", '<mimic joint="nobody"/>', kind="fixed")
    assert read(BASE, ARM, link("hand"), SHOULDER, mount).notes == ()


def test_a_color_that_says_nothing_is_left_out_without_a_word(read):
    seen = f'<visual>{CUBE}<material name="none"><color/></material></visual>'
    model = read(BASE, link("arm", BOX + seen), SHOULDER)
    assert (model.compiled.ngeom, model.notes) == (3, ())


def test_a_mesh_may_be_mirrored_by_its_scale(read, tmp_path):
    write_stl(tmp_path / "a.stl", cone(0.1, 0.2, sides=6))
    mesh = '<visual><geometry><mesh filename="a.stl" scale="1 -1 1"/></geometry></visual>'
    model = read(BASE, link("arm", BOX + mesh), SHOULDER)
    assert (model.compiled.ngeom, model.notes, model.left_out) == (3, (), {})


def test_an_axis_that_says_nothing_is_the_x_axis(read):
    assert read(BASE, ARM, SHOULDER.replace('<axis xyz="0 1 0"/>', "<axis/>")).compiled.jnt_axis.tolist() == [
        [1.0, 0.0, 0.0]
    ]
