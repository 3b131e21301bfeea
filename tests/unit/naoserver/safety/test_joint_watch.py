"""What is reported of single joints: faults and losses of their servos, and joints that do not follow."""

from __future__ import annotations

from dataclasses import replace

import pytest

from interfaces.nao import Severity
from naoserver.fake import FakeRobot
from naoserver.robot import JointFault
from naoserver.safety._event_log import EventLog, JointWatch
from tests.support.bodies import ARM
from zenoh_ice import VirtualClock

STEP = 0.5
"""Seconds between two checks, as in a server at the speed of the wall."""


class Rig:
    """The first joint of an arm, as a test sets it, and what is reported of it."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock, body=ARM)
        self.joint = self.robot.joints[0].name
        self.events = EventLog(self.clock.now, self.clock.now)
        self.watch = JointWatch(self.robot, self.events)
        self.reported = 0

    def look(
        self,
        command: float = 0.0,
        position: float = 0.0,
        *,
        stiffness: float = 1.0,
        step: float = STEP,
        faults: dict[str, JointFault] | None = None,
    ) -> list[str]:
        self.clock.advance(step)
        reading = self.robot.read()
        self.watch.poll(
            replace(
                reading,
                commands=(command, *reading.commands[1:]),
                positions=(position, *reading.positions[1:]),
                stiffnesses=(stiffness,) * len(reading.stiffnesses),
                faults=faults or {},
            )
        )
        events = self.events.snapshot()[0][self.reported :]
        self.reported += len(events)
        assert {event.source for event in events} <= {self.joint}
        return [event.message for event in events]


@pytest.fixture
def rig() -> Rig:
    return Rig()


def test_a_joint_that_is_commanded_and_stays_is_reported_once_and_again_when_it_follows(rig: Rig) -> None:
    said = [rig.look(0.42) for _ in range(8)]
    assert said[2:3] == [["does not follow: 0.42 rad behind for 1.0 s"]]
    assert sum(map(len, said)) == 1
    assert rig.look(0.42, 0.41) == ["follows again: 0.01 rad behind"]


def test_one_that_something_holds_at_a_limit_is_told_so(rig: Rig) -> None:
    upper = rig.robot.joints[0].upper
    said = [rig.look(upper - 0.4, upper) for _ in range(4)]
    assert said[2] == [f"does not follow: 0.40 rad behind for 1.0 s, at its limit {upper:.3g}"]


def test_one_that_stays_half_way_is_behind_from_then_on(rig: Rig) -> None:
    assert [rig.look(1.0, place) for place in (0.2, 0.4, 0.6, 0.6)] == [[], [], [], []]
    assert rig.look(1.0, 0.6) == ["does not follow: 0.40 rad behind for 1.0 s"]


@pytest.mark.parametrize(
    ("places", "stiffness"),
    [
        pytest.param([(0.1, 0.0)] * 8, 1.0, id="a load that it bears a little lower"),
        pytest.param([(0.5, 0.0)] * 8, 0.3, id="a soft motor that gives way"),
        pytest.param([(0.5 + 0.1 * n, 0.1 * n) for n in range(8)], 1.0, id="a goal that it runs after"),
        pytest.param([(0.3 * (n % 2), 0.0) for n in range(8)], 1.0, id="a setpoint that comes back"),
    ],
)
def test_nothing_is_said_of(rig: Rig, places: list[tuple[float, float]], stiffness: float) -> None:
    assert [said for place in places if (said := rig.look(*place, stiffness=stiffness))] == []


def test_robot_time_that_runs_fast_is_looked_at_three_times(rig: Rig) -> None:
    assert [rig.look(0.5, step=10.0) for _ in range(2)] == [[], []]
    assert rig.look(0.5, step=10.0) == ["does not follow: 0.50 rad behind for 20.0 s"]


def test_the_last_reading_of_a_lost_robot_says_nothing(rig: Rig) -> None:
    rig.look(0.5)
    assert [rig.look(0.5, step=0.0) for _ in range(8)] == [[]] * 8


def test_a_motor_that_was_let_go_is_not_said_to_follow(rig: Rig) -> None:
    for _ in range(4):
        rig.look(0.5)
    assert rig.look(0.5, stiffness=0.0) == ["is no longer stiff"]


@pytest.mark.parametrize(
    ("fault", "ended"),
    [
        (JointFault("overload: its torque is off"), "its motor reports no fault any more"),
        (JointFault("lost: its servo does not answer", lost=True), "found again"),
    ],
)
def test_a_fault_is_reported_once_and_its_end(rig: Rig, fault: JointFault, ended: str) -> None:
    said = [rig.look(0.5, faults={rig.joint: fault}) for _ in range(6)]
    assert said == [[fault.message], *[[]] * 5], "a joint that cannot follow is not behind"
    assert rig.events.snapshot()[0][-1].level is Severity.Error
    assert rig.look(faults={}) == [ended]
