"""What urdfdom, the reader of ROS, takes of a URDF is served, and what it leaves is said.

What it takes was seen with urdfdom 6.0.0 in Pinocchio 4.1.0 (`pin.buildModelFromXML`).
"""

import pytest

from naoserver.errors import RobotError
from naoserver_sim.appearance import NO_COLOR, color_of
from plugins.own_robots.tests.support.robot_files import BOX, INERTIAL, joint, link
from tests.support.meshes import cone, write_stl
from visualhfsm_own_robots._model_file import read_model

pytestmark = pytest.mark.sim

BASE, ARM, SHOULDER = link("base"), link("arm"), joint("shoulder", "base", "arm")
BLACK = '<material name="black"><color rgba="0 0 0 1"/></material>'
WHITE = '<material name="white"><color rgba="1 1 1 1"/></material>'
CUBE = '<geometry><box size="0.1 0.1 0.1"/></geometry>'


@pytest.fixture
def read(tmp_path):
    def written(*parts):
        (tmp_path / "r.urdf").write_text('<robot name="r">\n' + "".join(parts) + "</robot>\n")
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
    ("shape", "why"),
    [
        ('<box size="0.1"/>', "<box> cannot be read: attribute 'size' does not have enough data"),
        ('<box size="0.1 0.1 0.1 0.1"/>', "<box> cannot be read: attribute 'size' has too much data"),
        ('<box size="1 1 wide"/>', "<box> cannot be read: bad format in attribute 'size'"),
        ('<cylinder radius="0.1"/>', "<cylinder> cannot be read: required attribute missing: 'length'"),
        ("<plane/>", ""),
    ],
)
def test_a_shape_with_other_sizes_is_refused_and_one_of_another_kind_is_left_out(read, shape, why):
    arm = link("arm", f"{BOX}<visual><geometry>{shape}</geometry></visual>")
    if why:
        with pytest.raises(RobotError, match=f"r.urdf:3: {why}"):
            read(BASE, arm, SHOULDER)
    else:
        assert read(BASE, arm, SHOULDER).compiled.ngeom == 2


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
