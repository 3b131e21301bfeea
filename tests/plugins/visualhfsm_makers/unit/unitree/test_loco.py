"""The operations of the G1's service of the walk, in virtual time and without DDS."""

from __future__ import annotations

import json
import random
import sys

import pytest

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import WalkVelocity
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.robot import BodyState
from naoserver.serving.assembly import Assembly
from tests.support.gates import clients_that_ask
from tests.support.present import present
from visualhfsm_makers import UNITREE
from visualhfsm_makers._programs import Programs
from visualhfsm_makers._unitree._loco import (
    CODES,
    NO_STATE,
    NO_TASK,
    NOT_AVAILABLE,
    NOT_IMPLEMENTED,
    WRONG_PARAMETER,
    Loco,
)
from zenoh_ice import VirtualClock

STATE, HEIGHT, VELOCITY, TASK = 7101, 7104, 7105, 7106
DAMP, START = '{"data": 1}', '{"data": 200}'


class Rig:
    """A G1 without physics behind its guards, and the service in front of them."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock, body=find_body("G1"))
        self.assembly = Assembly(self.robot, ServerOptions(), self.clock)
        self.programs = Programs(self.robot, self.assembly, "Unitree", CODES)
        self.loco = Loco(self.programs)

    def ask(self, operation: int, parameter: str = "{}", client: str = "program") -> tuple[int, str]:
        return self.programs.answer(self.loco.operations, operation, parameter, client)

    def call(self, operation: int, parameter: str = "{}", client: str = "program") -> int:
        return self.ask(operation, parameter, client)[0]

    def drive(self, forward: float = 0.1, seconds: float = 1.0, client: str = "program") -> int:
        return self.call(VELOCITY, json.dumps({"velocity": [forward, 0, 0], "duration": seconds}), client)

    def advance(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self.clock.advance(0.1)
            self.assembly.player.tick()
            self.programs.renew()
            for watched in self.assembly.watched:
                watched.watch()

    @property
    def forward(self) -> float:
        assert self.robot.walker is not None
        return self.robot.walker.commanded().forward


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.robot.close()


def test_a_state_replaces_the_posture_of_the_last_one_and_a_velocity_waits_for_it(rig):
    rig.drive()
    for state in (DAMP, START, '{"data": 706}', '{"data": 706}', DAMP, START):
        assert rig.call(STATE, state) == 0
        rig.advance(0.3)
    assert (rig.drive(seconds=2.0), rig.robot.walker.commanded().forward) == (0, 0.0)
    while rig.assembly.player.busy:
        rig.advance(0.1)
    rig.advance(1.8)
    assert rig.programs.posture().startswith("Stand")
    assert rig.robot.walker.commanded().forward > 0.0
    rig.advance(0.5)
    assert rig.robot.walker.commanded().forward == 0.0


def test_a_stopped_robot_takes_no_state(rig):
    rig.call(STATE, DAMP)
    rig.assembly.gate.stop("a test")
    assert rig.call(STATE, START) == NOT_AVAILABLE
    assert rig.ask(7001) == (0, '{"data": 1}')


def test_squatting_it_stands_up_though_it_is_not_yet_down(rig):
    for _ in range(2):
        rig.call(STATE, '{"data": 706}')
        rig.advance(0.1)
    rig.advance(5.0)
    assert rig.programs.posture().startswith("Stand")


def test_a_velocity_lasts_for_its_duration_and_no_longer(rig):
    assert rig.drive(seconds=2.0) == 0
    rig.advance(1.8)
    assert rig.forward == pytest.approx(0.1)
    rig.advance(0.4)
    assert rig.forward == 0.0


def test_a_velocity_is_forwards_and_to_the_left_and_of_the_turn(rig):
    assert rig.call(VELOCITY, '{"velocity": [0.1, 0.05, 0.2], "duration": 1}') == 0
    assert rig.robot.walker.commanded() == WalkVelocity(forward=0.1, left=0.05, turn=0.2)


def test_a_continuous_move_ends_with_its_program(rig):
    rig.drive(seconds=864_000.0)
    rig.advance(20.0)
    assert rig.forward == pytest.approx(0.1)
    rig.programs.drop("program")
    assert rig.forward == 0.0


def test_the_death_of_one_program_leaves_the_walk_of_another(rig):
    rig.drive(client="first")
    rig.drive(0.05, client="second")
    rig.programs.drop("first")
    assert rig.forward == pytest.approx(0.05)


def test_everybody_may_stop_the_walk(rig):
    rig.drive()
    assert rig.drive(0.0, client="another") == 0
    assert rig.forward == 0.0


@pytest.mark.parametrize("state", [START, '{"data": 2}'], ids=["walk", "squat"])
def test_who_commands_on_is_refused_after_the_reset_whatever_the_state(rig, state):
    rig.call(STATE, state)
    rig.assembly.gate.stop("a test")
    rig.drive()
    rig.assembly.gate.reset()
    assert rig.call(HEIGHT, '{"data": 0}') == NOT_AVAILABLE
    assert rig.call(HEIGHT, '{"data": 0}', client="another") == 0


def test_a_stop_is_no_command_of_its_program(rig):
    rig.assembly.gate.stop("a test")
    rig.drive(0.0)
    rig.assembly.gate.reset()
    assert rig.drive() == 0


def test_after_an_emergency_stop_commands_are_refused_and_nothing_is_renewed(rig):
    rig.drive(seconds=100.0)
    rig.assembly.gate.stop("a test")
    assert rig.drive() == NOT_AVAILABLE
    rig.assembly.gate.reset()
    rig.advance(0.5)
    assert rig.forward == 0.0


def test_who_holds_the_lease_moves_it(rig):
    rig.assembly.gate.acquire("behavior", "dance", 30.0)
    answers = [rig.drive(), rig.call(HEIGHT, '{"data": 0}'), rig.call(TASK, '{"data": 0}')]
    assert answers == [NOT_AVAILABLE] * 3


def test_to_damp_ends_what_moves_even_if_it_may_not_crouch(rig):
    rig.drive(seconds=100.0)
    rig.assembly.gate.acquire("behavior", "dance", 30.0)
    assert rig.call(STATE, DAMP) == NOT_AVAILABLE
    assert rig.forward == 0.0


def test_to_stand_ends_no_walk(rig):
    rig.call(HEIGHT, '{"data": 0}')
    rig.advance(5.0)
    rig.drive(seconds=100.0)
    assert rig.call(STATE, START) == 0
    rig.advance(1.0)
    assert rig.forward == pytest.approx(0.1)


def test_it_walks_only_after_start(rig):
    assert rig.call(STATE, DAMP) == 0
    assert rig.drive() == NOT_AVAILABLE


def test_the_state_that_was_set_is_reported(rig):
    rig.call(STATE, DAMP)
    assert json.loads(rig.ask(7001)[1]) == {"data": 1}


@pytest.mark.parametrize(
    "command",
    [
        (VELOCITY, '{"velocity": [0.1, 0, 0]}'),
        (STATE, '{"data": 0}'),
        (STATE, '{"data": 1}'),
        (STATE, '{"data": 2}'),
        (STATE, '{"data": 4}'),
        (HEIGHT, '{"data": 0}'),
        (TASK, '{"data": 0}'),
    ],
    ids=str,
)
def test_what_moves_is_a_command_of_its_program(rig, monkeypatch, command):
    if command == (STATE, '{"data": 4}'):
        rig.call(HEIGHT, '{"data": 0}')
        rig.advance(5.0)
    clients = clients_that_ask(rig.assembly.gate, monkeypatch)
    assert rig.call(*command, client="mine") == 0
    assert clients == {"mine"}


@pytest.mark.parametrize(
    ("command", "posture"),
    [
        ((STATE, '{"data": 2}'), "Crouch"),
        ((STATE, '{"data": 706}'), "Crouch"),
        ((HEIGHT, '{"data": 0}'), "Crouch"),
        ((HEIGHT, '{"data": 4294967295}'), "Stand"),
        ((HEIGHT, '{"data": 0.5}'), "Crouch"),
        ((HEIGHT, '{"data": 0.75}'), "Stand"),
    ],
    ids=str,
)
def test_it_crouches_and_stands_up_again(rig, command, posture):
    rig.call(*command)
    rig.advance(5.0)
    assert rig.programs.posture() == posture
    rig.call(STATE, '{"data": 706}')
    rig.advance(5.0)
    assert rig.programs.posture() == ("Stand" if posture == "Crouch" else "Crouch")


@pytest.mark.parametrize("state", [500, 501, 801])
def test_it_walks_in_the_states_of_newer_packages(rig, state):
    rig.call(STATE, DAMP)
    assert rig.call(STATE, json.dumps({"data": state})) == 0
    assert json.loads(rig.ask(7001)[1]) == {"data": state}
    rig.advance(5.0)
    assert rig.drive() == 0


@pytest.mark.parametrize("up", [START, '{"data": 4}'], ids=["start", "stand"])
def test_to_stand_replaces_a_crouch_that_has_just_begun(rig, up):
    rig.call(STATE, DAMP)
    rig.advance(0.1)
    assert rig.call(STATE, up) == 0
    rig.advance(5.0)
    assert rig.programs.posture() == "Stand"


def test_to_stand_replaces_a_crouch_that_waits_for_the_end_of_the_walk(rig):
    rig.drive(seconds=100.0)
    rig.call(HEIGHT, '{"data": 0}')
    assert rig.call(STATE, START) == 0
    rig.advance(5.0)
    assert rig.programs.posture() == "Stand"


def mode(rig):
    return json.loads(rig.ask(7002)[1])["data"]


def test_its_mode_is_whether_it_stands_walks_or_lies(rig, monkeypatch):
    assert mode(rig) == 0
    rig.drive()
    assert mode(rig) == 1
    fallen = BodyState(torso_tilt=1.5, fallen=True, real_time_factor=1.0, lag=0.0)
    monkeypatch.setattr(rig.robot, "state", lambda: fallen)
    assert mode(rig) == 2


def test_the_boot_sequence_of_public_programs_ends(rig):
    """Damp, stand, and be higher step by step until the mode is 0; then balance, and start."""
    for state in (DAMP, '{"data": 4}'):
        assert rig.call(STATE, state) == 0
    height = 0.0
    while height <= 0.2 or mode(rig) != 0:
        height += 0.02
        assert height < 0.5
        assert rig.call(HEIGHT, json.dumps({"data": height})) == 0
    assert [rig.call(7102, '{"data": 0}'), rig.call(STATE, START)] == [0, 0]
    rig.advance(5.0)
    assert (rig.programs.posture(), rig.drive()) == ("Stand", 0)


def test_in_another_state_it_can_be_stopped(rig):
    rig.call(STATE, '{"data": 4}')
    assert rig.drive(0.0) == 0


@pytest.mark.parametrize(
    ("operation", "parameter", "words"),
    [
        (7102, '{"data": 1}', "the simulation stands still on both feet: balance mode 0 alone"),
        (HEIGHT, '{"data": -0.1}', "a height is from 0 to 4294967295"),
        (
            VELOCITY,
            '{"velocity": [0.1, 0, 0], "duration": 0}',
            "a velocity is finite, and lasts for more than 0 s",
        ),
    ],
)
def test_an_event_says_why_it_is_refused(rig, operation, parameter, words):
    code = rig.call(operation, parameter)
    newest = rig.assembly.events.snapshot()[0][-1]
    assert (newest.source, newest.message) == ("Unitree", f"answered a program with error {code}: {words}")


def test_limp_it_holds_nothing(rig):
    assert rig.call(STATE, '{"data": 0}') == 0
    rig.advance(0.5)
    assert 0.0 < max(rig.robot.read().stiffnesses) < 1.0
    rig.advance(1.0)
    assert max(rig.robot.read().stiffnesses) == 0.0


def test_a_stopped_robot_does_not_go_limp(rig):
    rig.assembly.gate.stop("a test")
    assert rig.call(STATE, '{"data": 0}') == NOT_AVAILABLE
    rig.advance(2.0)
    assert min(rig.robot.read().stiffnesses) == 1.0


def test_it_waves(rig):
    assert rig.call(TASK, '{"data": 0}') == 0
    assert rig.assembly.player.moves_for("program")


@pytest.mark.parametrize(
    ("operation", "parameter", "code"),
    [
        (STATE, '{"data": 3}', NO_STATE),
        (TASK, '{"data": 2}', NO_TASK),
        (7004, "{}", NOT_IMPLEMENTED),
        (HEIGHT, '{"data": 4294967296}', WRONG_PARAMETER),
        (2**62, "{}", NOT_IMPLEMENTED),
        (7102, '{"data": 1}', NOT_IMPLEMENTED),
        (VELOCITY, '{"velocity": [1e999, 0, 0]}', WRONG_PARAMETER),
        (VELOCITY, '{"velocity": [0.1, 0], "duration": 1}', WRONG_PARAMETER),
        (VELOCITY, '{"velocity": [0.1, 0, 0], "duration": -1}', WRONG_PARAMETER),
        (STATE, "[" * 4000, WRONG_PARAMETER),
        (STATE, " " * 5000 + '{"data": 1}', WRONG_PARAMETER),
        (STATE, '{"data": "1"}', WRONG_PARAMETER),
        (STATE, '{"data": 1e999}', WRONG_PARAMETER),
        (STATE, '{"data": NaN}', WRONG_PARAMETER),
    ],
    ids=str,
)
def test_what_it_cannot_is_refused_by_the_makers_code(rig, operation, parameter, code):
    assert rig.call(operation, parameter) == code


def test_mutated_calls_are_answered_and_keep_the_walk_within_its_limits(rig):
    draw = random.Random(55)
    whole = '{"velocity": [0.1, 0, 0], "duration": 1, "data": 200}'
    highest = rig.robot.walker.limits.forward
    for _ in range(1000):
        place = draw.randrange(len(whole))
        text = whole[:place] + chr(draw.randrange(0xD7FF)) + whole[place + draw.randrange(4) :]
        rig.call(draw.choice([1, 7001, 7005, STATE, 7102, HEIGHT, VELOCITY, TASK, 101]), text)
        assert abs(rig.forward) <= highest


def test_without_the_package_it_names_the_extra(rig, monkeypatch):
    for module in ("visualhfsm_makers._unitree._service", "visualhfsm_makers._dds"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    monkeypatch.delitem(sys.modules, "cyclonedds.core", raising=False)
    with pytest.raises(RobotError, match=r"not installed; type: pip install 'visualhfsm\[unitree\]'"):
        present(UNITREE.serve)(rig.robot, rig.assembly, {"dds_domain": 1})


def test_no_other_robot_than_a_g1_is_served():
    clock = VirtualClock()
    robot = FakeRobot(clock, body=find_body("T1"))
    assembly = Assembly(robot, ServerOptions(), clock)
    with pytest.raises(RobotError, match="--unitree serves a Unitree G1; this robot is a Booster T1"):
        present(UNITREE.serve)(robot, assembly, {"dds_domain": 1})
