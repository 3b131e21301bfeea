"""Commands of the G1's arms and waist by a weight, as bytes, in virtual time and without DDS."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

import pytest

from naoserver.options import SafetyOptions
from plugins.makers.tests.support.gates import clients_that_ask
from plugins.makers.tests.support.maker_rigs import MakerRig
from visualhfsm_makers._unitree._arms import Arms
from visualhfsm_makers._unitree._loco import CODES, Loco

OPTIONS = SafetyOptions()
WIRE = struct.Struct("<2BBx5fI" + "B3x5fI" * 34 + "5I")
KNEE, WAIST_PITCH, SHOULDER, ELBOW = 3, 14, 15, 18
"""The maker's numbers: knee, shoulder and elbow are the left ones."""
WALK = 7105, '{"velocity": [0.1, 0, 0], "duration": 100}'


def command(weight: float, motors: dict[int, Sequence[float]]) -> bytes:
    """Return a command as the maker's example in C++ sends it: modes, machine and checksum are 0."""
    values: list[float] = [0, 0]
    for motor in range(35):
        values += [0, *motors.get(motor, (weight if motor == 29 else 0.0, *(0.0,) * 4)), 0]
    return WIRE.pack(*values, 0, 0, 0, 0, 0)


class Rig(MakerRig):
    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        super().__init__("G1", "Unitree", CODES)
        self.arms = Arms(self.programs)
        self.before = self.robot.read().positions
        self.sent: dict[str, Sequence[float]] = {}
        obey = self.robot.command_gains

        def spied(commands):
            self.sent |= commands
            obey(commands)

        monkeypatch.setattr(self.robot, "command_gains", spied)

    def to(self, *motors: int, by: float = 0.5, weight: float = 1.0) -> bytes:
        return command(weight, {motor: (self.before[motor] + by, 0, 0, 60, 1.5) for motor in motors})

    def live(self, seconds: float, data: bytes = b"") -> None:
        for _ in range(round(seconds / OPTIONS.period)):
            if data:
                self.arms.obey(data, "program")
            self.clock.advance(OPTIONS.period)
            self.programs.renew()
            self.assembly.player.tick()
            self.assembly.jobs[0].run()

    def moved(self) -> dict[int, float]:
        """Return by how much motors are not where they were, in rad."""
        now = self.robot.read().positions
        ways = {motor: at - was for motor, (at, was) in enumerate(zip(now, self.before, strict=True))}
        return {motor: way for motor, way in ways.items() if abs(way) > 0.01}


@pytest.fixture
def rig(monkeypatch):
    rig = Rig(monkeypatch)
    yield rig
    rig.robot.close()


def test_arms_follow_and_legs_do_not(rig):
    rig.live(1.0, rig.to(KNEE, ELBOW))
    assert rig.moved() == {ELBOW: pytest.approx(0.5, abs=0.02)}


def test_beside_the_walk(rig):
    assert rig.programs.answer(Loco(rig.programs).operations, *WALK, "walker") == (0, "")
    rig.live(1.0, rig.to(ELBOW))
    assert rig.moved() == {ELBOW: pytest.approx(0.5, abs=0.02)}
    assert rig.robot.walker.commanded().forward == pytest.approx(0.1)


@pytest.mark.parametrize(("parameter", "posture"), [('{"data": 2}', "Crouch"), ('{"data": 4}', "Stand")])
def test_each_posture_takes_them(rig, parameter, posture):
    if posture == "Stand":
        rig.programs.go("Crouch", "walker")
        rig.live(5.0)
    rig.live(0.5, rig.to(ELBOW))
    assert rig.programs.answer(Loco(rig.programs).operations, 7101, parameter, "walker") == (0, "")
    rig.live(5.0, rig.to(ELBOW))
    assert rig.programs.posture() == posture
    assert ELBOW in rig.moved()  # its program has them again


def test_they_follow_by_the_weight(rig):
    rig.live(1.0, rig.to(ELBOW, weight=0.4))
    assert rig.moved() == {ELBOW: pytest.approx(0.2, abs=0.02)}


