"""The walk behind its safety layer: what reaches the walker, what is reported, and what ends it."""

import contextlib
import math
from functools import partial

import pytest

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.nao import H25
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.fake.robot import LIMITS, FakeWalker
from naoserver.moves.walk import WalkGuard
from naoserver.options import SafetyOptions
from naoserver.safety._event_log import EventLog
from naoserver.safety._gate import Gate
from naoserver.safety._guarded_device import GuardedDevice
from naoserver.safety._limits import JointSafety
from naoserver_sim.robot import SimulatedRobot
from tests.support.present import present
from zenoh_ice import VirtualClock


class SlowWalker(FakeWalker):
    """Needs a while to end, and can be made unable to walk."""

    def __init__(self, clock, limits=LIMITS):
        super().__init__(clock, H25.groups.legs, limits)
        self.ended = ""
        self.ending = False
        self.hindrance = ""

    def command(self, velocity):
        if velocity != STILL and self.hindrance and not self.walking:
            raise InvalidCommand("walk", self.hindrance)
        self.ending = self.walking and velocity == STILL
        super().command(velocity)

    @property
    def walking(self):
        return self.ending or super().walking

    def fall(self):
        super().command(STILL)
        self.ending, self.hindrance = False, "it lies"

    def give_up(self):
        """End the walk on the feet."""
        super().command(STILL)
        self.ending, self.ended = True, "it does not get on"


class Rig:
    def __init__(self, body=H25, make_robot=FakeRobot):
        self.clock = VirtualClock()
        self.wall = 0.0
        self.due: list[float] = []
        self.events = EventLog(self.clock.now, lambda: self.wall)
        self.gate = Gate(self.events)
        self.robot = make_robot(clock=self.clock)
        safety = JointSafety(body.joints, SafetyOptions(), body.tables, body.couplings, body.speed_rules)
        self.body = GuardedDevice(self.robot, safety, self.gate, self.due.append)
        self.walker = self.make_walker()
        self.walk = WalkGuard(self.walker, self.body, SafetyOptions())
        self.gate.on_stop(self.body.hold)
        self.gate.on_stop(self.walk.stop)

    def make_walker(self):
        return SlowWalker(self.clock)

    def reported(self):
        return [event.message for event in self.events.snapshot()[0]]


@pytest.fixture
def rig():
    return Rig()


