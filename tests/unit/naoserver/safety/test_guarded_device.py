"""A device behind its safety layer: what reaches it, what is reported, and what the watchdog stops."""

import threading
from dataclasses import replace

import pytest

from interfaces.nao import Severity
from naoserver.bodies.nao import H25
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.fake import FakeDevice
from naoserver.options import SafetyOptions
from naoserver.protocol.jobs import JobThreads, Watchdog
from naoserver.robot import JointFault
from naoserver.safety._event_log import KEPT, EventLog
from naoserver.safety._gate import Gate
from naoserver.safety._guarded_device import GuardedDevice
from naoserver.safety._limits import JointSafety
from tests.support.limits import EVENT_LIMIT
from zenoh_ice import VirtualClock, WallClock


class Rig:
    def __init__(self, clock, device=None):
        self.wall = 0.0
        self.due = None
        self.events = EventLog(clock.now, lambda: self.wall)
        self.device = device or FakeDevice("Nao", H25.joints, clock, {})
        safety = JointSafety(H25.joints, SafetyOptions(), H25.tables, H25.couplings, H25.speed_rules)
        self.gate = Gate(self.events)
        self.guarded = GuardedDevice(self.device, safety, self.gate, self.check_within)

    def check_within(self, seconds):
        self.due = seconds

    def commands(self):
        return dict(zip(H25.joint_names, self.device.read().commands, strict=True))

    def velocities(self):
        return dict(zip(H25.joint_names, self.device.read().velocities, strict=True))


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def rig(clock):
    return Rig(clock)


def test_a_command_reaches_the_device(rig, clock):
    rig.guarded.move({"LKneePitch": 0.4}, {})
    clock.advance(2.0)
    assert rig.commands()["LKneePitch"] == pytest.approx(0.4)
    assert rig.due is None, "there is nothing to watch over"


def test_a_joint_is_measured_behind_its_setpoint(rig, clock):
    rig.guarded.move({"LKneePitch": 0.4}, {})
    clock.advance(0.1)
    measured, set_ = (rig.guarded.angles(measured=each)["LKneePitch"] for each in (True, False))
    reading, place = rig.device.read(), rig.guarded.index("LKneePitch")
    assert (measured, set_) == (reading.positions[place], reading.commands[place])
    assert 0.0 < measured < set_


def test_a_command_that_must_be_watched_says_within_what_time(rig):
    rig.guarded.drive({"HeadYaw": 0.4}, "client")
    assert rig.due == pytest.approx(0.02)


@pytest.mark.parametrize("error", [OSError("no bus"), SystemExit("no bus")])
@pytest.mark.parametrize("end", ["timeout", "drop", "hold", "emergency"])
def test_a_stop_that_the_driver_fails_is_repeated(rig, clock, monkeypatch, end, error):
    def fails(*_):
        raise error

    rig.gate.on_stop(rig.guarded.hold)
    rig.guarded.drive({"HeadYaw": 0.4}, "client")
    clock.advance(0.2)
    rig.wall = 0.2 if end != "timeout" else 0.6
    stops = {
        "timeout": rig.guarded.watch,
        "drop": lambda: rig.guarded.drop_client("client"),
        "hold": rig.guarded.hold,
        "emergency": lambda: rig.gate.stop("a test"),
    }
    with monkeypatch.context() as broken:
        broken.setattr(rig.device, "command_velocities", fails)
        for stop in (stops[end], rig.guarded.watch):
            with pytest.raises(type(error)):
                stop()
    rig.guarded.watch()
    clock.advance(0.5)
    there = rig.commands()["HeadYaw"]
    clock.advance(0.5)
    assert rig.commands()["HeadYaw"] == there
    assert rig.velocities()["HeadYaw"] == pytest.approx(0.0, abs=1e-3)


def test_a_command_that_the_driver_fails_leaves_its_joints_held_and_others_moving(rig, clock, monkeypatch):
    send = rig.device.command_positions

    def fails(*given):
        send(*given)
        raise OSError("no bus")

    rig.guarded.move({"LElbowRoll": -1.0}, {"LElbowRoll": 0.5})
    with monkeypatch.context() as broken:
        broken.setattr(rig.device, "command_positions", fails)
        with pytest.raises(OSError, match="no bus"):
            rig.guarded.move({"HeadYaw": 1.0}, {"HeadYaw": 0.5})
    assert rig.due == 0.0
    rig.guarded.watch()
    clock.advance(3.0)
    assert rig.commands()["HeadYaw"] == pytest.approx(0.0, abs=0.02)
    assert rig.commands()["LElbowRoll"] == pytest.approx(-1.0)
    rig.guarded.move({"HeadYaw": 0.5}, {})
    rig.guarded.watch()
    clock.advance(3.0)
    assert rig.commands()["HeadYaw"] == pytest.approx(0.5)


