"""A body of the user's own, from a URDF or MJCF and a TOML file."""

import math

import pytest

from naoserver.bodies.capabilities import WalkVelocity
from naoserver.bodies.parts import Axis
from naoserver.body import read_body, write_body
from naoserver.errors import RobotError
from naoserver_sim.named_body import named_body
from naoserver_sim.robot import SimulatedRobot
from plugins.own_robots.tests.support.robot_files import INERTIAL
from tests.support.arm import ARM
from tests.support.arm import ARM_TOML as PLAIN_TOML
from tests.support.cart import CART, CART_TOML
from tests.support.meshes import cone, write_stl
from tests.support.models import FOLDER
from tests.support.present import present
from visualhfsm_own_robots import read_own_body, write_own_body
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

ARM_TOML = (
    PLAIN_TOML
    + """
[hinges.Elbow]
tilt = "elbow"
[[cameras]]
name = "Camera"
link = "hand"
horizontal_fov = 1.0
"""
)


@pytest.fixture
def written(tmp_path):
    """Write a model and its TOML file; return the latter's path."""

    def write(model, toml, name="arm.urdf"):
        (tmp_path / name).write_text(model)
        path = tmp_path / "my_robot.toml"
        path.write_text(toml)
        return path

    return write


@pytest.fixture
def arm(written):
    return read_own_body(written(ARM, ARM_TOML))


@pytest.fixture
def cart(written):
    return read_own_body(written(CART, CART_TOML, "cart.xml"))


def test_a_urdf_gives_joints_with_their_places_ranges_torques_and_speeds(arm):
    turn, elbow = arm.joints
    assert arm.name == "my_robot"
    assert [link.name for link in arm.links] == ["base", "upper", "hand"]
    assert (turn.parent, turn.child, turn.max_torque, turn.max_velocity) == ("base", "upper", 20.0, 2.0)
    assert (turn.lower, turn.upper) == (-math.inf, math.inf)
    assert (elbow.lower, elbow.upper, elbow.max_velocity) == (-2.0, 2.0, 2.5)
    assert elbow.origin == pytest.approx((0.0, 0.0, 0.24))
    assert elbow.turn == pytest.approx((math.cos(0.6), math.sin(0.6), 0.0, 0.0))
    assert arm.mass == pytest.approx(3.0)
    assert arm.hinge("Elbow").axes[Axis.TILT].joint == "elbow"


def test_a_mounted_arm_moves_and_stays_where_it_is(arm):
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, body=arm)
    robot.command_positions({"elbow": 1.0, "turn": 4.0}, {"elbow": 1.0, "turn": 2.0})
    clock.advance(3.0)
    assert robot.read().positions == pytest.approx((4.0, 1.0), abs=0.02)
    before = robot.stage.truth().torso.position
    assert before == pytest.approx((*robot.stage.truth().torso.position[:2], 0.0), abs=2e-3)
    assert robot.state().torso_tilt == pytest.approx(0.0, abs=0.01)


def test_an_mjcf_gives_gains_of_its_servos_and_joints_beside_the_links_origin(cart):
    pan, tilt = cart.joint["pan"], cart.joint["tilt"]
    assert cart.name == "Trolley"
    assert (cart.gears["pan"].stiffness, cart.gears["pan"].damping, pan.max_torque) == (20.0, 1.0, 3.0)
    assert (pan.child, tilt.parent, tilt.child, tilt.max_torque) == ("mast 1", "mast 1", "mast", 2.0)
    assert pan.origin == pytest.approx((0.03, 0.0, 0.05))
    assert tilt.origin == pytest.approx((0.0, 0.0, 0.1))
    assert cart.links[-1].com == pytest.approx((-0.01, 0.0, -0.05), abs=1e-3)


def test_a_cart_of_ones_own_drives(cart):
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, body=cart)
    begin = robot.stage.truth().torso.position
    present(robot.walker).command(type(present(robot.walker).limits)(forward=0.3))
    clock.advance(3.0)
    x, y, _ = robot.stage.truth().torso.position
    assert (x - begin[0], y - begin[1]) == pytest.approx((0.85, 0.0), abs=0.05)


