"""The operations of the G1's service of the walk, in virtual time and without DDS."""

from __future__ import annotations

import json

import pytest

from naoserver.robot import BodyState
from plugins.makers.tests.support.maker_rigs import G1Rig
from visualhfsm_makers._unitree._loco import NOT_AVAILABLE

STATE, HEIGHT, VELOCITY, TASK = 7101, 7104, 7105, 7106
DAMP, START = '{"data": 1}', '{"data": 200}'


@pytest.fixture
def rig():
    rig = G1Rig()
    yield rig
    rig.robot.close()


def test_a_state_replaces_the_posture_of_the_last_one_and_a_velocity_waits_for_it(rig):
    rig.drive()
    for state in (DAMP, START, '{"data": 706}', '{"data": 706}', DAMP, START):
        assert rig.call(STATE, state) == 0
        rig.advance(0.3)
    assert (rig.drive(seconds=2.0), rig.forward) == (0, 0.0)
    while rig.assembly.player.busy:
        rig.advance(0.1)
    rig.advance(1.8)
    assert rig.programs.posture().startswith("Stand")
    assert rig.forward > 0.0
    rig.advance(0.5)
    assert rig.forward == 0.0


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
