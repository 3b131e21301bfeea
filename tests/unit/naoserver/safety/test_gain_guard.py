"""Commands with gains behind their safety layer, on a robot without physics, in virtual time."""

import dataclasses
import math
from types import SimpleNamespace

import pytest
from msgspec.structs import replace

from interfaces.nao import JointCommand
from naoserver.bodies import find_body
from naoserver.bodies.parts import Gains, RangeTable, SpeedRule
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.serving.assembly import Assembly
from tests.support.linkage import LINKAGE
from zenoh_ice import VirtualClock

OPTIONS = SafetyOptions()
JOINT = "Left_Elbow_Pitch"


def stiffly(position, **values):
    return JointCommand(position=position, kp=50.0, kd=2.0, **values)


PITCH, ROLL = "Left_Shoulder_Pitch", "Left_Shoulder_Roll"
"""Two joints that could hit each other."""


@pytest.fixture
def rig():
    return rig_of(find_body("T1"))


def rig_of(body):
    clock = VirtualClock()
    robot = FakeRobot(clock, body=body)
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
    with pytest.raises(InvalidCommand, match=f"{JOINT} is moved by commands with gains now: stop it first"):
        rig.body.move({JOINT: 0.0}, {}, client="ben")
    with pytest.raises(InvalidCommand, match="another client's"):
        rig.guard.command({JOINT: stiffly(0.0)}, "ben")


@pytest.mark.parametrize("was_reset", [False, True], ids=["a stop", "a stop and its reset"])
def test_a_stop_between_the_check_of_a_command_and_its_claim_holds(rig, monkeypatch, was_reset):
    claim, gate = rig.body.claims.claim, rig.assembly.gate

    def claimed_after_a_stop(*arguments):
        gate.stop("in between")
        if was_reset:
            gate.reset(resume=True)
        claim(*arguments)

    monkeypatch.setattr(rig.body.claims, "claim", claimed_after_a_stop)
    there = position(rig)
    with pytest.raises(CommandRefused, match=r"^the robot was stopped$" if was_reset else "in between"):
        rig.guard.command({JOINT: JointCommand(velocity=1.0, kd=2.0)}, "ann")
    assert not rig.guard.moves_for("ann")
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


def test_a_lost_client_is_an_event(rig):
    rig.guard.command({JOINT: stiffly(0.5)}, "ann")
    rig.guard.drop_client("ann")
    newest = rig.assembly.events.snapshot()[0][-1]
    assert newest.message == f"damped {JOINT}: the client that commanded it is gone"


def test_after_its_end_it_passes_no_command_on(rig):
    rig.guard.close()
    there = position(rig)
    rig.guard.command({JOINT: stiffly(0.5)}, "ann")
    rig.live(0.5)
    assert not rig.guard.moves_for("ann")
    assert position(rig) == pytest.approx(there)


def test_after_its_end_a_stop_finds_nothing_to_hold(rig, monkeypatch):
    rig.guard.close()

    def read_after_a_stop():
        monkeypatch.undo()
        rig.assembly.gate.stop("in between")
        return rig.body.read()

    monkeypatch.setattr(rig.body, "read", read_after_a_stop)
    with pytest.raises(CommandRefused, match="in between"):
        rig.guard.command({JOINT: stiffly(0.5)}, "ann")


def test_joints_by_which_the_robot_balances_are_commanded_together(rig):
    legs = rig.robot.body.groups.legs[:2]
    rig.body.balancing = lambda: legs
    with pytest.raises(InvalidCommand) as refusal:
        rig.guard.command({legs[0]: stiffly(0.0)}, "ann")
    assert str(refusal.value) == f"{legs[0]} keeps the robot upright: command also {legs[1]}, or none"
    assert rig.guard.command({JOINT: stiffly(0.5)}, "ann") == {}
    rig.guard.command(dict.fromkeys(legs, stiffly(0.0)), "ann")
    assert rig.guard.moves_for("ann")


@pytest.mark.parametrize(("one", "other"), [(PITCH, ROLL), (ROLL, PITCH)])
def test_joints_that_could_hit_each_other_are_commanded_together_at_first(rig, one, other):
    with pytest.raises(InvalidCommand) as refusal:
        rig.guard.command({one: stiffly(0.0)}, "ann")
    assert str(refusal.value) == f"{one} could hit what {other} moves: command also {other}"
    rig.guard.command({one: stiffly(0.0), other: stiffly(0.0)}, "ann")
    rig.guard.command({one: stiffly(0.1)}, "ann")


def test_a_joint_is_as_fast_as_the_rules_of_its_body_say():
    body = find_body("T1")
    rule = SpeedRule((JOINT,), 0.25)
    distances = []
    for each in (body, replace(body, speed_rules=(rule,))):
        rig = rig_of(each)
        there = position(rig)
        rig.live(0.1, lambda rig=rig: rig.guard.command({JOINT: stiffly(2.0)}, "ann"))
        distances.append(position(rig) - there)
    assert distances[1] == pytest.approx(distances[0] / 4, rel=0.05)


@pytest.fixture
def sent(rig, monkeypatch):
    return sent_of(rig, monkeypatch)


def sent_of(rig, monkeypatch):
    """Return the commands that reach the motors, by joint, the newest of each."""
    newest, command = {}, rig.robot.command_gains

    def spied(commands):
        newest.update(commands)
        command(commands)

    monkeypatch.setattr(rig.robot, "command_gains", spied)
    return newest


