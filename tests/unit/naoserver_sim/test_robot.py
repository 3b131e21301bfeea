"""The simulated robot keeps the contract of `naoserver.robot`, in virtual time."""

import json
import math

import numpy as np
import pytest

from naoserver.bodies.nao import H25
from naoserver.errors import HardwareFailure
from naoserver.robot import Robot
from naoserver_sim._motors import AMBIENT, Motors
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from tests.support.present import present
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

PLACE = {name: place for place, name in enumerate(H25.joint_names)}


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def robot(clock):
    robot = SimulatedRobot(clock=clock, skin=False)
    robot.start()
    yield robot
    robot.close()


def position(robot, joint):
    return robot.read().positions[PLACE[joint]]


def setpoint(robot, joint):
    return robot.read().commands[PLACE[joint]]


def trace(seed, steps):
    """Command a robot about, 0.1 s a step; return everything that can be read on the way."""
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, seed=seed)
    seen = []
    for step in range(steps):
        robot.command_positions({"LShoulderPitch": math.sin(step)}, {"LShoulderPitch": 2.0})
        robot.command_velocities({"HeadYaw": math.cos(step)})
        robot.mechanisms[0].command_velocities({"BallRedPan": 0.3})
        clock.advance(0.1)
        seen.append((robot.read(), robot.state(), *(ball.read() for ball in robot.mechanisms)))
    return seen


def test_it_is_a_robot_with_the_joints_in_their_order(robot):
    assert isinstance(robot, Robot)
    assert tuple(joint.name for joint in robot.joints) == H25.joint_names


def test_its_looks_are_shapes_of_its_links(robot):
    looks = json.loads(robot.looks())
    links = {link.name for link in robot.body.links}
    assert looks["shapes"]
    assert {shape["link"] for shape in looks["shapes"]} <= links


def test_time_is_that_of_the_clock(robot, clock):
    clock.advance(1.234)
    assert robot.read().time == pytest.approx(1.23)
    assert robot.clock.now() == pytest.approx(1.234)


def test_it_stands_for_ten_seconds_without_a_command_and_the_ball_hangs_still(robot, clock):
    before, ball = robot.read().positions, robot.mechanisms[0].read().positions
    clock.advance(10.0)
    assert robot.read().positions == pytest.approx(before, abs=0.01)
    assert robot.mechanisms[0].read().positions == pytest.approx(ball, abs=1e-6)
    assert robot.state().torso_tilt < math.radians(8)
    assert not robot.state().fallen


def test_position_command_moves_at_its_speed_and_arrives(robot, clock):
    robot.command_positions({"HeadYaw": 1.0}, {"HeadYaw": 0.5})
    clock.advance(1.0)
    assert setpoint(robot, "HeadYaw") == pytest.approx(0.5, abs=0.01)
    assert position(robot, "HeadYaw") == pytest.approx(0.5, abs=0.05)
    clock.advance(1.5)
    assert position(robot, "HeadYaw") == pytest.approx(1.0, abs=0.01)


def test_speed_of_a_joint_limits_every_command(robot, clock):
    robot.command_positions({"HeadYaw": 2.0}, {"HeadYaw": 1000.0})
    clock.advance(0.1)
    assert setpoint(robot, "HeadYaw") <= 0.1 * robot.joints[PLACE["HeadYaw"]].max_velocity + 1e-9


@pytest.mark.parametrize("names", [["LHipYawPitch"], ["RHipYawPitch"]])
def test_either_hip_yaw_pitch_moves_both(robot, clock, names):
    robot.command_positions(dict.fromkeys(names, -0.1), dict.fromkeys(names, 0.5))
    clock.advance(1.0)
    left, right = (position(robot, f"{side}HipYawPitch") for side in "LR")
    assert left == pytest.approx(-0.1, abs=0.02)
    assert right == pytest.approx(left, abs=0.002)


def test_left_hip_yaw_pitch_wins(robot, clock):
    targets = {"LHipYawPitch": -0.1, "RHipYawPitch": 0.1}
    robot.command_positions(targets, dict.fromkeys(targets, 0.5))
    clock.advance(1.0)
    assert setpoint(robot, "RHipYawPitch") == pytest.approx(-0.1)


def test_unknown_joint_is_refused(robot):
    with pytest.raises(KeyError, match="Tail"):
        robot.command_positions({"Tail": 0.0}, {"Tail": 1.0})


def test_shoulder_carries_the_weight_of_a_stretched_arm(robot, clock):
    lean = robot.state().torso_tilt
    targets = {"LShoulderPitch": -lean, "LShoulderRoll": 0.0, "LElbowYaw": 0.0, "LElbowRoll": -0.035}
    robot.command_positions(targets, dict.fromkeys(targets, 1.0))
    clock.advance(4.0)
    link = {link.name: link for link in H25.links}
    reach, moment = 0.0, 0.0
    for name in ("l_shoulder", "l_upper_arm", "l_elbow", "l_forearm", "l_wrist_hand"):
        reach += next(joint.origin[0] for joint in H25.joints if joint.child == name)
        moment += link[name].mass * 9.81 * (reach + link[name].com[0])
    assert robot.read().torques[PLACE["LShoulderPitch"]] == pytest.approx(-moment, abs=0.03)


