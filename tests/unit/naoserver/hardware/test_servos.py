"""A robot of servos: how goals become small steps, and what becomes of servos and of a bus that are lost."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from itertools import pairwise

import pytest

from naoserver.bodies.parts import Link
from naoserver.body import Body
from naoserver.errors import HardwareFailure, RobotError
from naoserver.hardware.lifecycle import End, Start
from naoserver.hardware.servos import SERVO_LIMITS, Servo, ServoRobot
from naoserver.robot import JointFault
from tests.support.bodies import ARM
from tests.support.waiting import until

HASTY = replace(SERVO_LIMITS, retry=0.01, answer=0.1, silence=0.2, hang=0.3)
FIRST = ARM.joint_names[0]
LOST = JointFault("lost: its servo does not answer", lost=True)


class MemoryBus:
    """Servos that are at once where they are sent. Implements ServoBus."""

    def __init__(self) -> None:
        self.lost = threading.Event()
        self.servos = {name: Servo(0.0, stiffness=0.0) for name in ARM.joint_names}
        self.silent: set[str] = set()
        self.sent: list[Mapping[str, float]] = []
        self.given: list[Mapping[str, float]] = []
        self.trouble: BaseException | None = None
        self.at_close: BaseException | None = None
        self.answers = threading.Event()
        self.answers.set()

    def connect(self, _seconds: float) -> MemoryBus:
        self.lost.clear()
        return self

    def read(self) -> Mapping[str, Servo]:
        if self.trouble is not None:
            raise self.trouble
        self.answers.wait()
        return {name: servo for name, servo in self.servos.items() if name not in self.silent}

    def move(self, setpoints: Mapping[str, float]) -> None:
        self.sent.append(setpoints)
        for name, angle in setpoints.items():
            self.servos[name] = replace(self.servos[name], position=angle)

    def stiffen(self, stiffnesses: Mapping[str, float]) -> None:
        self.given.append(stiffnesses)
        for name, value in stiffnesses.items():
            self.servos[name] = replace(self.servos[name], stiffness=value)

    def close(self) -> None:
        self.lost.set()
        if self.at_close is not None:
            raise self.at_close

    def positions(self, joint: str) -> list[float]:
        """Return the setpoints that were sent to a joint."""
        return [each[joint] for each in self.sent.copy() if joint in each]


@pytest.fixture
def bus() -> MemoryBus:
    return MemoryBus()


@pytest.fixture
def robot(bus: MemoryBus) -> Iterator[ServoRobot]:
    with closing(ServoRobot(ARM, bus.connect, limits=HASTY, start=Start.STIFFEN)) as robot:
        robot.start()
        until(lambda: robot.read().stiffnesses == (1.0,) * len(ARM.joints))
        yield robot


def test_goals_are_sent_in_small_steps_no_faster_than_they_say(robot: ServoRobot, bus: MemoryBus) -> None:
    robot.command_positions({FIRST: 0.3}, {FIRST: 1.0})
    until(lambda: bus.positions(FIRST)[-1] == 0.3)
    sent = bus.positions(FIRST)
    steps = [after - before for before, after in pairwise(sent)]
    assert 0.0 < max(steps) <= 2 * HASTY.period + 1e-9
    assert robot.read().positions[0] == pytest.approx(0.3, abs=0.05)


def test_a_velocity_moves_to_the_end_of_the_range_at_most_and_0_holds(
    robot: ServoRobot, bus: MemoryBus
) -> None:
    robot.command_velocities({FIRST: 0.5})
    until(lambda: robot.read().positions[0] > 0.05)
    robot.command_velocities({FIRST: 0.0})
    count = len(bus.positions(FIRST))
    until(lambda: len(bus.positions(FIRST)) > count + 5)
    assert len(set(bus.positions(FIRST)[count + 1 :])) == 1
    robot.command_velocities({FIRST: 100.0})
    until(lambda: robot.read().positions[0] == ARM.joints[0].upper)


def test_a_limp_joint_is_sent_nowhere_and_does_not_jump_when_it_holds_again(
    robot: ServoRobot, bus: MemoryBus
) -> None:
    robot.command_stiffnesses({FIRST: 0.0}, 0.0)
    until(lambda: robot.read().stiffnesses[0] == 0.0)
    robot.command_positions({FIRST: 0.5}, {FIRST: 1.0})
    bus.servos[FIRST] = replace(bus.servos[FIRST], position=0.2)  # a hand moves it
    until(lambda: robot.read().commands[0] == 0.2)
    bus.sent.clear()
    robot.command_stiffnesses({FIRST: 1.0}, 0.0)
    until(lambda: bool(bus.positions(FIRST)))
    assert set(bus.positions(FIRST)) == {0.2}


def test_a_command_right_after_a_motor_was_made_stiff_is_obeyed(robot: ServoRobot) -> None:
    robot.command_stiffnesses({FIRST: 0.0}, 0.0)
    until(lambda: robot.read().stiffnesses[0] == 0.0)
    robot.command_stiffnesses({FIRST: 1.0}, 0.0)
    robot.command_positions({FIRST: 0.1}, {FIRST: 1.0})
    until(lambda: robot.read().positions[0] == 0.1)


def test_a_servo_that_falls_silent_is_sent_nowhere_and_is_found_where_it_is(
    robot: ServoRobot, bus: MemoryBus
) -> None:
    robot.command_positions({FIRST: 1.0}, {FIRST: 0.5})
    bus.silent.add(FIRST)
    until(lambda: robot.read().faults == {FIRST: LOST})
    assert all(FIRST not in each for each in bus.sent[-1:])
    bus.servos[FIRST] = replace(bus.servos[FIRST], position=-0.1)
    bus.silent.clear()
    until(lambda: robot.read().faults == {})
    until(lambda: robot.read().commands[0] == -0.1)
    count = len(bus.sent)
    until(lambda: len(bus.sent) > count + 3)
    assert robot.read().positions[0] == -0.1, "its old goal is forgotten"


def test_a_servo_that_does_not_answer_at_the_start_is_lost(bus: MemoryBus) -> None:
    bus.silent.add(FIRST)
    with closing(ServoRobot(ARM, bus.connect, limits=HASTY)) as robot:
        robot.start()
        assert robot.read().faults == {FIRST: LOST}


@pytest.mark.parametrize("trouble", [OSError(5, "Input/output error"), HardwareFailure("the line broke")])
def test_a_broken_line_is_opened_again_and_commands_meanwhile_do_nothing(
    robot: ServoRobot, bus: MemoryBus, trouble: Exception
) -> None:
    robot.command_positions({FIRST: 1.0}, {FIRST: 0.5})
    bus.trouble = trouble
    until(lambda: robot.state().real_time_factor == 0.0)
    last = robot.read()
    robot.command_positions({FIRST: -1.0}, {FIRST: 1.0})
    assert robot.read() == last, "what was measured last"
    bus.trouble = None
    until(lambda: robot.state().real_time_factor == 1.0)
    bus.sent.clear()
    until(lambda: len(bus.sent) > 3)
    assert set(bus.positions(FIRST)) == {robot.read().positions[0]}


def test_a_bus_that_hangs_is_lost_until_it_answers(robot: ServoRobot, bus: MemoryBus) -> None:
    bus.answers.clear()
    until(lambda: robot.state().real_time_factor == 0.0)
    bus.answers.set()
    until(lambda: robot.state().real_time_factor == 1.0)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_servo_that_answers_no_number_counts_as_silent_and_is_sent_none(
    robot: ServoRobot, bus: MemoryBus, value: float
) -> None:
    was, bus.servos[FIRST] = bus.servos[FIRST], Servo(value, value, stiffness=0.0)
    until(lambda: robot.read().faults == {FIRST: LOST})
    assert math.isfinite(robot.read().positions[0])
    bus.servos[FIRST] = was
    until(lambda: robot.read().faults == {})
    assert all(map(math.isfinite, bus.positions(FIRST)))


class TornBus(MemoryBus):
    """A line that breaks when something is sent."""

    def move(self, setpoints: Mapping[str, float]) -> None:
        raise OSError(5, "Input/output error")


def test_a_line_that_breaks_at_the_first_poll_is_an_error_at_the_start() -> None:
    bus = TornBus()
    with closing(ServoRobot(ARM, bus.connect, limits=HASTY)) as robot:
        with pytest.raises(RobotError, match="no link to the robot: Input/output error"):
            robot.start()
        assert bus.lost.is_set()


@pytest.mark.parametrize("trouble", [KeyError("steps"), SystemExit("steps")])
@pytest.mark.parametrize("at_close", [None, OSError("it is closed"), SystemExit(0)])
def test_what_is_wrong_with_the_code_of_a_bus_is_said_while_it_is_lost(
    robot: ServoRobot,
    bus: MemoryBus,
    trouble: BaseException,
    at_close: BaseException | None,
    caplog: pytest.LogCaptureFixture,
) -> None:
    bus.at_close, bus.trouble = at_close, trouble
    until(lambda: f"still lost: finding it failed: {trouble!r}" in caplog.text)
    bus.at_close = bus.trouble = None
    until(lambda: robot.state().real_time_factor == 1.0)


@pytest.mark.parametrize("trouble", [FileNotFoundError(2, "No such file", "/dev/no"), None])
def test_a_bus_that_is_not_there_is_an_error_at_the_start(bus: MemoryBus, trouble: Exception | None) -> None:
    def connect(_seconds: float) -> MemoryBus:
        if trouble is not None:
            raise trouble
        return bus

    bus.silent.update(ARM.joint_names)
    with closing(ServoRobot(ARM, connect, limits=HASTY)) as robot, pytest.raises(RobotError) as refused:
        robot.start()
    assert ("/dev/no" if trouble else "no servo answers") in str(refused.value)


def test_a_bus_of_another_robot_is_an_error_at_the_start(bus: MemoryBus) -> None:
    bus.servos["tail"] = Servo(0.0)
    robot = ServoRobot(ARM, bus.connect, limits=HASTY)
    with closing(robot), pytest.raises(HardwareFailure, match="a joint 'tail', which arm lacks"):
        robot.start()


def test_a_robot_that_is_stopped_does_not_hold_at_the_start(
    bus: MemoryBus, caplog: pytest.LogCaptureFixture
) -> None:
    with closing(ServoRobot(ARM, bus.connect, limits=HASTY, start=Start.STIFFEN)) as robot:
        robot.lifecycle.is_stopped = lambda: True
        robot.start()
        until(lambda: len(bus.sent) > 3)
    assert bus.given == []
    assert "still stopped: it stays as it is" in caplog.text


def test_the_end_lets_every_motor_go_limp_if_it_is_to(bus: MemoryBus) -> None:
    for end, limp in ((End.LEAVE, []), (End.LIMP, [dict.fromkeys(ARM.joint_names, 0.0)])):
        bus.given.clear()
        with closing(ServoRobot(ARM, bus.connect, limits=HASTY, end=end)) as robot:
            robot.start()
        assert bus.given == limp
        assert bus.lost.is_set()


def test_a_closed_robot_takes_no_pictures_and_has_no_camera_without_one(robot: ServoRobot) -> None:
    assert robot.cameras == ()
    with pytest.raises(HardwareFailure, match="there is no camera 'Camera'"):
        robot.capture("Camera", 320, 240)
    robot.close()
    with pytest.raises(HardwareFailure, match="is closed"):
        robot.capture("Camera", 320, 240)


def test_a_body_without_joints_is_none_of_servos(bus: MemoryBus) -> None:
    body = Body(name="Post", mounted=True, links=(Link(name="base", mass=1.0),))
    with pytest.raises(RobotError, match="Post has no joint"):
        ServoRobot(body, bus.connect)
