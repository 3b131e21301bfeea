"""Commands with gains by a weight: blended with what a joint holds, to which it goes back; in virtual time."""

from __future__ import annotations

import pytest
from msgspec.structs import astuple

from interfaces.nao import JointCommand
from naoserver.bodies import find_body
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.safety.gain_guard import RETURN_TIME
from naoserver.serving.assembly import Assembly
from zenoh_ice import VirtualClock

OPTIONS = SafetyOptions()
JOINT = "Left_Elbow_Pitch"
GIVEN = JointCommand(position=1.0, velocity=0.4, torque=0.8, kp=40.0, kd=2.0)


class Rig:
    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock, body=find_body("T1"))
        self.assembly = Assembly(self.robot, ServerOptions(), self.clock)
        self.body = self.assembly.body
        assert self.assembly.gains is not None
        self.guard = self.assembly.gains
        self.held = self.at()
        gear = self.robot.body.gears[self.robot.body.joint[JOINT].gear]
        self.rest = (self.held, 0.0, 0.0, gear.stiffness, gear.damping)
        self.sent: tuple[float, ...] = ()
        command = self.robot.command_gains

        def spied(commands):
            self.sent = commands[JOINT][:5] if JOINT in commands else self.sent
            command(commands)

        monkeypatch.setattr(self.robot, "command_gains", spied)

    def follow(self, weight: float, client: str = "ann") -> None:
        self.guard.command({JOINT: GIVEN}, client, {JOINT: weight})

    def live(self, seconds: float) -> None:
        for _ in range(round(seconds / OPTIONS.period)):
            self.clock.advance(OPTIONS.period)
            self.assembly.jobs[0].run()

    def mixed(self, weight: float) -> object:
        pairs = zip(astuple(GIVEN), self.rest, strict=True)
        mixed = [weight * one + (1 - weight) * two for one, two in pairs]
        return pytest.approx(mixed, abs=1e-6)

    def at(self) -> float:
        return self.robot.read().positions[self.body.index(JOINT)]

    @property
    def is_free(self) -> bool:
        return not (self.guard.moves_for("ann") or self.guard.moves_for("ben"))


@pytest.fixture
def rig(monkeypatch):
    rig = Rig(monkeypatch)
    yield rig
    rig.robot.close()


@pytest.mark.parametrize("weight", [0.0, 0.25, 1.0])
def test_a_joint_follows_by_the_weight_and_else_holds_as_it_did(rig, weight):
    rig.follow(weight)
    assert rig.sent == rig.mixed(weight)


def test_a_joint_that_was_limp_is_as_strong_as_its_weight(rig):
    rig.body.stiffen({JOINT: 0.25}, 0.1)
    rig.live(0.2)
    rig.rest = (*rig.rest[:3], 0.25 * rig.rest[3], 0.25 * rig.rest[4])
    rig.follow(0.1)
    assert rig.sent == rig.mixed(0.1)


def test_what_is_beyond_a_limit_counts_as_the_limit(rig):
    facts = rig.body.facts(JOINT)
    wild = JointCommand(position=99.0, velocity=0.0, torque=-1e30, kp=1e30, kd=-1.0)
    assert rig.guard.command({JOINT: wild}, "ann", {JOINT: 0.1}).keys() == {JOINT}
    gains = rig.robot.body.gains
    limits = (facts.upper, 0.0, -facts.max_torque, gains.kp, 0.0)
    pairs = zip(limits, rig.rest, strict=True)
    assert rig.sent == pytest.approx([0.1 * one + 0.9 * two for one, two in pairs], abs=1e-6)


def test_what_it_held_is_that_from_before_the_first_command(rig):
    for _ in range(20):
        rig.follow(1.0)
        rig.live(0.1)
    rig.follow(0.5)
    assert rig.sent == rig.mixed(0.5)


@pytest.mark.parametrize("end", ["silence", "loss", "let go"])
@pytest.mark.parametrize("weight", [1.0, 0.5])
def test_the_weight_falls_by_1_a_second_and_then_the_joint_rests(rig, end, weight):
    rig.follow(weight)
    if end == "silence":
        rig.live(OPTIONS.gains_timeout)
    elif end == "loss":
        rig.guard.drop_client("ann")
    else:
        rig.guard.let_go("ann")
    rig.live(0.3)
    half = weight - 0.3 / RETURN_TIME
    assert rig.sent[3] == pytest.approx(rig.rest[3] + half * (GIVEN.kp - rig.rest[3]))
    rig.live(weight * RETURN_TIME - 0.3 + 2 * OPTIONS.period)
    assert rig.is_free
    rig.live(1.0)
    assert rig.at() == pytest.approx(rig.held, abs=1e-3)


def test_events_say_that_it_lets_go(rig):
    rig.follow(1.0)
    rig.guard.drop_client("ann")
    newest = rig.assembly.events.snapshot()[0][-1]
    assert newest.message == f"let go of {JOINT}: the client that commanded it is gone"


def test_events_say_damped_if_not_all_of_them_go_back(rig):
    rig.follow(1.0)
    rig.guard.command({"Right_Elbow_Pitch": GIVEN}, "ann")
    rig.guard.drop_client("ann")
    assert rig.assembly.events.snapshot()[0][-1].message.startswith(f"damped {JOINT}, Right_Elbow_Pitch:")


def test_who_commands_again_meanwhile_goes_on(rig):
    rig.follow(1.0)
    rig.live(OPTIONS.gains_timeout + 0.5)
    rig.follow(1.0)
    assert rig.sent == rig.mixed(1.0)
    rig.live(OPTIONS.gains_timeout - OPTIONS.period)
    assert rig.sent == rig.mixed(1.0)


def test_another_client_may_take_it_over_meanwhile_and_it_rests_where_it_did(rig):
    rig.follow(1.0)
    rig.guard.drop_client("ann")
    rig.live(0.5)
    rig.follow(0.5, "ben")
    assert rig.sent == rig.mixed(0.5)


def test_a_stop_holds_it_where_it_is(rig):
    rig.follow(1.0)
    rig.live(0.1)
    rig.guard.let_go("ann")
    rig.live(0.3)
    rig.assembly.gate.stop("a test")
    there = rig.at()
    assert there != pytest.approx(rig.held, abs=0.05)
    rig.live(2.0)
    assert rig.is_free
    assert rig.at() == pytest.approx(there, abs=0.02)


def test_under_the_lease_of_another_it_is_released_all_the_same(rig):
    rig.follow(1.0)
    rig.guard.let_go("ann")
    rig.assembly.gate.acquire("ben", "dance", 30.0)
    rig.live(RETURN_TIME + 0.1)
    assert rig.is_free
    rig.body.move({JOINT: 0.0}, {JOINT: 1.0}, client="ben")


def test_to_let_go_leaves_what_is_commanded_without_a_weight(rig):
    rig.guard.command({JOINT: GIVEN}, "ann")
    rig.guard.let_go("ann")
    rig.live(0.1)
    assert rig.sent == astuple(GIVEN)
