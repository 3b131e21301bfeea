"""What is read of a URDF, what is repaired in it, and what is refused."""

import mujoco
import pytest

from naoserver.errors import RobotError
from plugins.own_robots.tests.support.robot_files import BOX, INERTIAL, joint, link, urdf
from visualhfsm_own_robots._model_file import read_model
from visualhfsm_own_robots._urdf import Sensor

pytestmark = pytest.mark.sim

BASE, ARM, SHOULDER = link("base"), link("arm"), joint("shoulder", "base", "arm")


@pytest.fixture
def read(tmp_path):
    def written(*parts, **options):
        (tmp_path / "r.urdf").write_text(urdf(*parts))
        return read_model(tmp_path / "r.urdf", tmp_path, **options)

    return written


def names(model, kind="body"):
    mj = model.compiled
    return [getattr(mj, kind)(number).name for number in range({"body": mj.nbody, "joint": mj.njnt}[kind])]


def test_speeds_and_driven_joints_and_lines_are_those_of_the_file(read):
    model = read(
        BASE,
        ARM,
        link("hand"),
        SHOULDER,
        joint("wrist", "arm", "hand").replace('velocity="2"', 'velocity=""'),
        '<transmission name="t"><joint name="shoulder"/></transmission>',
        '<ros2_control><joint name="wrist"><command_interface name="position"/></joint>'
        '<joint name="base"><state_interface name="position"/></joint></ros2_control>\n',
    )
    assert (model.kind, model.speeds) == ("urdf", {"shoulder": 2.0})
    assert model.actuated == {"shoulder", "wrist"}
    assert (model.lines["link", "base"], model.lines["joint", "wrist"]) == (2, 8)


def test_cameras_and_inertial_units_are_those_of_the_file(read):
    model = read(
        BASE,
        ARM,
        SHOULDER,
        '<gazebo reference="arm"><sensor name="eye" type="camera"><pose>0 0 0.1 0 0.5 0</pose>'
        "<camera><horizontal_fov>1.2</horizontal_fov></camera></sensor></gazebo>"
        '<gazebo reference="base"><sensor name="balance" type="imu_sensor"/></gazebo>'
        '<gazebo reference="elsewhere"><sensor name="lost" type="imu"/></gazebo>'
        '<gazebo reference="base"><sensor name="touch" type="contact"/></gazebo>'
        '<sensor name="old"><parent link="base"/><origin xyz="1 2 3"/><camera><image hfov="0.9"/></camera></sensor>\n',
    )
    assert model.sensors == (
        Sensor("camera", "eye", "arm", (0.0, 0.0, 0.1, 0.0, 0.5, 0.0), 1.2),
        Sensor("imu", "balance", "base"),
        Sensor("camera", "old", "base", (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), 0.9),
    )


def test_the_options_for_mujoco_are_merged_with_ours(read):
    options = '<mujoco><compiler fusestatic="true" discardvisual="true" meshdir="x" balanceinertia="true"/></mujoco>\n'
    fixed = joint("mount", "arm", "hand", kind="fixed")
    model = read(options, "<mujoco><size njmax='1'/></mujoco>\n", BASE, ARM, link("hand"), SHOULDER, fixed)
    assert names(model) == ["world", "base", "arm", "hand"]


def test_a_joint_that_follows_another_is_kept_as_an_equality(read):
    follower = joint("wrist", "arm", "hand", '<mimic joint="shoulder" multiplier="-0.8" offset="0.1"/>')
    mj = read(BASE, ARM, link("hand"), SHOULDER, follower).compiled
    assert mj.eq_type.tolist() == [mujoco.mjtEq.mjEQ_JOINT]
    assert mj.eq_data[0, :2] == pytest.approx((0.1, -0.8))


def test_a_link_that_no_joint_connects_is_left_out(read):
    model = read(BASE, ARM, SHOULDER, link("loose"))
    assert names(model) == ["world", "base", "arm"]
    assert model.notes[0].endswith("r.urdf:7: link 'loose' is left out: no joint connects it to 'base'")
    assert not read(BASE, ARM, SHOULDER, link("world", "", "")).fixed