def test_the_goal_is_that_of_the_newest_command(rig):
    rig.guarded.move({"LElbowRoll": -0.5}, {"LElbowRoll": 0.2})
    assert rig.guarded.goal("LElbowRoll") == (-0.5, 0.2)


def test_an_action_moves_its_joints_faster_than_others_may(rig):
    rig.guarded.claims.claim("the walk", ("LShoulderPitch",), lambda: None)
    fastest = rig.guarded.facts("LShoulderPitch").max_velocity
    rig.guarded.move({"LShoulderPitch": 0.0}, {"LShoulderPitch": fastest}, activity="the walk")
    assert rig.guarded.goal("LShoulderPitch").speed == fastest
    rig.guarded.claims.release("the walk")
    rig.guarded.move({"LShoulderPitch": 0.1}, {"LShoulderPitch": fastest})
    assert rig.guarded.goal("LShoulderPitch").speed == fastest / 2, "the legs are straight"
    assert rig.guarded.speed_cap("LShoulderPitch") == fastest / 2


def test_stiffness_reaches_the_device_until_it_is_closed(rig, clock):
    def stiffness():
        return rig.device.read().stiffnesses[rig.guarded.index("LHand")]

    assert rig.guarded.stiffen({"LHand": 0.4}, 0.0) == {"LHand": 0.4}
    clock.advance(0.1)
    assert stiffness() == 0.4
    rig.guarded.close()
    rig.guarded.stiffen({"LHand": 0.9}, 0.0)
    clock.advance(0.1)
    assert stiffness() == 0.4


def test_only_the_joints_that_are_named_are_held(rig, clock):
    rig.guarded.move({"LElbowYaw": 0.5, "RElbowYaw": 0.5}, {})
    clock.advance(0.1)
    rig.guarded.hold(("LElbowYaw",))
    left = rig.commands()["LElbowYaw"]
    clock.advance(5.0)
    assert rig.commands()["LElbowYaw"] == left
    assert rig.commands()["RElbowYaw"] == pytest.approx(0.5)


def test_a_client_that_commands_nothing_moves_nothing(rig):
    assert not rig.guarded.moves_for("client")
    rig.guarded.drive({"HeadYaw": 0.5}, "client")
    assert rig.guarded.moves_for("client")
    assert not rig.guarded.moves_for("another")


def test_before_any_command_the_goal_is_where_the_joint_is(rig):
    goal = rig.guarded.goal("LElbowRoll")
    assert (goal.target, goal.speed) == (rig.commands()["LElbowRoll"], 0.0)


def test_a_refused_command_is_neither_counted_nor_reported(rig):
    with pytest.raises(InvalidCommand):
        rig.guarded.move({"Tail": 0.4}, {})
    assert rig.events.snapshot() == ([], 0, 0)


def test_a_limited_command_is_counted_once_and_reported_for_each_joint(rig):
    rig.guarded.move({"LKneePitch": 9.0, "RKneePitch": 9.0}, {})
    events, limited, timeouts = rig.events.snapshot()
    assert (limited, timeouts) == (1, 0)
    assert [event.source for event in events] == ["LKneePitch", "RKneePitch"]


def test_watch_stops_what_was_not_renewed_and_counts_the_command_once(rig, clock):
    rig.guarded.drive({"HeadYaw": 0.5, "HeadPitch": 0.1}, "client")
    assert rig.guarded.watch() == pytest.approx(0.02)
    clock.advance(0.5)
    rig.wall = 0.5
    rig.guarded.watch()
    clock.advance(0.2)
    assert rig.velocities()["HeadYaw"] == pytest.approx(0.0, abs=1e-3)
    events, _, timeouts = rig.events.snapshot()
    assert timeouts == 1
    assert [event.source for event in events] == ["HeadYaw", "HeadPitch"]
    assert {event.message for event in events} == {"stopped: its velocity was not renewed within 0.5 s"}
    assert rig.guarded.watch() is None


def test_a_lost_client_stops_what_it_drove_at_once(rig, clock):
    rig.guarded.drive({"HeadYaw": 0.5}, "client")
    rig.guarded.drop_client("another")
    assert rig.guarded.velocity("HeadYaw") == 0.5
    rig.guarded.drop_client("client")
    assert rig.guarded.velocity("HeadYaw") == 0.0
    clock.advance(0.3)
    assert rig.velocities()["HeadYaw"] == pytest.approx(0.0, abs=1e-3)
    events, _, timeouts = rig.events.snapshot()
    assert "gone" in events[0].message
    assert timeouts == 0


