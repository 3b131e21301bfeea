"""What a model alone is taken for: the robot stands, lies or is mounted, and its joints go where they are sent."""

import math

import numpy as np
import pytest

from naoserver.bodies.capabilities import WalkVelocity
from naoserver.bodies.parts import Axis, Stance
from naoserver.errors import RobotError
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.models import MODELS, fixed, joint, link, robot
from tests.support.present import present
from visualhfsm_own_robots import read_own_body
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

_LEGS = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")


@pytest.fixture
def read(tmp_path):
    """Return the body for which a model alone is taken, and what is said of it."""

    def taken(model, name="robot.urdf"):
        (tmp_path / name).write_text(model)
        said: list[str] = []
        return read_own_body(tmp_path / name, say=said.append), "\n".join(said)

    return taken


def simulated(body):
    clock = VirtualClock()
    return SimulatedRobot(clock=clock, world=load_world("empty"), body=body), clock


@pytest.mark.parametrize(
    ("name", "groups"),
    [
        ("gripper_arm", {"right_arm": 5}),  # one finger follows the other
        ("humanoid", {"head": 2, "left_arm": 3, "right_arm": 3, "left_leg": 6, "right_leg": 6, "trunk": 1}),
        ("quadruped", {"left_leg": 6, "right_leg": 6}),
        ("carrier", {"wheels": 2}),
        ("head", {"head": 2}),
        ("rotors", {}),
        ("rail", {}),
    ],
)
def test_joints_are_grouped_by_limbs(read, name, groups):
    body, _ = read(MODELS[name])
    found = {group: getattr(body.groups, group) for group in body.groups.__struct_fields__}
    assert {
        group: len(joints) for group, joints in found.items() if isinstance(joints, tuple) and joints
    } == groups


def test_the_joints_of_a_leg_are_from_the_trunk_outwards(read):
    assert read(MODELS["humanoid"])[0].groups.left_leg == tuple(f"l_{name}" for name in _LEGS)


@pytest.mark.parametrize("name", MODELS)
def test_it_stays_and_each_joint_goes_where_it_is_sent(read, name):
    body, _ = read(MODELS[name])
    device, clock = simulated(body)
    clock.advance(3.0)
    before = device.stage.truth().torso.position
    clock.advance(2.0)
    assert device.stage.truth().torso.position == pytest.approx(before, abs=2e-3)
    # Legs last: on one leg, a humanoid without a balance falls.
    moved = [each for each in body.motors if each not in body.groups.legs]
    for each in moved:
        at, facts = body.joint_names.index(each), body.joint[each]
        step = min(0.2, (facts.upper - facts.lower) / 2)
        step = -step if each.startswith("r_") else step  # away from the trunk
        target = device.read().positions[at] + step
        device.command_positions({each: target}, {each: facts.max_velocity})
        clock.advance(1.5)
        assert device.read().positions[at] == pytest.approx(target, abs=0.1 * abs(step)), each
    device.close()


@pytest.mark.parametrize(
    ("name", "mounted", "why"),
    [
        ("gripper_arm", True, "its base extends 0.058 m beyond its center of mass, and its joints move that"),
        ("rail", True, "the world carries it in its model"),
        ("humanoid", False, ""),
        ("quadruped", False, ""),
        ("carrier", False, ""),
        ("rotors", False, ""),
        ("head", False, ""),
    ],
)
def test_what_cannot_stand_by_itself_is_mounted(read, name, mounted, why):
    body, said = read(MODELS[name])
    assert body.mounted == mounted
    assert why in said


def test_a_robot_without_shapes_is_held(read):
    body, said = read(robot(link("trunk"), link("leg"), joint("left_hip", "trunk", "leg", axis="0 1 0")))
    assert body.mounted
    assert "no link has a shape that touches the floor: it would fall without end" in said


def test_the_neck_turns_to_the_left_and_down(read):
    neck = present(read(MODELS["humanoid"])[0].neck)
    assert (neck.axes[Axis.PAN].joint, neck.axes[Axis.PAN].sign) == ("head_pan", 1)
    assert (neck.axes[Axis.TILT].joint, neck.axes[Axis.TILT].sign) == ("head_tilt", -1)


def test_links_named_so_are_a_camera_and_an_inertial_unit(read):
    body, _ = read(MODELS["humanoid"])
    assert [(camera.name, camera.link) for camera in body.cameras] == [("Camera", "camera_link")]
    assert present(body.inertial_unit).gyrometer == (0.02, 0.0, 0.03)


def test_feet_are_the_lowest_links_of_the_legs(read):
    left, right = read(MODELS["humanoid"])[0].soles
    assert (left.link, right.link) == ("l_ankle_roll_link", "r_ankle_roll_link")
    assert left.height == pytest.approx(0.065)
    assert sorted(left.outline) == [(-0.07, -0.045), (-0.07, 0.045), (0.13, -0.045), (0.13, 0.045)]