@pytest.mark.parametrize(
    ("written", "range_"), [('upper="0.04"', [0.0, 0.04]), ('lower="-0.5"', [-0.5, 0.0])]
)
def test_an_end_of_a_range_that_is_left_out_is_zero(read, written, range_):
    finger = joint("finger", "base", "arm", kind="prismatic").replace('lower="-1" upper="1"', written)
    mj = read(BASE, ARM, finger).compiled
    assert mj.jnt_limited.tolist() == [1]
    assert mj.jnt_range.tolist() == [range_]


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous", "fixed"])
def test_a_joint_that_should_have_limits_and_has_none_is_named(read, kind):
    plain = joint("shoulder", "base", "arm", kind=kind)
    notes = read(BASE, ARM, plain[: plain.index("<limit")] + "</joint>").notes
    said = "r.urdf:4: joint 'shoulder' has no range, so it moves without end"
    assert [note.endswith(said) for note in notes] == ([True] if kind in ("revolute", "prismatic") else [])


def test_a_planar_joint_has_no_limits(read):
    mj = read(BASE, ARM, joint("slide", "base", "arm", kind="planar")).compiled
    assert (mj.jnt_limited.tolist(), mj.jnt_actfrclimited.tolist()) == ([0, 0, 0], [0, 0, 0])


def test_exchanged_limits_are_put_in_order_and_equal_ones_are_none(read):
    exchanged = SHOULDER.replace('lower="-1" upper="1"', 'lower="0.5" upper="-1"')
    model = read(BASE, ARM, exchanged, link("hand"), joint("free", "arm", "hand").replace('"-1"', '"1"'))
    assert model.compiled.jnt_range[0].tolist() == [-1.0, 0.5]
    assert model.compiled.jnt_limited.tolist() == [1, 0]
    (none,) = model.notes
    assert none.endswith("r.urdf:10: joint 'free' has no range, so it moves without end")


@pytest.mark.parametrize(
    ("inside", "pose", "angle"),
    [
        ('<pose degrees="true">0 0 0.1 0 45 0</pose>', (0.0, 0.0, 0.1, 0.0, 0.785398, 0.0), None),
        ("<pose>1 0 0 0 0 0</pose><camera><pose>0 2 0 0 0 0</pose></camera>", (1.0, *(0.0,) * 5), None),
        (
            "<camera><horizontal_fov>1.2</horizontal_fov></camera><plugin><horizontal_fov>2</horizontal_fov></plugin>",
            (0.0,) * 6,
            1.2,
        ),
    ],
)
def test_a_sensor_stands_where_it_says_itself(read, inside, pose, angle):
    eye = f'<gazebo reference="arm"><sensor name="eye" type="camera">{inside}</sensor></gazebo>'
    (sensor,) = read(BASE, ARM, SHOULDER, eye).sensors
    assert (sensor.pose, sensor.horizontal_fov) == (pytest.approx(pose, abs=1e-6), angle)


@pytest.mark.parametrize(
    ("pose", "angle"), [("nan 0 0 0 0 0", "nan"), ("0 0 1e400 0 0 0", "inf"), ("1", "-1")]
)
def test_what_no_camera_has_is_not_read(read, pose, angle):
    eye = (
        f'<gazebo reference="arm"><sensor name="eye" type="camera"><pose>{pose}</pose>'
        f"<camera><horizontal_fov>{angle}</horizontal_fov></camera></sensor></gazebo>"
    )
    assert read(BASE, ARM, SHOULDER, eye).sensors == (Sensor("camera", "eye", "arm"),)


@pytest.mark.parametrize(
    ("root", "kind", "bodies"),
    [
        (link("world", "", ""), "fixed", ["world", "base"]),
        (link("world", BOX, ""), "fixed", ["world", "mount", "base"]),
        (link("world", "", ""), "revolute", ["world", "mount", "base"]),
        (link("map", "", ""), "floating", ["world", "base"]),
        (link("world", "", ""), "floating", ["world", "base"]),
    ],
)
def test_what_stands_on_the_world_has_a_root_of_its_own(read, root, kind, bodies):
    name = "map" if "map" in root else "world"
    model = read(root, BASE, joint("stand", name, "base", kind=kind))
    assert names(model) == bodies
    assert model.fixed == (name == "world" and kind != "floating")