@pytest.mark.parametrize("place", [0, 1])
def test_ball_goes_to_any_point(robot, clock, place):
    ball = robot.mechanisms[place]
    names = [joint.name for joint in ball.joints]
    target = (0.7, 1.3, 0.9)
    ball.command_positions(dict(zip(names, target, strict=True)), dict.fromkeys(names, 0.5))
    clock.advance(3.0)
    assert ball.read().positions == pytest.approx(target, abs=1e-3)


def test_ball_moves_smoothly_at_its_speed(robot, clock):
    ball = robot.mechanisms[0]
    ball.command_positions({"BallRedX": 2.0}, {"BallRedX": 0.25})
    clock.advance(0.5)
    speeds = []
    for _ in range(100):
        clock.advance(0.01)
        speeds.append(ball.read().velocities[1])
    assert speeds == pytest.approx([0.25] * 100, abs=0.01)


def test_a_ball_that_is_placed_is_there_at_once_and_stays(robot, clock):
    ball = robot.mechanisms[1]
    ball.command_velocities({"BallGreenPan": 1.0})
    clock.advance(0.5)
    ball.place({"BallGreenPan": -0.4, "BallGreenX": 1.5})
    expected = (-0.4, 1.5, ball.read().positions[2])
    assert ball.read().positions == pytest.approx(expected, abs=1e-6)
    clock.advance(1.0)
    assert ball.read().positions == pytest.approx(expected, abs=1e-3)


def test_a_waving_arm_leaves_the_torso_upright(robot, clock):
    worst = 0.0
    fraction = 0.3
    speeds = {joint.name: fraction * joint.max_velocity for joint in robot.joints}
    for swing in range(10):
        high = swing % 2 == 0
        targets = {"RShoulderPitch": -1.4 if high else 1.4, "RShoulderRoll": -1.2 if high else 0.0}
        targets |= {"HeadYaw": 1.0 if high else -1.0}
        robot.command_positions(targets, {name: speeds[name] for name in targets})
        for _ in range(15):
            clock.advance(0.1)
            worst = max(worst, robot.state().torso_tilt)
    assert worst < math.radians(10)


def test_a_robot_that_lies_has_fallen(robot, clock):
    legs = {f"{side}AnklePitch": 0.9 for side in "LR"}
    robot.command_positions(legs, dict.fromkeys(legs, 6.0))
    clock.advance(3.0)
    assert robot.state().fallen
    assert robot.state().torso_tilt > math.radians(60)


def test_same_seed_gives_the_same_trace():
    assert trace(seed=7, steps=12) == trace(seed=7, steps=12)


def test_another_seed_puts_the_balls_elsewhere():
    (seventh,), (eighth,) = trace(seed=7, steps=1), trace(seed=8, steps=1)
    assert seventh[2].positions != eighth[2].positions


def test_after_close_it_keeps_its_last_snapshot_and_takes_no_command(robot, clock):
    last = robot.read()
    robot.close()
    robot.command_velocities({"HeadYaw": 1.0})
    clock.advance(1.0)
    assert robot.read() == last
    with pytest.raises(HardwareFailure, match="closed"):
        robot.capture("Camera", 320, 240)
    robot.close()


def test_it_sinks_down_when_its_legs_go_limp(robot, clock):
    clock.advance(0.5)
    robot.command_stiffnesses(dict.fromkeys(H25.joint_names, 0.0), 0.5)
    clock.advance(3.0)
    assert robot.state().fallen or robot.camera_pose("Camera")[0][2] < 0.35
    assert set(robot.read().stiffnesses) == {0.0}


def test_the_setpoint_of_a_limp_joint_goes_along_with_it(robot, clock):
    robot.command_stiffnesses({"LShoulderPitch": 0.0}, 0.0)
    clock.advance(2.0)
    assert position(robot, "LShoulderPitch") > 1.5, "the arm hangs down"
    assert setpoint(robot, "LShoulderPitch") == pytest.approx(position(robot, "LShoulderPitch"), abs=1e-3)


def test_motors_that_hold_a_load_grow_warm(robot, clock):
    cold = robot.read().temperatures
    clock.advance(1.0)
    warm = robot.read().temperatures
    assert set(cold) == {25.0}
    assert warm[PLACE["LKneePitch"]] > warm[PLACE["HeadYaw"]] >= 25.0


def test_a_motor_that_gives_for_good_what_its_data_sheet_allows_just_becomes_hot():
    mj = build_model(skin=False).mj
    motors = Motors(mj, H25.motor_heat)
    lasting = mj.actuator("LKneePitch").user[0]
    assert lasting == present(H25.joint["LKneePitch"].motor).continuous_torque
    torques = np.zeros(mj.nu)
    torques[mj.actuator("LKneePitch").id] = lasting
    torques[mj.actuator("LShoulderPitch").id] = mj.actuator("LShoulderPitch").forcerange[1]
    for _ in range(3600):
        motors.tick(1.0, torques)
    assert motors.temperatures[mj.actuator("LKneePitch").id] == pytest.approx(
        present(H25.motor_heat).hot, abs=0.1
    )
    assert motors.temperatures[mj.actuator("HeadYaw").id] == AMBIENT
    torque = mj.actuator("LShoulderPitch").forcerange[1]
    assert torque < H25.joints[PLACE["LShoulderPitch"]].max_torque, "a hot motor gives less"