def test_a_quadruped_begins_with_its_feet_below_its_hips(read):
    body, _ = read(MODELS["quadruped"])
    assert body.postures[body.rest].stance == Stance.STANDING
    device, clock = simulated(body)
    clock.advance(2.0)
    assert device.state().torso_tilt < math.radians(5)
    assert device.stage.truth().torso.position[2] == pytest.approx(0.32, abs=0.02)


def test_wheels_drive_forwards_whatever_their_axes(read):
    body, said = read(MODELS["carrier"])
    assert "joint.reversed: right_wheel_joint (its axis points right)" in said
    device, clock = simulated(body)
    present(device.walker).command(WalkVelocity(forward=0.2))
    clock.advance(2.0)
    x, y, _ = device.stage.truth().torso.position
    assert (x, y) == (pytest.approx(0.38, abs=0.05), pytest.approx(0.0, abs=0.02))


def test_what_is_on_the_floor_beside_wheels_slides(read):
    body, said = read(MODELS["carrier"])
    assert [shape.link for shape in body.shapes if shape.friction] == ["caster"]
    assert "slippery: caster" in said


def test_a_finger_that_follows_another_one_is_asked_for_nothing(read):
    body, _ = read(MODELS["gripper_arm"])
    assert body.following["right_finger_joint"].leader == "left_finger_joint"


def test_a_joint_without_a_motor_hangs(read):
    body, _ = read(MODELS["rail"])
    assert body.joint["passive_hinge"].passive
    assert not body.joint["slide"].passive


def test_torques_fit_the_masses_that_joints_carry(read):
    body, _ = read(MODELS["gripper_arm"])
    torques = [body.joint[f"{name}_joint"].max_torque for name in ("lift", "bend", "wrist")]
    assert torques == sorted(torques, reverse=True)
    carried = 0.75 * 0.15 + 0.5 * 0.45 + 0.375 * 0.75 + 0.04 * 0.95  # kg m, about the joint `lift`
    assert torques[0] == pytest.approx(2 * 9.81 * carried, rel=0.05)


MJCF = """<mujoco><worldbody><body name="base" pos="0 0 0.3">{root}
  <geom name="block" type="box" size=".1 .1 .05" mass="3"/><site name="unit" pos="0.01 0 0"/>
  <body name="arm" pos="0 0 0.05"><joint name="yaw" axis="0 0 1" range="-170 170"/>
    <geom name="rod" type="capsule" fromto="0 0 0 0 0 0.3" size="0.04" mass="1"/>
    <camera name="aside" pos="0.3 0 0" xyaxes="1 0 0 0 0 1" fovy="60"/>
    <body name="hand" pos="0 0 0.3"><joint name="nod" axis="0 1 0" range="-90 90"/>
      <geom name="ball" type="sphere" size="0.02" pos="0 0 -0.32" mass="0.1"/></body></body></body></worldbody>
  {more}</mujoco>"""


def test_a_camera_that_looks_aside_has_a_link_that_is_turned_so(read):
    body, _ = read(MJCF.format(root="", more=""), "robot.xml")
    (camera,) = body.cameras
    assert camera.link == "aside view"
    w, x, y, z = body.moved_by["aside view"].turn
    ahead = np.array((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)))
    assert ahead == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)  # to the left
    assert camera.horizontal_fov == pytest.approx(2 * math.atan(4 / 3 * math.tan(math.radians(30))), abs=1e-3)


@pytest.mark.parametrize(("root", "mounted"), [("<freejoint/>", False), ("", True)])
def test_an_mjcf_says_by_its_free_joint_whether_it_is_mounted(read, root, mounted):
    assert read(MJCF.format(root=root, more=""), "robot.xml")[0].mounted == mounted


def test_a_keyframe_is_the_rest(read):
    more = '<keyframe><key name="other" qpos="0 0"/><key name="home" qpos="0.3 0.4"/></keyframe>'
    body, _ = read(MJCF.format(root="", more=more), "robot.xml")
    assert body.rest == "Home"
    assert body.resting_angles == {"yaw": 0.3, "nod": 0.4}


def test_an_accelerometer_is_the_inertial_unit(read):
    body, _ = read(MJCF.format(root="", more='<sensor><gyro site="unit"/></sensor>'), "robot.xml")
    assert present(body.inertial_unit).accelerometer == (0.01, 0.0, 0.0)


def test_links_that_overlap_at_rest_pass_through_each_other(read):
    body, said = read(MJCF.format(root="", more=""), "robot.xml")
    assert body.overlapping == (("base", "hand"),)
    assert "kept apart in the model, or overlapping at rest" in said