def test_a_humanoid_of_ones_own_walks_though_its_hinges_have_no_ranges():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, body=read_own_body(FOLDER / "stick_figure.toml"))
    clock.advance(1.0)
    begin = robot.stage.truth().torso.position
    present(robot.walker).command(WalkVelocity(forward=0.15))
    clock.advance(6.0)
    assert robot.stage.truth().torso.position[0] - begin[0] > 0.5
    assert not robot.state().fallen


GRIPPER = ARM.replace(
    "</robot>",
    f"""<link name="thumb">{INERTIAL}</link>
    <joint name="thumb" type="revolute"><parent link="upper"/><child link="thumb"/><axis xyz="0 1 0"/>
      <origin xyz="0 0.1 0.24"/><limit lower="-1" upper="0.9" effort="0" velocity="5"/>
      <mimic joint="elbow" multiplier="-0.5" offset="0.1"/></joint></robot>""",
)


def moved(body, **targets):
    """Return the angles of a body's joints by name after they were sent to targets."""
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, body=body)
    robot.command_positions(targets, dict.fromkeys(targets, 1.0))
    clock.advance(3.0)
    return dict(zip(body.joint_names, robot.read().positions, strict=True))


def test_a_joint_that_mimics_another_follows_it(written):
    body = read_own_body(written(GRIPPER, ARM_TOML))
    assert (body.joint["elbow"].lower, body.joint["elbow"].upper) == pytest.approx((-1.6, 2.0))
    angles = moved(body, elbow=1.0)
    assert (angles["elbow"], angles["thumb"]) == pytest.approx((1.0, -0.4), abs=0.02)


_JOINTS = "".join(
    f'<body><joint name="{name}" axis="0 1 0"/><geom size="0.1" mass="1"/></body>' for name in "ab"
)
TWO_JOINTS = f'<body name="box"><geom size="1"/>{_JOINTS}</body>'
"""A body with the joints a and b."""


def test_a_follower_whose_speed_nobody_says_does_not_slow_its_leader(written):
    model = (
        f"<mujoco><worldbody>{TWO_JOINTS}</worldbody>"
        '<equality><joint joint1="b" joint2="a" polycoef="0 2 0 0 0"/></equality><actuator>'
        '<velocity joint="a" kv="1" ctrlrange="-8 8" forcerange="-5 5"/></actuator></mujoco>'
    )
    body = read_own_body(written(model, 'model = "arm.urdf"'))
    assert [body.joint[name].max_velocity for name in "ab"] == [8.0, 16.0]


def test_a_servo_with_two_controls_has_nothing_to_do_with_the_speed_of_the_next(written):
    model = (
        f"<mujoco><worldbody>{TWO_JOINTS}</worldbody><actuator>"
        '<pid joint="a" kp="9" forcerange="-5 5"/><velocity joint="b" kv="1" ctrlrange="-8 8" forcerange="-5 5"/>'
        "</actuator></mujoco>"
    )
    body = read_own_body(written(model, 'model = "arm.urdf"'))
    assert body.joint["b"].max_velocity == 8.0


def test_a_range_that_was_written_for_the_other_direction_does_not_stop_a_follower(written, caplog):
    model = GRIPPER.replace('lower="-2" upper="2"', 'lower="0" upper="1"').replace(
        'lower="-1" upper="0.9"', 'lower="0.1" upper="1"'
    )
    body = read_own_body(written(model, ARM_TOML))
    assert (body.joint["thumb"].lower, body.joint["thumb"].upper) == pytest.approx((-0.4, 0.1))
    assert "joint 'thumb' leaves its range, [0.1, 1], to follow" in caplog.text