def test_a_lost_client_stops_what_it_sent_somewhere_with_one_event(rig, clock):
    rig.guarded.move({"LKneePitch": 2.0, "RKneePitch": 2.0}, {}, client="client")
    clock.advance(0.5)
    assert rig.guarded.moves_for("client")
    rig.guarded.drop_client("client")
    there = rig.commands()
    assert not rig.guarded.moves_for("client")
    clock.advance(1.0)
    assert rig.commands() == there
    (event,) = rig.events.snapshot()[0]
    expected = "stopped LKneePitch, RKneePitch: the client that commanded it is gone"
    assert (event.source, event.message) == ("Nao", expected)


def test_what_an_action_moves_is_for_the_action_to_end(rig, clock):
    rig.guarded.claims.claim("the walk", ("LKneePitch",), lambda: None)
    rig.guarded.move({"LKneePitch": 0.4}, {}, client="client", activity="the walk")
    rig.guarded.drop_client("client")
    clock.advance(5.0)
    assert rig.commands()["LKneePitch"] == pytest.approx(0.4)


def test_a_command_of_a_client_that_is_gone_already_is_refused(rig):
    rig.gate.is_lost = {"lost"}.__contains__
    for command in (
        lambda: rig.guarded.move({"HeadYaw": 0.5}, {}, client="lost"),
        lambda: rig.guarded.drive({"HeadYaw": 0.5}, "lost"),
        lambda: rig.guarded.stiffen({"HeadYaw": 0.5}, 0.0, client="lost"),
    ):
        with pytest.raises(CommandRefused) as refusal:
            command()
        assert str(refusal.value) == "the client of this command is gone: its link to the robot broke"
    rig.guarded.move({"HeadYaw": 0.5}, {}, client="another")
    # What it began goes on: only who executes an action knows how it may end.
    rig.guarded.stiffen({"HeadYaw": 0.5}, 0.0, client="lost", activity="what it began")
    rig.guarded.move({"HeadYaw": 0.6}, {}, client="lost", activity="what it began")
    assert rig.events.snapshot()[0][0].message == "refused a command: its client is gone"


def test_who_names_no_client_cannot_be_gone(rig):
    rig.gate.is_lost = lambda _client: True
    rig.guarded.move({"HeadYaw": 0.5}, {})
    assert rig.guarded.goal("HeadYaw").target == 0.5
    assert rig.guarded.stiffen({"HeadYaw": 0.5}, 0.0) == {"HeadYaw": 0.5}


def test_close_stops_everything_and_later_commands_do_nothing(rig, clock):
    rig.guarded.move({"LKneePitch": 2.0}, {})
    clock.advance(0.5)
    rig.guarded.close()
    there = rig.commands()
    rig.guarded.move({"LKneePitch": 0.0}, {})
    clock.advance(1.0)
    assert rig.commands() == there


def test_close_leaves_joints_to_what_still_needs_them_to_end(rig, clock):
    asked = []
    rig.guarded.claims.claim("the walk", ("LKneePitch",), lambda: asked.append("stop"))
    rig.guarded.move({"LKneePitch": 0.4}, {}, activity="the walk")
    rig.guarded.move({"LShoulderPitch": 0.0}, {})
    clock.advance(0.1)
    held = rig.commands()["LShoulderPitch"]
    rig.guarded.close()
    clock.advance(5.0)
    assert asked == ["stop"]
    assert rig.commands()["LKneePitch"] == pytest.approx(0.4)
    assert rig.commands()["LShoulderPitch"] == held


def test_events_of_a_kind_are_reported_once_a_second_with_what_was_left_out(rig):
    for step in range(25):
        rig.wall = step * 0.1
        rig.events.add(Severity.Warning, "HeadYaw", f"limited at {step}", "limited")
    messages = [event.message for event in rig.events.snapshot()[0]]
    assert messages == ["limited at 0", "limited at 10 (9 more since the last report)", messages[2]]


def test_only_the_newest_events_are_kept(rig):
    for number in range(KEPT + 5):
        rig.events.add(Severity.Info, f"source {number}", "hello")
    events = rig.events.snapshot()[0]
    assert len(events) == KEPT
    assert events[-1].source == f"source {KEPT + 4}"


