"""Commands with gains to simulated humanoids, in virtual time."""

from types import SimpleNamespace

import numpy as np
import pytest

from interfaces.nao import JointCommand
from naoserver.bodies import find_body
from naoserver.errors import InvalidCommand
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

OPTIONS = SafetyOptions()
ROLL, PITCH = "Left_Shoulder_Roll", "Left_Shoulder_Pitch"


@pytest.fixture
def rig():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, body=find_body("T1"), world=load_world("empty"))
    assembly = Assembly(robot, ServerOptions(), clock)
    guard = assembly.gains
    assert guard is not None

    def live(seconds, renew=lambda: None):
        for _ in range(round(seconds / OPTIONS.period)):
            renew()
            clock.advance(OPTIONS.period)
            assembly.jobs[0].run()

    def place(joint):
        return robot.read().positions[assembly.body.index(joint)]

    def command(commands, client="ann"):
        return guard.command(commands, client)

    return SimpleNamespace(robot=robot, body=assembly.body, live=live, place=place, command=command)


def as_it_is(rig, joints, kp=400.0, kd=8.0):
    return {joint: JointCommand(position=rig.place(joint), kp=kp, kd=kd) for joint in joints}


def test_who_commands_all_of_the_legs_keeps_the_balance(rig):
    rig.live(0.1)
    robot, standing = rig.robot, as_it_is(rig, rig.robot.body.groups.legs)
    with pytest.raises(InvalidCommand, match="keeps the robot upright"):
        rig.command(dict([*standing.items()][:3]))
    rig.live(0.5, lambda: rig.command(standing))
    assert not robot.walker.balances
    assert not robot.state().fallen
    with pytest.raises(InvalidCommand, match="commands with gains"):
        rig.body.claims.check(robot.walker.joints, "the walk")
    rig.live(OPTIONS.gains_timeout + OPTIONS.damping_time + 0.5)
    assert robot.walker.balances


def test_torque_alone_neither_passes_a_limit_nor_outruns_the_motor(rig):
    joint, facts = "Left_Elbow_Yaw", rig.body.facts("Left_Elbow_Yaw")
    seen = []

    def push():
        rig.command({joint: JointCommand(torque=-1e6)})
        seen.append(rig.robot.read())

    rig.live(1.0, push)
    index = rig.body.index(joint)
    assert min(reading.positions[index] for reading in seen) >= facts.lower - 0.01
    assert max(abs(reading.velocities[index]) for reading in seen) <= 1.1 * facts.max_velocity
    assert max(abs(reading.torques[index]) for reading in seen) <= facts.max_torque + 1e-9


def test_an_arm_makes_way_for_what_it_could_hit(rig):
    table = next(each for each in rig.robot.body.tables if each.dependent == ROLL)
    with pytest.raises(InvalidCommand, match=f"command also {PITCH}"):
        rig.command(as_it_is(rig, [ROLL]))
    lowest = {ROLL: JointCommand(position=-9.0, kp=200.0, kd=3.0)}
    rig.live(0.6, lambda: rig.command({**lowest, PITCH: JointCommand(position=-2.0, kp=200.0, kd=3.0)}))
    beyond = []

    def swing():
        limited = rig.command({**lowest, PITCH: JointCommand(position=0.1, kp=200.0, kd=3.0)})
        assert ROLL in limited
        lower, _ = table.at(rig.place(PITCH))
        beyond.append(lower - rig.place(ROLL))

    rig.live(1.0, swing)
    assert max(beyond) < 0.01


def test_limp_motors_follow_no_gains(rig):
    joint = "Head_pitch"
    rig.body.stiffen({joint: 0.0}, 0.0)
    rig.live(0.2, lambda: rig.command({joint: JointCommand(position=0.5, kp=100.0, kd=1.0)}))
    assert rig.robot.read().torques[rig.body.index(joint)] == 0.0


def test_whatever_is_commanded_the_simulation_stays_sound(rig):
    random = np.random.default_rng(0)
    names = rig.robot.body.joint_names

    def wild():
        rows = random.normal(0.0, 10.0 ** random.uniform(0.0, 12.0, 5), (len(names), 5))
        rows[:, 3:] = np.abs(rows[:, 3:])
        rig.command({name: JointCommand(*row) for name, row in zip(names, rows.tolist(), strict=True)})

    rig.live(1.0, wild)
    assert np.isfinite([*rig.robot.read().positions, *rig.robot.read().torques]).all()