def test_a_weight_beyond_1_is_1(rig):
    rig.live(1.0, rig.to(ELBOW, weight=3.0))
    assert rig.moved() == {ELBOW: pytest.approx(0.5, abs=0.02)}


def test_a_motor_without_gains_holds_as_before(rig):
    rig.live(0.1, rig.to(ELBOW))
    own = rig.robot.body.gears["arm"]
    name = rig.robot.joints[SHOULDER].name
    assert rig.sent[name][:5] == pytest.approx((rig.before[SHOULDER], 0, 0, own.stiffness, own.damping))


def test_a_motor_may_follow_a_torque_alone(rig):
    rig.live(0.1, command(1.0, {ELBOW: (0.0, 0.0, 3.0, 0.0, 0.0)}))
    assert rig.sent[rig.robot.joints[ELBOW].name][2:5] == (3.0, 0.0, 0.0)


def test_the_waist_is_never_softer_than_its_own_servo(rig):
    rig.live(0.1, rig.to(WAIST_PITCH, ELBOW))
    own = rig.robot.body.gears["waist"]
    assert rig.sent[rig.robot.joints[WAIST_PITCH].name][3:5] == (own.stiffness, own.damping)
    assert rig.sent[rig.robot.joints[ELBOW].name][3:5] == pytest.approx((60.0, 1.5))


@pytest.mark.parametrize("end", ["silence", "weight 0", "loss"])
def test_in_the_end_they_go_back_within_a_second(rig, end):
    rig.live(1.0, rig.to(ELBOW))
    if end == "loss":
        rig.programs.drop("program")
    rig.live(0.5, command(0.0, {}) if end == "weight 0" else b"")
    assert ELBOW in rig.moved()
    rig.live(1.5)
    assert rig.moved() == {}
    assert not rig.assembly.moves_for("program")


def test_weight_0_again_and_again_ends_it_within_a_second(rig):
    rig.live(1.0, rig.to(ELBOW))
    rig.live(1.3, command(0.0, {}))
    assert not rig.assembly.moves_for("program")


def test_another_programs_weight_0_does_not_end_it(rig):
    rig.live(1.0, rig.to(ELBOW))
    rig.arms.obey(command(0.0, {}), "another")
    rig.live(0.1)
    assert rig.moved() == {ELBOW: pytest.approx(0.5, abs=0.02)}


def test_a_stopped_robot_ignores_them(rig):
    rig.assembly.gate.stop("a test")
    rig.live(0.3, rig.to(ELBOW))
    assert rig.moved() == {}
    assert "ignored a command of rt/arm_sdk: the robot is stopped: a test" in "\n".join(rig.events)


def test_who_holds_the_lease_moves_them(rig):
    rig.assembly.gate.acquire("behavior", "dance", 30.0)
    rig.live(0.3, rig.to(ELBOW))
    assert rig.moved() == {}
    assert "ignored a command of rt/arm_sdk: the robot is held by dance" in "\n".join(rig.events)


def test_a_command_is_one_of_its_program(rig, monkeypatch):
    clients = clients_that_ask(rig.assembly.gate, monkeypatch)
    rig.arms.obey(rig.to(ELBOW), "mine")
    assert clients == {"mine"}


def test_weight_0_is_no_silence(rig):
    rig.live(0.5, rig.to(ELBOW))
    rig.live(0.5, command(0.0, {}))
    assert rig.events == []


@pytest.mark.parametrize(
    ("data", "event"),
    [
        (command(1.0, {})[:-4], "ignored a command of rt/arm_sdk: it has 996 bytes, not 1000"),
        (command(math.nan, {}), "its weight, the position of motor 29, is not a number"),
        (command(1.0, {ELBOW: (math.nan, 0, 0, 60, 2)}), "left_elbow_joint"),
        (command(1.0, {ELBOW: (99.0, 0, 0, 60, 2)}), "limited a command of rt/arm_sdk to left_elbow_joint"),
    ],
    ids=["size", "weight", "not a number", "beyond its range"],
)
def test_the_events_say_what_a_command_is_not(rig, data, event):
    rig.arms.obey(data, "program")
    assert event in "\n".join(rig.events)