def test_pictures_that_are_not_rendered_are_named(written, caplog):
    sizes = "sizes = [[64, 48], [640, 480], [1920, 1440], [240, 320]]\nrates = [9.0, 9.0, 9.0, 9.0]"
    read_own_body(written(ARM, f"{ARM_TOML}{sizes}\n"))
    assert "Camera has no pictures of 1920x1440, 240x320 here: only those of the shape of" in caplog.text


def test_the_rods_of_a_closed_chain_are_passive_and_move_with_it(caplog):
    body = read_own_body(FOLDER / "four_bars.xml")
    assert [joint.name for joint in body.joints if joint.passive] == ["pin", "swing"]
    assert body.gears["pin"].friction_damping == 0.002
    assert "no actuator moves pin, swing: passive" in caplog.text
    angles = moved(body, drive=0.5)
    assert (angles["drive"], angles["swing"]) == pytest.approx((0.5, 0.5), abs=0.03)


def test_what_was_read_of_a_closed_chain_is_the_same_in_a_facts_file():
    body = read_own_body(FOLDER / "four_bars.xml")
    assert read_body(write_body(body), "bars.json").as_data() == body.as_data()


def test_gains_and_limits_of_joints_may_be_given(written):
    given = "[joint.elbow]\nmax_velocity = 1.5\n[servo.soft]\njoints = ['elbow']\nstiffness = 9.0\ndamping = 1.0\n"
    body = read_own_body(written(ARM, ARM_TOML + given))
    assert body.joint["elbow"].max_velocity == 1.5
    assert body.gears[body.joint["elbow"].gear].stiffness == 9.0


def test_the_rest_of_a_spring_is_counted_as_the_joint_is(written):
    spring = '<joint name="lid" stiffness="3" springref="30"/>'
    model = f'<mujoco><worldbody><body name="box"><geom size="1"/><body>{spring}<geom size="0.1"/></body></body></worldbody></mujoco>'
    toml = 'model = "arm.urdf"\njoint.lid = {{ max_torque = 0, reversed = {} }}'
    rests = [
        read_own_body(written(model, toml.format(turned))).gears["lid"].rest for turned in ("false", "true")
    ]
    assert rests == pytest.approx([math.radians(30), -math.radians(30)])


def test_trees_that_the_world_carries_are_one_robot_on_a_mount(written):
    arm = '<body name="{0}" pos="0 {1} 1"><joint name="turn {0}" actuatorfrcrange="-1 1"/><geom size="0.1"/></body>'
    model = f"<mujoco><worldbody>{arm.format('a', 1)}{arm.format('b', -1)}</worldbody></mujoco>"
    body = read_own_body(written(model, 'model = "arm.urdf"'))
    assert [link.name for link in body.links] == ["mount", "a", "b"]
    assert [joint.origin for joint in body.joints] == [(0.0, 1.0, 1.0), (0.0, -1.0, 1.0)]
    assert body.mounted


LINK = '<worldbody><body name="a"><geom size="1"/></body></worldbody>'


