"""What is reported of a robot's condition, and that it is reported once."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from interfaces.nao import Severity
from naoserver.bodies.capabilities import BatteryReading, Pose, Truth
from naoserver.bodies.parts import NO_TURN
from naoserver.fake import FakeRobot
from naoserver.robot import BodyState
from naoserver.safety._event_log import ConditionWatch, EventLog
from tests.support.bodies import ARM
from zenoh_ice import VirtualClock


class ConditionedRobot(FakeRobot):
    """A fake robot whose condition a test sets."""

    stiffness = 1.0

    def __init__(self, clock, body):
        super().__init__(clock=clock, body=body)
        self.temperatures = {}
        self.senses = None  # type: ignore[assignment]

    def charge(self, charge, current, *, plugged):
        battery = BatteryReading(charge, current, 30.0, plugged=plugged)
        reading = SimpleNamespace(battery=battery)
        self.senses = SimpleNamespace(read=lambda: reading)  # type: ignore[assignment]

    def read(self):
        reading = super().read()
        names = [joint.name for joint in self.joints]
        return replace(
            reading,
            temperatures=tuple(self.temperatures.get(name, 38.0) for name in names),
            stiffnesses=(self.stiffness,) * len(names),
        )


class Rig:
    def __init__(self, body=None):
        clock = VirtualClock()
        self.robot = ConditionedRobot(clock, body)
        self.events = EventLog(clock.now, clock.now)
        self.watch = ConditionWatch(self.robot, self.events)
        self.reported = 0
        self.clock = clock

    def look(self, *, fallen=False, tilt=0.0):
        """Look, and return the new reports."""
        self.clock.advance(2.0)
        self.watch.poll(BodyState(math.radians(tilt), fallen, 1.0, 0.0))
        events = self.events.snapshot()[0][self.reported :]
        self.reported += len(events)
        return [(event.level, event.source, event.message.split(":")[0]) for event in events]


@pytest.fixture
def rig():
    return Rig()


def test_a_robot_that_is_well_has_nothing_to_report(rig):
    assert rig.look() == rig.look() == []


def test_a_fall_and_standing_up_are_reported_once(rig):
    assert rig.look(fallen=True, tilt=90) == [(Severity.Error, "Nao H25", "fallen")]
    assert rig.look(fallen=True, tilt=85) == []
    assert rig.look(tilt=2) == [(Severity.Info, "Nao H25", "upright again")]
    assert rig.look(fallen=True, tilt=90) == [(Severity.Error, "Nao H25", "fallen")]


def test_a_robot_that_falls_through_the_floor_is_reported_until_it_is_back(rig):
    reported = []
    for height in (0.3, -2.0, -90.0, 0.3):
        truth = Truth(0.0, Pose((0.0, 0.0, height), NO_TURN), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), {})
        rig.robot.stage = SimpleNamespace(truth=lambda truth=truth: truth)
        reported.append(rig.look())
    under = (Severity.Error, "Nao H25", "under the floor")
    assert reported == [[], [under], [], [(Severity.Info, "Nao H25", "above the floor again")]]


def test_motors_that_let_go_and_hold_again_are_reported(rig):
    rig.robot.stiffness = 0.0
    assert rig.look() == [(Severity.Warning, "Nao H25", "limp")]
    assert rig.look() == []
    rig.robot.stiffness = 0.6
    assert rig.look() == [(Severity.Info, "Nao H25", "no longer limp")]


def test_a_hot_motor_is_reported_until_it_has_cooled_down_well(rig):
    reported = []
    for temperature in (74.0, 76.0, 74.0, 76.0, 69.0, 76.0):
        rig.robot.temperatures = {"LKneePitch": temperature}
        reported.append(rig.look())
    hot, cool = (Severity.Warning, "LKneePitch", "hot"), (Severity.Info, "LKneePitch", "cool again")
    assert reported == [[], [hot], [], [], [cool], [hot]]


@pytest.mark.parametrize(
    ("charges", "reported"),
    [
        ((0.5, 0.19, 0.21, 0.19), ["Warning"]),
        ((0.19, 0.1, 0.06, 0.05), ["Warning", "Error"]),
        ((0.01,), ["Error"]),
        ((0.19, 0.3, 0.19), ["Warning", "Warning"]),
    ],
)
def test_a_battery_that_runs_low_is_reported_at_each_mark(rig, charges, reported):
    levels = []
    for charge in charges:
        rig.robot.charge(charge, -1.0, plugged=False)
        levels += [level.name for level, _, _ in rig.look()]
    assert levels == reported


def test_of_a_body_without_such_facts_neither_motors_nor_battery_are_reported():
    rig = Rig(ARM)
    rig.robot.temperatures = {"bend": 500.0}
    rig.robot.charge(math.nan, 0.0, plugged=False)
    assert rig.look() == []


def test_a_battery_that_is_charged_is_not_reported(rig):
    rig.robot.charge(0.01, 1.0, plugged=True)
    assert rig.look() == []


def test_a_battery_whose_charge_is_unknown_is_not_called_empty(rig):
    reported = []
    for charge in (0.8, math.nan, math.nan, 0.8):
        rig.robot.charge(charge, -1.0, plugged=False)
        reported.append(rig.look())
    unknown, known = (Severity.Warning, "Battery", "unknown"), (Severity.Info, "Battery", "known")
    assert reported == [[], [unknown], [], [known]]
