"""What is read of an MJCF: all its files, and of it the robot alone."""

import pytest

from naoserver.errors import RobotError
from tests.support.meshes import cone, write_stl
from visualhfsm_own_robots._model_file import read_model

pytestmark = pytest.mark.sim

LEG = '<body name="leg"><joint name="hip"/><geom name="shin" size="0.1"/><site name="sole"/></body>'
ROBOT = f'<body name="trunk"><freejoint/><geom size="0.1"/>{LEG}</body>'
BALL = '<body name="ball"><freejoint name="rolls"/><geom name="skin" size="0.1"/></body>'


@pytest.fixture
def read(tmp_path):
    def written(bodies, rest="", **files):
        for name, text in files.items():
            (tmp_path / f"{name}.xml").write_text(text)
        (tmp_path / "r.xml").write_text(f"<mujoco>\n<worldbody>\n{bodies}\n</worldbody>\n{rest}\n</mujoco>")
        return read_model(tmp_path / "r.xml", tmp_path)

    return written


def names(model):
    return [model.compiled.body(number).name for number in range(1, model.compiled.nbody)]


def test_kind_and_lines_are_those_of_the_file(read):
    model = read(ROBOT)
    assert (model.kind, model.lines["body", "leg"], model.lines["joint", "hip"]) == ("mjcf", 3, 3)


def test_files_that_it_includes_are_parts_of_it(read, tmp_path):
    (tmp_path / "parts").mkdir()
    model = read(
        '<include file="parts/leg.xml"/>',
        '<include file="settings.xml"/>',
        **{"parts/leg": f"<mujocoinclude>{ROBOT}</mujocoinclude>"},
        settings='<mujoco><compiler angle="radian"/><default><geom density="10"/></default></mujoco>',
    )
    assert names(model) == ["trunk", "leg"]


def test_files_elsewhere_are_not_included(read, tmp_path):
    (tmp_path.parent / "secret.xml").write_text(f"<x>{ROBOT}</x>")
    with pytest.raises(
        RobotError, match=r"<include> of '.*secret\.xml': it lies outside the folder of the model"
    ):
        read(f'<include file="{tmp_path.parent}/secret.xml"/>')


@pytest.mark.parametrize(
    "asset",
    [
        '<texture type="2d" name="t" file="/etc/hostname"/><material name="m" texture="t"/>',
        '<texture type="cube" name="t" fileright="/etc/hostname"/>',
        '<hfield name="h" file="/etc/hostname" size="1 1 1 1"/>',
        '<texture name="t" type="2d" builtin="flat" width="20000" height="20000"/>',
    ],
)
def test_pictures_and_terrain_are_not_read(read, asset):
    assert names(read(ROBOT, f"<asset>{asset}</asset><size nuser_geom='100000000'/>")) == ["trunk", "leg"]


def test_a_mesh_that_is_missing_costs_its_shape_in_each_file(read, tmp_path):
    write_stl(tmp_path / "meshes/cone.stl", cone(0.1, 0.2, sides=6))
    shapes = "".join(f'<geom type="mesh" mesh="{name}"/>' for name in ("cone", "gone", "lost"))
    meshes = (
        '<compiler meshdir="meshes"/><asset><mesh file="cone.stl"/><mesh name="gone" file="a.stl"/></asset>'
    )
    model = read(
        ROBOT.replace("<site", f"{shapes}<site"),
        meshes + '<include file="more.xml"/>',
        more='<mujoco><asset><mesh name="lost" file="b.stl"/></asset></mujoco>',
    )
    assert model.compiled.ngeom == 3
    assert model.left_out == dict.fromkeys(("a.stl", "b.stl"), "there is no such file")


@pytest.mark.parametrize(
    ("other", "why"),
    [
        (BALL, "it moves by itself"),
        ('<body name="ball" mocap="true"><geom size="0.1"/></body>', "it moves by itself"),
        ('<body name="ball"><geom size="0.1"/></body>', "no joint of the robot moves it"),
    ],
)
def test_what_is_beside_the_robot_is_left_out_by_name(read, other, why):
    model = read(f"{ROBOT}\n{other}")
    assert names(model) == ["trunk", "leg"]
    assert model.notes[0].endswith(f"r.xml:4: body 'ball' beside the robot is left out: {why}")


