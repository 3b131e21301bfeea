"""The Booster T1 and the Unitree G1 in the simulation: they stand by their joints alone, and move as commanded."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from naoserver.bodies import find_body
from naoserver.bodies.parts import Axis
from naoserver.moves.motion_file import Interpolation
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.standing import standing
from naoserver_sim.world import load_world
from tests.support.soak import cases, repeated
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

HEIGHTS = {"T1": 1.17, "G1": 1.32}
"""In m; the makers publish 1.18 and 1.32."""
STANDS = repeated(2.5, soak=10.0)
"""Seconds."""
SAG = 0.06
"""Angle in rad by which a held arm gives way."""


@pytest.fixture(params=HEIGHTS)
def body(request):
    return find_body(request.param)


one_body = pytest.mark.parametrize("body", cases(["T1"], ["G1"]), indirect=True)
"""Tests of what does not depend on the facts of a body."""


@pytest.fixture
def robots():
    """Return a function that lets a body stand in an empty world."""
    made = []

    def start(body, posture=None, *, skin=False):
        clock = VirtualClock()
        robot = SimulatedRobot(clock=clock, body=body, world=load_world("empty"), posture=posture, skin=skin)
        robot.start()
        made.append(robot)
        return robot, clock

    yield start
    for robot in made:
        robot.close()


def test_the_model_weighs_what_the_facts_say(body):
    mj = build_model(load_world("empty"), body=body).mj
    root = mj.body(body.root.name).id
    own = mj.body_mass[mj.body_rootid == root].sum()
    assert own == pytest.approx(body.mass, abs=0.001)


def test_it_is_as_tall_as_published(body):
    model = build_model(load_world("empty"), skin=False, body=body)
    data = standing(model, body.postures["StandZero"].angles)
    head = data.body(body.cameras[0].link).id
    tops = [
        data.geom_xpos[geom][2] + model.mj.geom_rbound[geom]
        for geom in np.flatnonzero(model.mj.geom_contype)
        if model.mj.geom_bodyid[geom] == head and model.mj.geom_type[geom] == 2  # the ball round the head
    ]
    assert max(tops) == pytest.approx(HEIGHTS[body.name], abs=0.06)


@pytest.mark.parametrize("posture", cases(["StandZero", "Crouch"], ["Stand", "StandInit"]))
def test_it_stands_in_a_posture(robots, body, posture):
    robot, clock = robots(body, posture)
    clock.advance(0.5)
    start, tilt = robot.stage.truth().torso.position, robot.state().torso_tilt
    clock.advance(STANDS)
    end = robot.stage.truth().torso.position
    assert end == pytest.approx(start, abs=0.03)
    assert robot.state().torso_tilt == pytest.approx(tilt, abs=math.radians(4))
    left, right = robot.senses.record.loads()
    assert left + right == pytest.approx(9.81 * body.mass, rel=0.02)


@pytest.mark.parametrize("seconds", cases([2.0], [3.0]))
def test_it_crouches_and_rises_again(robots, body, seconds):
    robot, clock = robots(body)
    begin = body.resting_angles
    for name in ("Crouch", "StandInit"):
        end = body.postures[name].angles
        for step in range(1, round(seconds * 50) + 25):
            share = Interpolation.SMOOTH.ease(min(1.0, step / (seconds * 50)))
            angles = {joint: angle + share * (end[joint] - angle) for joint, angle in begin.items()}
            robot.command_positions(angles, {joint.name: joint.max_velocity for joint in body.joints})
            clock.advance(0.02)
        assert not robot.state().fallen, name
        begin = end
    for joint, angle in zip(body.joint_names, robot.read().positions, strict=True):
        assert angle == pytest.approx(body.resting_angles[joint], abs=0.05), joint


def test_on_a_mount_it_hangs_and_its_legs_move_without_the_floor(robots, body):
    robot, clock = robots(replace(body, mounted=True))
    held = robot.stage.truth().torso.position
    robot.command_stiffnesses(dict.fromkeys(body.motors, 0.0), 0.5)
    clock.advance(3.0)
    robot.command_stiffnesses(dict.fromkeys(body.motors, 1.0), 0.5)
    wanted = body.postures["Stand"].angles
    robot.command_positions(wanted, dict.fromkeys(wanted, 1.0))
    clock.advance(4.0)
    angles = dict(zip(body.joint_names, robot.read().positions, strict=True))
    for joint in body.groups.legs:
        assert angles[joint] == pytest.approx(wanted[joint], abs=0.05), joint
    assert robot.senses.record.loads() == (0.0, 0.0)
    assert robot.stage.truth().torso.position == pytest.approx(held, abs=0.002)
    assert not robot.state().fallen


def test_it_begins_at_rest(robots, body):
    robot, _ = robots(body)
    for joint, angle in zip(body.joints, robot.read().positions, strict=True):
        assert angle == pytest.approx(body.resting_angles[joint.name], abs=0.03), joint.name


def test_arms_reach_where_they_are_sent(robots, body):
    robot, clock = robots(body)
    wanted = {}
    for side, sign in (("Left", 1), ("Right", -1)):
        for hinge, axis, angle in (
            (f"{side}Shoulder", Axis.TILT, 0.8), (f"{side}Shoulder", Axis.ROLL, sign * 0.5),
            (f"{side}Elbow", Axis.PAN, sign * -1.2), (f"{side}Elbow", Axis.ROLL, sign * -0.7),
        ):  # fmt: skip
            facts = body.hinges[hinge][axis]
            wanted[facts.joint] = facts.joint_angle(angle)
    robot.command_positions(wanted, dict.fromkeys(wanted, 1.5))
    clock.advance(3.0)
    angles = dict(zip(body.joint_names, robot.read().positions, strict=True))
    for joint, angle in wanted.items():
        assert angles[joint] == pytest.approx(angle, abs=SAG), joint
    assert not robot.state().fallen


@one_body
def test_its_neck_turns_the_camera(robots, body):
    robot, clock = robots(body)
    _, before = robot.camera_pose("Camera")
    neck = {axis: body.neck.axes[axis].joint_angle(0.3) for axis in (Axis.PAN, Axis.TILT)}
    targets = {body.neck.axes[axis].joint: angle for axis, angle in neck.items()}
    robot.command_positions(targets, dict.fromkeys(targets, 1.0))
    clock.advance(2.0)
    _, after = robot.camera_pose("Camera")
    ahead, now = -before[:, 2], -after[:, 2]
    assert math.atan2(now[1], now[0]) - math.atan2(ahead[1], ahead[0]) == pytest.approx(0.3, abs=0.06)
    assert math.asin(-now[2]) - math.asin(-ahead[2]) == pytest.approx(0.3, abs=0.06)


@pytest.mark.gl
def test_its_own_head_does_not_hide_what_the_camera_sees(robots, body):
    robot, _ = robots(body, skin=True)
    dark = robot.capture("Camera", 320, 240).pixels.max(axis=2) < 60
    assert dark.mean() < 0.02


@one_body
def test_it_falls_when_its_motors_are_limp(robots, body):
    robot, clock = robots(body)
    robot.command_stiffnesses(dict.fromkeys(body.joint_names, 0.0), 0.0)
    clock.advance(4.0)
    assert robot.stage.truth().torso.position[2] < 0.5
    assert robot.senses.falls is not None


@one_body
@pytest.mark.parametrize("bearing", cases([90], [30, 210]))
def test_thrown_over_it_has_fallen_even_if_it_folds(robots, body, bearing):
    robot, clock = robots(body)
    clock.advance(1.0)
    force, angle = 1.2 * 9.81 * body.mass, math.radians(bearing)
    robot.stage.push((force * math.cos(angle), force * math.sin(angle), 0.0), 0.3)
    clock.advance(5.0)
    assert robot.state().fallen


@one_body
def test_put_back_on_its_feet_after_a_fall_on_its_back_it_has_not_turned(robots, body):
    robot, clock = robots(body)
    clock.advance(1.0)
    robot.stage.push((-1.2 * 9.81 * body.mass, 0.0, 0.0), 0.3)
    clock.advance(4.0)
    assert robot.state().fallen
    robot.stage.reset()
    for _ in range(5):
        clock.advance(0.01)
        assert max(map(abs, robot.senses.inertial().angular_velocity)) < 1.0
    clock.advance(1.0)
    assert not robot.state().fallen