def test_a_link_called_world_that_a_joint_moves_gets_another_name(read):
    model = read(BASE, link("world"), ARM, joint("turn", "base", "world"), joint("lift", "world", "arm"))
    assert names(model) == ["world", "base", "mount", "arm"]
    assert model.notes[0].endswith("r.urdf:3: link 'world' is called 'mount'")
    assert not model.fixed


@pytest.mark.parametrize(
    "inertial",
    [
        "<inertial/>",
        '<inertial><mass value=""/></inertial>',
        '<inertial><inertia ixx="1" iyy="1" izz="1"/></inertial>',
        "",
    ],
)
def test_a_link_without_mass_weighs_as_its_shapes_do(read, inertial):
    assert read(BASE, link("arm", BOX, inertial), SHOULDER).compiled.body("arm").mass[0] == pytest.approx(1.0)


def test_a_link_without_mass_that_is_fixed_to_one_with_a_mass_has_none(read):
    foot, case, lid = (link(name, BOX, "") for name in ("foot", "case", "lid"))
    joints = [
        joint(f"fix {child}", parent, child, kind="fixed")
        for parent, child in (("foot", "base"), ("arm", "case"), ("case", "lid"))
    ]
    model = read(foot, lid, case, BASE, ARM, SHOULDER, *joints)
    assert dict(zip(names(model), model.compiled.body_mass.tolist(), strict=True)) == {
        "world": 0.0,
        "foot": 0.0,
        "base": 1.0,
        "arm": 1.0,
        "case": 0.0,
        "lid": 0.0,
    }
    assert model.notes == ()


def test_an_inertia_may_lack_its_products(read):
    inertial = INERTIAL.replace(' ixy="0" ixz="0" iyz="0"', "")
    assert read(BASE, link("arm", BOX, inertial), SHOULDER).notes == ()


@pytest.mark.parametrize(
    "inertia",
    [
        '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>',
        '<inertia ixx="1e-15" iyy="1e-15" izz="2e-15" ixy="0" ixz="-1e-47" iyz="0"/>',
    ],
)
def test_frames_without_mass_stay_as_links(read, inertia):
    frame = joint("fix", "arm", "optical", kind="fixed")
    for mass, noted in (("1e-9", ["'optical' without mass or inertia"]), ("1e-15", [])):
        empty = f'<inertial><mass value="{mass}"/>{inertia}</inertial>'
        model = read(BASE, ARM, SHOULDER, link("optical", "", empty), frame)
        assert names(model)[-1] == "optical"
        assert [note.partition(":")[0] for note in model.notes] == noted


def test_an_inertia_is_repaired_unless_the_user_refuses(read):
    arm = link("arm", BOX, INERTIAL.replace('izz="0.002"', 'izz="0.05"'))
    said = r"r.urdf:3: the inertia of 'arm' has the moments 0.01, 0.01, 0.05, which no body has"
    assert said in read(BASE, arm, SHOULDER).notes[0]
    with pytest.raises(RobotError, match=said):
        read(BASE, arm, SHOULDER, balance=False)


@pytest.mark.parametrize(
    "shape",
    [
        "<visual/>",
        "<visual><geometry/></visual>",
        '<collision><geometry><cone radius="1"/></geometry></collision>',
        '<collision><box size="1 1 1"/></collision>',
    ],
)
def test_a_shape_that_cannot_be_read_costs_a_line(read, shape):
    model = read(BASE, link("arm", shape), SHOULDER)
    assert model.compiled.ngeom == 1
    assert "> of link 'arm' is left out: " in model.notes[0]


@pytest.mark.parametrize("shape", ['<box size="0 1 1"/>', '<sphere radius="-1"/>'])
def test_a_shape_without_a_size_costs_a_line(read, shape):
    model = read(BASE, link("arm", f"<collision><geometry>{shape}</geometry></collision>"), SHOULDER)
    assert model.compiled.ngeom == 1
    assert model.notes[0].endswith(
        "r.urdf:3: geom of link 'arm' is left out: size 0 must be positive in geom"
    )


def test_shapes_and_materials_may_lack_names_and_textures(read):
    shape = '<visual name="v"><geometry><box size="1 1 1"/></geometry><material><texture filename="t.png"/></material></visual>'
    assert read(link("base", shape * 2), ARM, SHOULDER).compiled.ngeom == 3
