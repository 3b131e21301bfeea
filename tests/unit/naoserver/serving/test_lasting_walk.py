"""A walk that lasts as long as a program says, through the guard of a fake robot in virtual time."""

import math

import pytest

from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.errors import CommandRefused, HardwareFailure
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver.serving.lasting_walk import LastingWalk
from tests.support.bodies import ARM
from zenoh_ice import VirtualClock

FORWARD = WalkVelocity(forward=0.05)
SECONDS = 2.0


class Rig:
    """A fake robot behind its guards, and a walk that lasts."""

    def __init__(self):
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock)
        self.assembly = Assembly(self.robot, ServerOptions(), self.clock)
        self.walk = LastingWalk(self.assembly)

    def advance(self, seconds):
        """Advance the time of robot and guards, which renews the walk."""
        for _ in range(round(seconds / 0.1)):
            self.clock.advance(0.1)
            self.walk.renew()
            self.walk.guard.watch()


@pytest.fixture
def rig():
    return Rig()


@pytest.mark.parametrize("seconds", [SECONDS, math.inf])
def test_a_velocity_lasts_for_its_time(rig, seconds):
    rig.walk.go(FORWARD, "Ada", seconds=seconds)
    rig.advance(SECONDS - 0.2)
    assert rig.walk.guard.commanded() == FORWARD


def test_a_velocity_ends_after_its_time(rig):
    rig.walk.go(FORWARD, "Ada", seconds=SECONDS)
    rig.clock.advance(SECONDS)
    rig.walk.renew()
    assert not rig.walk.active


def test_one_that_is_not_renewed_is_stopped_by_the_guard(rig):
    rig.walk.go(FORWARD, "Ada")
    rig.walk.drop("Ada")
    rig.advance(SECONDS)
    assert not rig.walk.active


def test_the_loss_of_another_client_ends_nothing(rig):
    rig.walk.go(FORWARD, "Ada")
    rig.walk.drop("Bob")
    rig.advance(SECONDS)
    assert rig.walk.active


def test_the_end_of_its_time_does_not_end_the_walk_of_another_client(rig):
    rig.walk.go(FORWARD, "Ada", seconds=SECONDS)
    rig.advance(SECONDS - 0.2)
    other = WalkVelocity(turn=0.1)
    rig.walk.guard.drive({"forward": 0.0, "turn": other.turn}, "Bob")
    rig.advance(0.3)
    assert rig.walk.guard.commanded() == other


def test_what_something_else_has_ended_is_not_renewed(rig, caplog):
    rig.walk.go(FORWARD, "Ada")
    rig.walk.guard.stop()
    rig.advance(SECONDS)
    assert not rig.walk.active
    assert [message[:35] for message in caplog.messages] == ["the walk ends: the walk was stopped"]


def test_a_stop_is_never_refused(rig):
    rig.walk.go(FORWARD, "Ada")
    rig.assembly.gate.stop("a test")
    rig.walk.stop()
    with pytest.raises(CommandRefused):
        rig.walk.go(FORWARD, "Ada")
    assert rig.walk.guard.commanded() == STILL


def test_a_robot_that_does_not_walk():
    clock = VirtualClock()
    walk = LastingWalk(Assembly(FakeRobot(clock, body=ARM), ServerOptions(), clock))
    walk.stop()
    assert not walk.active
    with pytest.raises(HardwareFailure, match="this robot does not walk"):
        walk.go(FORWARD, "Ada")


def test_limits_tighter_than_the_robots_hold(rig):
    rig.walk.go(FORWARD, "Ada", WalkVelocity(forward=0.02, left=0.02, turn=0.1))
    rig.advance(SECONDS)
    assert rig.walk.guard.commanded() == WalkVelocity(forward=0.02)


def test_the_velocity_of_any_client_is_dropped(rig):
    rig.walk.go(FORWARD, "Ada")
    rig.walk.drop()
    rig.advance(SECONDS)
    assert not rig.walk.active


def test_the_last_steps_are_of_who_walked_last_here(rig, monkeypatch):
    rig.walk.go(FORWARD, "Ada")
    rig.walk.stop()
    monkeypatch.setattr(LastingWalk, "moving", True)
    assert [rig.walk.moves_for(client) for client in ("Ada", "Ben")] == [True, False]


def test_a_walk_that_another_client_commands_is_its_own(rig):
    rig.walk.go(FORWARD, "Ada")
    rig.walk.guard.drive({"forward": 0.03}, "Ben")
    assert [rig.walk.moves_for(client) for client in ("Ada", "Ben")] == [False, True]