def test_links_that_the_model_keeps_apart_pass_through_each_other(read):
    model = MJCF.replace('pos="0 0 -0.32"', "")
    assert read(model.format(root="", more=""), "robot.xml")[0].overlapping == ()
    more = '<contact><exclude body1="base" body2="hand"/></contact>'
    body, _ = read(model.format(root="", more=more), "robot.xml")
    assert body.overlapping == (("base", "hand"),)


def test_links_that_are_all_in_one_place_are_refused(read):
    parts = "".join(
        f'<body name="b{n}" pos="0 0 9"><joint/><geom type="box" size="1 1 1"/></body>' for n in range(700)
    )
    with pytest.raises(RobotError, match=r"robot\.xml: too many of its links are in one place"):
        read(
            f'<mujoco><worldbody><body name="base"><geom size="1"/>{parts}</body></worldbody></mujoco>',
            "robot.xml",
        )


_HEAD = """<mujoco><worldbody><body name="foot"><geom type="box" size="0.1 0.1 0.05" mass="1"/>
  <body name="neck" pos="0 0 0.1"><joint name="neck" axis="0 0 1" range="0 1" type="{kind}"/>
    <geom size="0.02" mass="0.1"/>
    <body name="head" pos="0 0 0.1"><joint name="head_nod" axis="0 1 0" range="-50 50"/>
      <geom type="box" size="0.03 0.05 0.03" mass="0.1"/></body></body></body></worldbody>
  <actuator><position joint="neck" kp="10" kv="1"/><position joint="head_nod" kp="10" kv="1"/></actuator>
  <keyframe><key name="home" qpos="{turned} 0.2"/></keyframe></mujoco>"""


def test_a_head_that_is_turned_at_rest_tilts_too(read):
    body, _ = read(_HEAD.format(kind="hinge", turned=0.9), "robot.xml")
    assert {axis: turned.joint for axis, turned in body.hinges["Neck"].items()} == {
        Axis.PAN: "neck",
        Axis.TILT: "head_nod",
    }


def test_what_lifts_a_head_does_not_pan_it(read):
    body, _ = read(_HEAD.format(kind="slide", turned=0.5), "robot.xml")
    assert {axis: turned.joint for axis, turned in body.hinges["Neck"].items()} == {Axis.TILT: "head_nod"}


def test_a_ball_joint_is_three_hinges(read, caplog):
    model = MJCF.replace('<joint name="nod" axis="0 1 0" range="-90 90"/>', '<joint name="nod" type="ball"/>')
    body, _ = read(model.format(root="", more=""), "robot.xml")
    assert body.joint_names == ("yaw", "nod x", "nod y", "nod z")
    assert "ball joint 'nod' becomes three hinges" in caplog.text


def test_a_joint_of_which_the_root_has_some_is_on_a_mount(read):
    body, _ = read(MJCF.format(root='<joint name="rail" type="slide" axis="1 0 0"/>', more=""), "robot.xml")
    assert (body.root.name, body.joint["rail"].parent, body.mounted) == ("mount", "mount", True)


def test_angles_count_from_the_zero_of_the_model(read):
    """Its place is that of the angle `ref`, not that of 0."""
    model = MJCF.replace(
        'name="nod" axis="0 1 0" range="-90 90"', 'name="nod" axis="0 1 0" range="-90 90" ref="30"'
    )
    body, _ = read(model.format(root="", more=""), "robot.xml")
    assert body.joint["nod"].turn == pytest.approx(
        (math.cos(math.radians(15)), 0.0, -math.sin(math.radians(15)), 0.0)
    )


def test_more_wheels_of_a_side_turn_together(read):
    parts = [link("base", 5.0, '<box size="0.5 0.2 0.06"/>', "0 0 0.05")]
    for name, x, y in (("fl", 1, 1), ("fr", 1, -1), ("rl", -1, 1), ("rr", -1, -1)):
        at = f"{0.2 * x} {0.15 * y} 0.03"
        parts += [link(name, 0.3, '<sphere radius="0.05"/>')]
        parts += [joint(f"{name}_wheel", "base", name, at, "0 1 0", "", "continuous")]
    body, _ = read(robot(*parts))
    assert {(pair.leader, pair.follower) for pair in body.couplings} == {
        ("fl_wheel", "rl_wheel"),
        ("fr_wheel", "rr_wheel"),
    }


def test_what_a_link_is_called_fits(read, caplog):
    long = "x" * 70
    body, _ = read(robot(link("base", 1.0, '<box size="1 1 1"/>'), link(long), fixed("base", long)))
    assert body.links[1].name == "x" * 64
    assert f"link {long!r} is called" in caplog.text