def test_velocities_are_commanded_one_by_one_and_add_up(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.walk.drive({"turn": -0.4}, "anna")
    assert rig.walker.commanded() == rig.walk.commanded() == WalkVelocity(0.1, 0.0, -0.4)
    rig.walk.drive({"forward": 0.0}, "anna")
    assert rig.walker.commanded() == WalkVelocity(turn=-0.4)


@pytest.mark.parametrize("kind", ["forward", "left", "turn"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_is_too_fast_is_limited_and_reported(rig, kind, sign):
    highest = getattr(LIMITS, kind)
    assert not rig.walk.drive({kind: sign * highest}, "anna")
    assert rig.reported() == []
    assert rig.walk.drive({kind: sign * 2 * highest}, "anna")
    assert getattr(rig.walker.commanded(), kind) == sign * highest
    assert kind in rig.reported()[0]
    assert rig.events.snapshot()[1] == 1


class NoSidewaysRig(Rig):
    """Of a robot that goes forwards and turns, like one on wheels."""

    def make_walker(self):
        return SlowWalker(self.clock, WalkVelocity(forward=0.3, turn=0.9))


@pytest.mark.parametrize(
    ("limits", "kind", "velocity", "expected"),
    [
        (None, "forward", 0.5, "forward velocity 0.5 is too high, limited to 0.3"),
        (WalkVelocity(forward=0.1), "forward", -0.5, "forward velocity -0.5 is too high, limited to -0.1"),
        (WalkVelocity(turn=1.0), "forward", 0.5, "forward velocity 0.5 is too high, limited to 0"),
        (None, "left", 0.1, "left velocity 0.1 is of no use: the robot cannot go sideways, limited to 0"),
        (None, "left", -0.1, "left velocity -0.1 is of no use: the robot cannot go sideways, limited to 0"),
    ],
)
def test_what_the_robot_cannot_is_told_from_what_is_too_high(limits, kind, velocity, expected):
    rig = NoSidewaysRig()
    assert rig.walk.drive({kind: velocity, "turn": 0.5}, "anna", limits)
    assert rig.reported() == [expected]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused_by_name_and_changes_nothing(rig, value):
    rig.walk.drive({"forward": 0.1}, "anna")
    with pytest.raises(InvalidCommand, match="left") as refusal:
        rig.walk.drive({"forward": 0.2, "left": value}, "anna")
    assert refusal.value.field == "left"
    assert rig.walker.commanded() == WalkVelocity(0.1)


def test_each_velocity_that_is_not_renewed_in_half_a_second_stops_by_itself(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    assert rig.due[-1] <= SafetyOptions().period
    rig.wall = 0.3
    rig.walk.drive({"turn": 0.4}, "anna")
    rig.wall = 0.49
    rig.walk.watch()
    assert rig.walker.commanded() == WalkVelocity(0.1, 0.0, 0.4)
    rig.wall = 0.5
    assert rig.walk.watch() == SafetyOptions().period
    assert rig.walker.commanded() == WalkVelocity(turn=0.4)
    assert rig.reported() == ["stopped (forward): its velocity was not renewed in time"]
    rig.wall = 0.81
    rig.walk.watch()
    assert rig.walker.commanded() == STILL
    assert rig.events.snapshot()[2] == 2


def test_a_lost_client_stops_what_it_drove_and_no_more(rig):
    rig.walk.drive({"forward": 0.1, "left": 0.05}, "anna")
    rig.walk.drive({"turn": 0.4}, "ben")
    assert rig.walk.moves_for("anna")
    rig.walk.drop_client("anna")
    assert not rig.walk.moves_for("anna")
    assert rig.walk.moves_for("ben")
    assert rig.walker.commanded() == WalkVelocity(turn=0.4)
    rig.walk.drop_client("ben")
    assert rig.walker.commanded() == STILL
    assert rig.reported() == ["stopped (forward and left): the client that drove it is gone"]


@pytest.mark.parametrize("error", [OSError("no line"), SystemExit("no line")])
@pytest.mark.parametrize("end", ["timeout", "drop", "stop", "emergency"])
def test_a_stop_that_the_driver_fails_is_repeated(rig, monkeypatch, end, error):
    def fails(_velocity):
        raise error

    rig.walk.drive({"forward": 0.1}, "anna")
    rig.wall = 0.6 if end == "timeout" else 0.2
    stops = {
        "timeout": rig.walk.watch,
        "drop": lambda: rig.walk.drop_client("anna"),
        "stop": rig.walk.stop,
        "emergency": lambda: rig.gate.stop("a test"),
    }
    with monkeypatch.context() as broken:
        broken.setattr(rig.walker, "command", fails)
        with contextlib.suppress(type(error)):  # the body may have let it end already
            stops[end]()
        assert rig.walker.commanded() != STILL
    rig.wall = 0.6
    rig.walk.watch()
    assert rig.walker.commanded() == STILL


@pytest.mark.parametrize("error", [OSError("no line"), SystemExit("no line")])
def test_a_velocity_that_the_driver_fails_half_way_ends_in_time(rig, monkeypatch, error):
    command = rig.walker.command

    def fails(velocity):
        command(velocity)
        raise error

    with monkeypatch.context() as broken:
        broken.setattr(rig.walker, "command", fails)
        with pytest.raises(type(error)):
            rig.walk.drive({"forward": 0.1}, "anna")
    assert rig.walker.commanded() != STILL
    rig.wall = 0.6
    rig.walk.watch()
    assert rig.walker.commanded() == STILL


@pytest.mark.parametrize("error", [OSError("no line"), SystemExit("no line")])
def test_a_walk_that_the_driver_fails_to_begin_leaves_the_legs_free(rig, monkeypatch, error):
    def fails(_velocity):
        raise error

    with monkeypatch.context() as broken:
        broken.setattr(rig.walker, "command", fails)
        with pytest.raises(type(error)):
            rig.walk.drive({"forward": 0.1}, "anna")
    rig.walk.watch()
    rig.body.move({"RKneePitch": 0.5}, {})


def test_velocities_that_are_not_renewed_together_are_one_event(rig):
    rig.walk.drive({"forward": 0.1, "turn": 0.4}, "anna")
    rig.wall = 0.6
    rig.walk.watch()
    assert rig.reported() == ["stopped (forward and turn): its velocity was not renewed in time"]


def test_while_it_walks_and_until_it_has_ended_the_legs_are_refused_to_others(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    for _ in range(2):
        rig.walk.watch()
        with pytest.raises(InvalidCommand, match="RKneePitch is moved by the walk"):
            rig.body.move({"RKneePitch": 0.5}, {})
        with pytest.raises(InvalidCommand, match="the walk"):
            rig.body.drive({"LAnklePitch": 0.1}, "anna")
        rig.body.move({"HeadYaw": 0.5, "LShoulderPitch": 1.0}, {})
        rig.walk.stop()
    rig.walker.ending = False
    assert rig.walk.watch() is None
    rig.body.move({"RKneePitch": 0.5}, {})


def test_what_takes_the_legs_at_the_very_end_of_the_walk_keeps_them(rig, monkeypatch):
    stopped = []
    release = rig.body.claims.release

    def release_to_dance(activity):
        legs = release(activity)
        if legs:
            rig.body.claims.claim("dance", legs, lambda: stopped.append("dance"))
        return legs

    monkeypatch.setattr(rig.body.claims, "release", release_to_dance)
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.walk.stop()
    rig.walker.ending = False
    assert rig.walk.watch() is None
    assert not stopped
    rig.body.move({"RKneePitch": 0.5}, {}, activity="dance")


def test_where_the_legs_stand_after_a_walk_is_where_they_are_to_be(rig):
    rig.body.move({"RKneePitch": 0.9}, {})
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.robot.place({"RKneePitch": 0.3})
    rig.walk.stop()
    rig.walker.ending = False
    rig.walk.watch()
    assert rig.body.goal("RKneePitch").target == pytest.approx(0.3)


def test_legs_that_belong_to_something_else_do_not_walk(rig):
    rig.body.claims.claim("dance", ("LKneePitch",), lambda: None)
    with pytest.raises(InvalidCommand, match="dance"):
        rig.walk.drive({"forward": 0.1}, "anna")
    assert rig.walker.commanded() == STILL
    rig.walk.drive({"forward": 0.0}, "anna")


def test_to_hold_the_body_ends_the_walk_and_leaves_it_the_legs_to_do_so(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.body.move({"HeadYaw": 1.0}, {})
    rig.clock.advance(0.1)
    rig.body.hold()
    assert rig.walker.commanded() == STILL
    assert rig.walker.walking
    held = rig.robot.read().commands
    rig.clock.advance(2.0)
    assert rig.robot.read().commands == held


def test_after_an_emergency_stop_nobody_walks_until_it_is_reset(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.gate.stop("smoke")
    assert rig.walker.commanded() == STILL
    with pytest.raises(CommandRefused, match="smoke"):
        rig.walk.drive({"forward": 0.1}, "anna")
    rig.gate.reset(resume=True)
    rig.walk.drive({"forward": 0.1}, "anna")
    assert rig.walker.commanded() == WalkVelocity(0.1)


def test_who_does_not_hold_the_lease_does_not_walk(rig):
    rig.gate.acquire("anna", "Anna", 10.0)
    with pytest.raises(CommandRefused, match="Anna"):
        rig.walk.drive({"forward": 0.1}, "ben")
    rig.walk.drive({"forward": 0.1}, "anna")


def test_a_robot_that_cannot_walk_says_why_and_keeps_its_legs_free(rig):
    rig.walker.hindrance = "it lies"
    with pytest.raises(InvalidCommand, match="it lies"):
        rig.walk.drive({"forward": 0.1}, "anna")
    rig.body.move({"RKneePitch": 0.5}, {})
    rig.walk.drive({"forward": 0.0}, "anna")


def test_a_fall_ends_the_walk_and_is_reported(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.walk.watch()
    rig.walker.fall()
    assert rig.walk.watch() is None
    assert rig.walk.commanded() == STILL
    assert rig.reported() == [
        "the robot ended the walk: it fell, its motors became limp, or it was moved",
    ]
    rig.body.move({"RKneePitch": 0.5}, {})
    with pytest.raises(InvalidCommand, match="it lies"):
        rig.walk.drive({"forward": 0.1}, "anna")


def test_a_fall_is_reported_also_when_a_velocity_was_not_renewed_or_its_client_is_lost(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.walk.drive({"left": 0.05}, "ben")
    rig.wall = 0.4
    rig.walk.drive({"turn": 0.3}, "anna")
    rig.walker.fall()
    rig.wall = 0.6
    rig.walk.drop_client("ben")
    assert rig.walk.watch() is None
    assert [message for message in rig.reported() if "walk" in message][-1].startswith(
        "the robot ended the walk"
    )


def test_a_walk_that_the_robot_ends_on_its_feet_is_not_begun_again_by_its_next_velocities(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.walker.give_up()
    for wall in (0.1, 0.4, 0.8):
        rig.wall = wall
        assert rig.walk.drive({"forward": 0.1}, "anna"), "limited"
        rig.walk.drive({"turn": 0.0}, "anna")
        assert rig.walk.commanded() == STILL
    assert rig.reported() == [
        "the robot ended the walk: it does not get on",
        "limited to 0 until it is stopped: it does not get on",
    ]
    rig.walk.drive({"turn": 0.1}, "ben")
    rig.wall = 1.4
    rig.walk.drive({"forward": 0.1}, "anna")
    assert rig.walk.commanded() == WalkVelocity(forward=0.1, turn=0.1)


def test_after_a_stop_it_walks_on_at_once(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.walker.give_up()
    rig.walk.watch()
    rig.walk.stop()
    rig.walk.drive({"forward": -0.1}, "anna")
    assert rig.walk.commanded() == WalkVelocity(forward=-0.1)


def test_the_end_of_a_walk_is_reported_with_the_reason_that_the_robot_gives(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.walker.fall()
    rig.walker.ended = "its knee is too hot"
    assert rig.walk.watch() is None
    assert rig.reported()[-1] == "the robot ended the walk: its knee is too hot"


def stop(rig):
    rig.walk.stop()


def end(rig):
    rig.walker.fall()
    rig.walker.ended = "its knee is too hot"


def command(rig):
    rig.walker.ended = "its knee is too hot"  # before
    rig.walk.drive({"turn": 0.4}, "ben")


@pytest.mark.parametrize(
    ("before", "expected"),
    [
        (stop, "the walk was stopped"),
        (end, "the robot ended the walk: its knee is too hot"),
        (command, "another command of the walk ended it, of ben"),
    ],
)
def test_a_velocity_that_is_to_follow_another_one_comes_too_late_for_a_reason(rig, before, expected):
    rig.walk.drive({"forward": 0.1}, "anna")
    before(rig)
    commanded = rig.walk.commanded()
    with pytest.raises(InvalidCommand) as refusal:
        rig.walk.drive({"forward": 0.2}, "anna", after=WalkVelocity(forward=0.1))
    assert (refusal.value.field, str(refusal.value)) == ("walk", expected)
    assert rig.walk.commanded() == commanded


def test_once_closed_it_walks_no_more(rig):
    rig.walk.drive({"forward": 0.1}, "anna")
    rig.walk.close()
    assert rig.walker.commanded() == STILL
    rig.walk.drive({"forward": 0.1}, "anna")
    assert rig.walker.commanded() == STILL
    rig.walk.close()


class SimulatedCart(Rig):
    def __init__(self):
        cart = find_body("Cart")
        super().__init__(cart, partial(SimulatedRobot, body=cart))

    def make_walker(self):
        return present(self.robot.walker)


@pytest.mark.sim
def test_a_command_that_comes_while_the_robot_ends_the_walk_moves_nothing_unwatched():
    """The thread of the physics takes it at its next tick: only then has the watchdog looked."""
    rig = SimulatedCart()
    rig.walk.drive({"forward": 0.3}, "anna")
    rig.clock.advance(0.2)
    assert rig.walker.walking

    def end_meanwhile(_):
        parts.remove(end_meanwhile)
        rig.walk.drive({"forward": 0.2}, "anna")
        rig.walker.abandon()
        rig.walk.watch()

    parts = rig.robot._simulator.parts
    parts.insert(0, end_meanwhile)
    rig.clock.advance(1.0)
    assert end_meanwhile not in parts
    assert rig.reported() == ["the robot ended the walk: the robot was moved"]
    assert (rig.walker.walking, rig.walker.commanded()) == (False, STILL)
    rig.walk.drive({"forward": 0.3}, "anna")
    rig.clock.advance(1.0)
    assert rig.walker.walking