def test_a_model_may_be_in_several_files(written, tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/link.xml").write_text(f"<mujoco>{LINK}</mujoco>")
    body = read_own_body(written('<mujoco><include file="parts/link.xml"/></mujoco>', 'model = "arm.urdf"'))
    assert [link.name for link in body.links] == ["a"]


def test_all_torques_that_are_missing_are_named_at_once_to_be_pasted(written):
    model = ARM.replace(' effort="15"', "").replace(' effort="20"', "").replace('"turn"', '"turn it"')
    path = written(model, ARM_TOML)
    with pytest.raises(RobotError, match="2 joints have no largest torque: add these, which fit") as refused:
        read_own_body(path)
    pasted = str(refused.value).partition("\n")[2]
    assert '"turn it" = { max_torque = ' in pasted
    path.write_text(f"{ARM_TOML}\n{pasted}\n")
    assert read_own_body(path).joint["elbow"].max_torque == pytest.approx(2.0, rel=0.1)


def test_a_joint_may_be_counted_the_other_way_round(written):
    plain = read_own_body(written(ARM, ARM_TOML)).joint["elbow"]
    turned = read_own_body(written(ARM, f"{ARM_TOML}\n[joint.elbow]\nreversed = true\nlower = -1.0\n")).joint[
        "elbow"
    ]
    assert turned.axis == tuple(-part for part in plain.axis)
    assert (turned.lower, turned.upper) == (-1.0, 2.0)


@pytest.mark.parametrize(
    "name", ["/etc/arm.urdf", "../arm.urdf", "away/arm.urdf", r"a\u0000.urdf", "self/arm.urdf"]
)
def test_a_model_out_of_the_folder_of_its_file_is_not_read(written, tmp_path, name):
    (tmp_path / "away").symlink_to(tmp_path.parent)
    (tmp_path / "self").symlink_to("self")
    with pytest.raises(
        RobotError, match=r"my_robot\.toml:1: model = '.*': it must be in the folder of this file"
    ):
        read_own_body(written(ARM, f'model = "{name}"\n'))


@pytest.mark.parametrize("folder", ["/etc", "..", "../else", "meshes/../..", "away", r"a\u0000b"])
def test_meshes_out_of_the_folder_of_its_file_are_not_read(written, tmp_path, folder):
    (tmp_path / "away").symlink_to(tmp_path.parent)
    text = f'model = "arm.urdf"\nmeshes = "{folder}"\n'
    for given in (None, text):  # as the page reads what is in its dialog
        path = written(ARM, text if given is None else ARM_TOML)
        with pytest.raises(
            RobotError, match=r"my_robot\.toml:2: meshes = '.*': it must be in the folder of this"
        ):
            read_own_body(path, given)


def test_a_model_with_meshes_may_be_as_deep_as_any(written):
    chain = '<body><joint/><geom size="0.1" mass="1"/>' * 240 + "</body>" * 240
    meshes = '<asset><mesh name="m" file="none.stl"/></asset>'
    model = f'<mujoco>{meshes}<worldbody><body><geom size="1"/>{chain}</body></worldbody></mujoco>'
    path = written(model, 'model = "arm.xml"\nmounted = true\n', "arm.xml")
    with pytest.raises(RobotError, match="240 joints have no largest torque"):
        read_own_body(path)


URDF_OF_MESHES = """<robot name="r">
<link name="a"><collision><geometry><mesh filename="m.stl" scale="1000 1000 1000"/></geometry></collision></link>
<link name="b"><collision><geometry><mesh filename="m.stl" scale="1000 1000 1000"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit lower="-1" upper="1"/></joint></robot>"""
MJCF_OF_MESHES = """<mujoco><default><mesh scale="1000 1000 1000"/></default>
<asset><mesh name="m" file="m.stl"/></asset>
<worldbody><body name="a"><freejoint/><geom type="mesh" mesh="m"/><body name="b"><joint name="j" range="-1 1"/>
<geom type="mesh" mesh="m"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(("name", "model"), [("r.urdf", URDF_OF_MESHES), ("r.xml", MJCF_OF_MESHES)])
def test_meshes_in_another_unit_have_the_masses_of_their_links(tmp_path, name, model):
    write_stl(tmp_path / "m.stl", cone(1e-4, 3e-4, sides=64))
    (tmp_path / name).write_text(model)
    # Two cones of 0.1 m by 0.3 m, of 1000 kg/m3.
    assert read_own_body(tmp_path / name).mass == pytest.approx(
        2 * 1000 * math.pi * 0.1**2 * 0.3 / 3, rel=0.01
    )


def test_a_torque_is_proposed_for_the_masses_that_meshes_give(tmp_path):
    write_stl(tmp_path / "m.stl", cone(1e-4, 3e-4, sides=64))
    (tmp_path / "r.urdf").write_text(URDF_OF_MESHES)
    (tmp_path / "r.toml").write_text('model = "r.urdf"\nmounted = true\n')
    # Twice that of 3.14 kg at 0.075 m.
    with pytest.raises(RobotError, match=r"j = { max_torque = 4\.6 }"):
        read_own_body(tmp_path / "r.toml")


SIZED = ARM.replace(
    '<robot name="arm">', '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
).replace('lower="-2"', 'lower="$(arg lowest)"')


def test_arguments_of_a_xacro_are_kept_in_the_file_that_is_written(written, tmp_path):
    written(SIZED, "")
    write_own_body(tmp_path / "arm.urdf", tmp_path / "guessed.toml", arguments={"lowest": "-1.5"})
    assert '[xacro]\nlowest = "-1.5"\n' in (tmp_path / "guessed.toml").read_text()
    assert read_own_body(tmp_path / "guessed.toml").joint["elbow"].lower == -1.5
    assert read_own_body(tmp_path / "guessed.toml", arguments={"lowest": "-1"}).joint["elbow"].lower == -1.0


def test_arguments_of_what_is_no_xacro_are_refused(written):
    with pytest.raises(RobotError, match="it has no xacro, so that it takes no arguments"):
        read_own_body(written(ARM, ARM_TOML), arguments={"dof": "7"})


def test_facts_are_written_and_served(written, tmp_path):
    path = written(CART, CART_TOML, "cart.xml")
    write_own_body(path, tmp_path / "cart.json")
    assert write_body(named_body(tmp_path / "cart.json")) == write_body(read_own_body(path))


def test_a_file_is_overwritten_by_force_alone(written, tmp_path):
    written(ARM, "")
    with pytest.raises(RobotError, match=r"my_robot\.toml exists: --force overwrites it"):
        write_own_body(tmp_path / "arm.urdf", tmp_path / "my_robot.toml")
    write_own_body(tmp_path / "arm.urdf", tmp_path / "my_robot.toml", force=True)
    assert read_own_body(tmp_path / "my_robot.toml").joint_names == ("turn", "elbow")


@pytest.mark.parametrize(
    ("source", "target", "problem"),
    [
        ("arm.urdf", "robot.txt", r"robot\.txt: a body is written as \.toml or \.json"),
        ("arm.urdf", "deeper/robot.toml", r"write it to the folder of arm\.urdf, or to one above"),
        ("arm.urdf", "missing/robot.json", r"robot\.json: cannot be written: No such file"),
        ("my_robot.toml", "robot.toml", r"my_robot\.toml: a TOML file is written of a model alone"),
    ],
)
def test_what_cannot_be_written_is_refused(written, tmp_path, source, target, problem):
    written(ARM, ARM_TOML)
    (tmp_path / "deeper").mkdir()
    with pytest.raises(RobotError, match=problem):
        write_own_body(tmp_path / source, tmp_path / target)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.urdf", "deeper", "my_robot.toml"]


def test_what_is_no_text_is_not_written_and_overwrites_nothing(written, tmp_path):
    target = written(SIZED, "old")
    arguments = {"lowest": "-1.5", "unused": "\udcff"}  # as Python reads an option that is not UTF-8
    with pytest.raises(RobotError, match=r"my_robot\.toml: cannot be written: 'utf-8' codec"):
        write_own_body(tmp_path / "arm.urdf", target, arguments=arguments, force=True)
    assert target.read_text() == "old"


def test_a_robot_that_flies_apart_is_refused(written):
    """Its pin is much too light for the gains that the model gives its servo."""
    model = """<mujoco><worldbody><body name="base"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/>
      <body name="pin" pos="0 0 0.1"><joint name="spin" axis="0 0 1"/>
        <geom type="sphere" size="0.001" pos="0.002 0 0" mass="1e-5"/></body></body></worldbody>
      <actuator><position joint="spin" kp="1e7" kv="1e-9" forcerange="-1e9 1e9"/></actuator></mujoco>"""
    path = written(
        model, 'model = "arm.urdf"\npostures.A = { stance = "standing", angles.spin = 1.0 }\nrest = "A"'
    )
    with pytest.raises(
        RobotError, match="cannot be simulated: at the start it flies apart, first at joint 'spin'"
    ):
        SimulatedRobot(clock=VirtualClock(), body=read_own_body(path))