def test_what_refers_to_it_goes_with_it(read):
    mj = read(
        ROBOT + BALL,
        '<contact><exclude body1="ball" body2="leg"/><pair geom1="skin" geom2="shin"/></contact>'
        '<equality><weld body1="ball" body2="leg"/></equality>'
        '<tendon><spatial><site site="sole"/><geom geom="skin"/><site site="sole"/></spatial></tendon>'
        '<actuator><motor joint="hip"/><motor joint="rolls"/></actuator>'
        '<sensor><jointpos joint="hip"/><framepos objtype="body" objname="ball"/></sensor>'
        '<keyframe><key name="home" qpos="0 0 0 1 0 0 0 0.5 1 0 0 1 0 0 0"/></keyframe>',
    ).compiled
    assert (mj.nu, mj.nsensor, mj.neq, mj.npair, mj.nexclude) == (1, 1, 0, 0, 0)


@pytest.mark.parametrize(
    ("section", "kind"),
    [
        ('<contact><pair geom1="floor" geom2="shin"/></contact>', "pair"),
        ('<contact><exclude body1="floor" body2="leg"/></contact>', "exclude"),
        ('<sensor><jointpos joint="floor"/></sensor>', "sensor"),
        ('<actuator><motor name="m" joint="floor"/></actuator>', "actuator"),
        ('<equality><joint joint1="floor"/></equality>', "equality"),
        ('<sensor><clock sort="yes"/></sensor>', "<clock>"),
        ('<keyframe><key name="home" qpos="1 2 3 4 5 6 7 8 9"/></keyframe>', "keyframes"),
    ],
)
def test_what_refers_to_nothing_costs_a_line(read, section, kind):
    model = read(ROBOT, section)
    assert names(model) == ["trunk", "leg"]
    assert kind in model.notes[0]
    assert "r.xml" in model.notes[0]


def test_trees_that_stand_on_the_ground_are_one_robot(read):
    post = '<body name="post{}" pos="{} 0 0"><geom size="0.1"/><body name="rod{}"><joint/><geom size="0.1"/></body></body>'
    model = read(post.format(1, 0, 1) + post.format(2, 1, 2))
    assert names(model) == ["mount", "post1", "rod1", "post2", "rod2"]
    assert (model.fixed, read(ROBOT).fixed) == (True, False)


@pytest.mark.parametrize(
    "around", ["{}", "<frame pos='1 0 0'>{}</frame>", "<replicate count='1'>{}</replicate>"]
)
def test_one_that_moves_along_the_ground_has_a_mount(read, around):
    assert (
        len(names(read(around.format('<body name="cart"><joint type="slide"/><geom size="0.1"/></body>'))))
        == 2
    )
    assert (
        names(read(around.format('<body name="mount"><joint type="slide"/><geom size="0.1"/></body>')))[0]
        == "mount_"
    )


def test_a_ball_joint_becomes_three_hinges(read):
    ball = LEG.replace('name="hip"', 'name="hip" type="ball" range="0 30" limited="true"')
    model = read(f'<body name="base"><geom size="0.1"/>{ball}</body>')
    mj = model.compiled
    assert [mj.joint(number).name for number in range(mj.njnt)] == ["hip x", "hip y", "hip z"]
    assert mj.jnt_axis.tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert mj.jnt_range[1].tolist() == pytest.approx([-0.5236, 0.5236], abs=1e-4)
    assert "the ball joint 'hip' becomes three hinges" in model.notes[0]


def test_parts_without_names_get_some(read):
    mj = read("<body><geom size='0.1'/><body><joint/><geom size='0.1'/></body></body>").compiled
    assert (mj.body(2).name, mj.joint(0).name) == ("link 2", "joint 1")


def test_soft_bodies_are_left_out(read):
    soft = '<flexcomp name="cloth" type="grid" count="100 100 1" spacing="0.1 0.1 0.1"/>'
    assert (
        "<flexcomp> 'cloth' is left out: a robot has rigid links"
        in read(ROBOT.replace("<site", f"{soft}<site")).notes[0]
    )


def test_keyframes_in_which_no_robot_waits_are_not_read(read):
    assert read(ROBOT, f"<keyframe><key name='home'/>{'<key/>' * 9}</keyframe>").compiled.nkey == 1


def test_a_file_of_many_faults_is_not_read_for_each(read):
    faults = "<motor of='none'/>" * 30_000
    with pytest.raises(RobotError, match=r"r\.xml: MuJoCo refuses 17 and more of its elements"):
        read(ROBOT, f"<actuator>{faults}</actuator>")