def test_a_command_reaches_the_motors_with_the_limits_of_its_joint(rig, sent):
    neck = "AAHead_yaw"
    rig.guard.command({neck: stiffly(0.5, velocity=0.1, torque=0.2)}, "ann")
    facts = rig.body.facts(neck)
    speed = OPTIONS.speed_fraction * facts.max_velocity
    assert sent == {neck: (0.5, 0.1, 0.2, 50.0, 2.0, facts.lower, facts.upper, speed)}


def test_who_is_lost_leaves_joints_that_are_damped_as_their_gear_says(rig, sent):
    rig.guard.command({JOINT: stiffly(0.5, velocity=0.1, torque=0.2)}, "ann")
    rig.guard.drop_client("ann")
    body = rig.robot.body
    gentle = body.gears[body.joint[JOINT].gear].damping
    assert sent[JOINT][:5] == (0.5, 0.0, 0.0, 0.0, gentle)


def test_who_is_lost_leaves_the_joints_of_others_as_they_are(rig, sent):
    other = "Right_Elbow_Pitch"
    rig.guard.command({JOINT: stiffly(0.5)}, "ann")
    rig.guard.command({other: stiffly(0.5)}, "ben")
    rig.guard.drop_client("ann")
    assert (sent[JOINT].kp, sent[other].kp) == (0.0, 50.0)
    rig.live(0.1, lambda: rig.guard.command({other: stiffly(0.5)}, "ben"))
    assert rig.guard.moves_for("ben")


def test_a_command_lasts_until_its_timeout(rig, sent):
    rig.guard.command({JOINT: stiffly(0.5)}, "ann")
    rig.live(OPTIONS.gains_timeout - 2 * OPTIONS.period)
    assert sent[JOINT].kp == 50.0
    rig.live(2 * OPTIONS.period)
    assert sent[JOINT].kp == 0.0


def test_it_is_watched_while_joints_follow_commands(rig):
    assert rig.guard.watch() is None
    rig.guard.command({JOINT: stiffly(0.5)}, "ann")
    assert rig.guard.watch() == OPTIONS.period
    rig.live(2.0)
    assert rig.guard.watch() is None


def test_of_joints_that_share_a_motor_one_is_commanded():
    rig = rig_of(replace(LINKAGE, gains=Gains(100.0, 10.0)))
    with pytest.raises(InvalidCommand, match="pinch shares its motor with another joint: command that one"):
        rig.guard.command({"pinch": stiffly(0.0)}, "ann")
    rig.guard.command({"grip": stiffly(0.0)}, "ann")
    assert rig.guard.moves_for("ann")


def test_a_joint_that_is_none_is_refused(rig):
    with pytest.raises(InvalidCommand, match="there is no joint 'Tail'"):
        rig.guard.command({"Tail": stiffly(0.0)}, "ann")


def with_table(*rows):
    """A T1 on which the pitch of a shoulder leaves its roll what a table says."""
    body = find_body("T1")
    weak = tuple(replace(joint, max_torque=1.0) if joint.name == ROLL else joint for joint in body.joints)
    return rig_of(replace(body, joints=weak, tables=(RangeTable(PITCH, ROLL, rows),)))


@pytest.mark.parametrize("roll", [-9.0, 9.0])
def test_a_table_takes_no_joint_out_of_its_range(monkeypatch, roll):
    rig = with_table((-1.0, -9.0, 9.0), (1.0, -9.0, 9.0))
    sent = sent_of(rig, monkeypatch)
    rig.guard.command({PITCH: stiffly(0.0), ROLL: stiffly(roll)}, "ann")
    facts = rig.body.facts(ROLL)
    edge = facts.lower if roll < 0.0 else facts.upper
    assert (sent[ROLL].position, sent[ROLL].lower, sent[ROLL].upper) == (edge, facts.lower, facts.upper)
    assert sent[PITCH].max_speed == rig.body.facts(PITCH).max_velocity


def test_a_joint_comes_half_as_fast_as_the_other_can_make_way(monkeypatch):
    rig = with_table((-1.0, -1.0, 0.0), (1.0, -1.0, 4.0))  # steepest: 2
    sent = sent_of(rig, monkeypatch)
    rig.guard.command({PITCH: stiffly(0.0), ROLL: stiffly(0.0)}, "ann")
    assert sent[PITCH].max_speed == rig.body.facts(ROLL).max_velocity / 4.0


@pytest.mark.parametrize("pitch", [0.4, -3.0])
@pytest.mark.parametrize(("roll", "position"), [(-1.74, None), (0.5, 0.5)], ids=["too far", "free"])
def test_a_joint_keeps_clear_of_what_the_other_of_its_pair_brings_near(rig, sent, roll, position, pitch):
    table, turn = rig.robot.body.tables[0], 2.0
    rig.robot.place({PITCH: pitch})
    reading = rig.robot.read()
    velocities = [turn if name == PITCH else 0.0 for name in rig.robot.body.joint_names]
    rig.body.read = lambda: dataclasses.replace(reading, velocities=tuple(velocities))
    at = reading.positions[rig.body.index(PITCH)]
    lower, upper = table.over((at, at + 0.06 * turn))
    limited = rig.guard.command({PITCH: stiffly(0.0), ROLL: stiffly(roll)}, "ann")
    position = lower if position is None else position
    assert (sent[ROLL].position, sent[ROLL].lower, sent[ROLL].upper) == (position, lower, upper)
    assert limited == ({} if roll == position else {ROLL: stiffly(lower)})
    speed = OPTIONS.speed_fraction * rig.body.facts(ROLL).max_velocity
    assert sent[PITCH].max_speed == pytest.approx(0.5 * speed / table.steepest)
