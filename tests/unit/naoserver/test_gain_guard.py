"""Commands with gains behind their safety layer, on a robot without physics, in virtual time."""

import math
from types import SimpleNamespace

import pytest

from interfaces.nao import JointCommand
from naoserver.assembly import Assembly
from naoserver.bodies import find_body
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from zenoh_ice import VirtualClock

OPTIONS = SafetyOptions()
JOINT = "Left_Elbow_Pitch"


def stiffly(position, **values):
    return JointCommand(position=position, kp=50.0, kd=2.0, **values)


@pytest.fixture
def rig():
    clock = VirtualClock()
    robot = FakeRobot(clock, body=find_body("T1"))
    assembly = Assembly(robot, ServerOptions(), clock)
    guard = assembly.gains

    def live(seconds, renew=lambda: None):
        for _ in range(round(seconds / OPTIONS.period)):
            renew()
            clock.advance(OPTIONS.period)
            assembly.jobs[0].run()

    return SimpleNamespace(robot=robot, assembly=assembly, guard=guard, live=live, body=assembly.body)


def position(rig, joint=JOINT):
    return rig.robot.read().positions[rig.body.index(joint)]


def test_joints_go_where_gains_pull_them(rig):
    rig.live(1.0, lambda: rig.guard.command({JOINT: stiffly(0.5)}, "ann"))
    assert position(rig) == pytest.approx(0.5, abs=0.01)


def test_what_is_not_renewed_is_damped_and_then_held(rig):
    rig.guard.command({JOINT: JointCommand(velocity=0.5, kd=2.0)}, "ann")
    rig.live(OPTIONS.gains_timeout + 2 * OPTIONS.period)
    there = position(rig)
    assert rig.guard.moves_for("ann")
    rig.live(OPTIONS.damping_time)
    assert position(rig) == pytest.approx(there, abs=0.01)
    assert not rig.guard.moves_for("ann")
    rig.body.move({JOINT: 0.0}, {})  # nobody has it


def test_what_a_lost_client_commanded_is_damped(rig):
    rig.guard.command({JOINT: JointCommand(velocity=0.5, kd=2.0)}, "ann")
    rig.guard.drop_client("ann")
    there = position(rig)
    rig.live(OPTIONS.damping_time + 2 * OPTIONS.period)
    assert position(rig) == pytest.approx(there, abs=0.01)
    assert not rig.guard.moves_for("ann")


def test_values_are_limited_and_said(rig):
    wild = JointCommand(position=99.0, velocity=-99.0, torque=999.0, kp=1e9, kd=1e9)
    facts, gains = rig.body.facts(JOINT), rig.robot.body.gains
    assert rig.guard.command({JOINT: wild}, "ann") == {
        JOINT: JointCommand(
            position=facts.upper,
            velocity=-facts.max_velocity,
            torque=facts.max_torque,
            kp=gains.kp,
            kd=gains.kd,
        )
    }


@pytest.mark.parametrize("bad", [stiffly(math.nan), stiffly(0.0, torque=math.inf), JointCommand(kp=math.nan)])
def test_what_makes_no_sense_is_refused_and_nothing_is_commanded(rig, bad):
    with pytest.raises(InvalidCommand, match=JOINT):
        rig.guard.command({"AAHead_yaw": stiffly(0.3), JOINT: bad}, "ann")
    assert not rig.guard.moves_for("ann")
    rig.body.claims.check(["AAHead_yaw"])


def test_the_joints_belong_to_their_client(rig):
    rig.guard.command({JOINT: stiffly(0.5)}, "ann")
    with pytest.raises(InvalidCommand, match="commands with gains"):
        rig.body.move({JOINT: 0.0}, {}, client="ben")
    with pytest.raises(InvalidCommand, match="another client's"):
        rig.guard.command({JOINT: stiffly(0.0)}, "ben")


def test_a_stop_between_the_check_of_a_command_and_its_claim_holds(rig, monkeypatch):
    claim = rig.body.claims.claim

    def claimed_after_a_stop(*arguments):
        rig.assembly.gate.stop("in between")
        claim(*arguments)

    monkeypatch.setattr(rig.body.claims, "claim", claimed_after_a_stop)
    there = position(rig)
    with pytest.raises(CommandRefused):
        rig.guard.command({JOINT: JointCommand(velocity=1.0, kd=2.0)}, "ann")
    rig.live(0.1)
    assert position(rig) == pytest.approx(there, abs=0.01)


def test_a_stop_holds_at_once(rig):
    rig.guard.command({JOINT: JointCommand(velocity=1.0, kd=2.0)}, "ann")
    rig.live(0.1)
    rig.assembly.gate.stop("enough")
    there = position(rig)
    with pytest.raises(CommandRefused):
        rig.guard.command({JOINT: stiffly(0.5)}, "ann")
    rig.live(1.0)
    assert position(rig) == pytest.approx(there, abs=0.05)