class UnreadableOnce(FakeDevice):
    """A device whose first look fails."""

    def __init__(self, clock):
        super().__init__("Nao", H25.joints, clock, {})
        self.failed = threading.Event()
        self.read_again = threading.Event()

    def read(self):
        if threading.current_thread().name == "watchdog":
            if not self.failed.is_set():
                self.failed.set()
                raise OSError("the bus is down")
            self.read_again.set()
        return super().read()


def test_the_watchdog_survives_a_device_that_fails(caplog):
    device = UnreadableOnce(WallClock())
    rig = Rig(WallClock(), device)
    watchdog = Watchdog(WallClock(), lambda: None)
    watchdog.watched.append(rig.guarded)
    with JobThreads([watchdog]):
        assert device.read_again.wait(EVENT_LIMIT)
    assert "the bus is down" in caplog.text


def test_the_watchdog_checks_in_time_after_a_command():
    clock, woken = VirtualClock(), []
    watchdog = Watchdog(clock, lambda: woken.append(clock.now()))
    watchdog.run()
    assert watchdog.due(0.0) == pytest.approx(1.0)
    clock.advance(0.3)
    watchdog.check_within(0.02)
    watchdog.check_within(0.5)  # later than what is due already
    assert watchdog.due(0.3) == pytest.approx(0.32)
    assert woken == [0.3]


def test_no_command_comes_after_an_emergency_stop_even_from_one_under_way(rig, clock):
    rig.gate.on_stop(rig.guarded.hold)
    clients = ("a", "b", "c", "d")
    obeyed = threading.Semaphore(0)
    refused = []

    def hammer(client):
        try:
            while True:
                rig.guarded.drive({"HeadYaw": 0.5}, client)
                obeyed.release()
        except CommandRefused:
            refused.append(client)

    threads = [threading.Thread(target=hammer, args=(client,)) for client in clients]
    for thread in threads:
        thread.start()
    for _ in range(100):
        assert obeyed.acquire(timeout=EVENT_LIMIT)
    rig.gate.stop("now")
    there = rig.commands()["HeadYaw"]
    for thread in threads:
        thread.join(EVENT_LIMIT)
    assert sorted(refused) == list(clients)
    clock.advance(1.0)
    rig.guarded.watch()
    clock.advance(1.0)
    assert rig.commands()["HeadYaw"] == there


def test_who_holds_the_lease_may_command_and_nobody_else_may_but_stop(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    rig.guarded.move({"HeadYaw": 0.4}, {}, client="a")
    for command in (
        lambda: rig.guarded.move({"HeadYaw": 0.4}, {}, client="b"),
        lambda: rig.guarded.move({"HeadYaw": 0.4}, {}),
        lambda: rig.guarded.drive({"HeadYaw": 0.4}, "b"),
        lambda: rig.guarded.stiffen({"HeadYaw": 0.0}, 0.0, client="b"),
    ):
        with pytest.raises(CommandRefused, match="Ann"):
            command()
    rig.guarded.hold()
    assert rig.device.read().stiffnesses[0] == 1.0


def test_a_joint_whose_servo_is_lost_is_refused_by_name_and_a_hold_is_not(clock):
    device = FakeDevice("Nao", H25.joints, clock, {})
    read, lost = device.read, JointFault("lost: its servo does not answer", lost=True)
    device.read = lambda: replace(read(), faults={"HeadYaw": lost, "HeadPitch": JointFault("hot")})  # type: ignore[method-assign]
    rig = Rig(clock, device)
    for command in (
        lambda joint: rig.guarded.move({joint: 0.1}, {}),
        lambda joint: rig.guarded.drive({joint: 0.1}, "client"),
        lambda joint: rig.guarded.stiffen({joint: 0.5}, 0.0),
    ):
        with pytest.raises(InvalidCommand, match="HeadYaw is not reached: lost") as refused:
            command("HeadYaw")
        assert refused.value.field == "HeadYaw"
        command("HeadPitch")
    rig.guarded.hold(["HeadYaw"])


def test_joints_by_which_the_robot_balances_obey_only_what_has_claimed_them(rig):
    rig.guarded.balancing = lambda: ("LKneePitch",)
    for command in (
        lambda: rig.guarded.move({"HeadYaw": 0.1, "LKneePitch": 0.4}, {}),
        lambda: rig.guarded.drive({"LKneePitch": 0.1}, "anna"),
    ):
        with pytest.raises(InvalidCommand, match="LKneePitch keeps the robot upright"):
            command()
    rig.guarded.move({"HeadYaw": 0.1}, {})
    rig.guarded.claims.claim("the kick", ("LKneePitch",), lambda: None)
    rig.guarded.move({"LKneePitch": 0.4}, {}, activity="the kick")
    rig.guarded.hold()
