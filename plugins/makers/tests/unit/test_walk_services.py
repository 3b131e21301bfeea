"""What the services of the walk promise to programs of either maker, in virtual time and without DDS."""

from __future__ import annotations

import random
import sys
from contextlib import suppress
from typing import Any

import pytest

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import WalkVelocity
from naoserver.errors import CommandRefused, RobotError
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from plugins.makers.tests.support.gates import clients_that_ask
from plugins.makers.tests.support.maker_rigs import G1Rig, T1Rig
from tests.support.present import present
from visualhfsm_makers import BOOSTER, UNITREE
from visualhfsm_makers._booster import _loco as booster
from visualhfsm_makers._unitree import _loco as unitree
from zenoh_ice import VirtualClock

T1, G1 = pytest.param(T1Rig, id="T1"), pytest.param(G1Rig, id="G1")
ELBOW = 4
"""The number of the T1's left elbow."""
VELOCITY = '{"velocity": [0.1, 0, 0], "duration": 1, "data": 200}'
MOVE = '{"vx": 0.1, "vy": 0, "vyaw": 0, "mode": 2, "pitch": 0.1, "yaw": 0, "time_millis": 5, "start": true}'


WALK_T1, SHOOT = (2001, {"vx": 0.1, "vy": 0.0, "vyaw": 0.0}), (2024,)
WALK_G1 = 7105, '{"velocity": [0.1, 0, 0]}'
MOVING: dict[type, list[tuple[Any, ...]]] = {
    T1Rig: [WALK_T1, (2000, {"mode": 2}), (2004, {"pitch": 0.1, "yaw": 0.0}), SHOOT],
    G1Rig: [WALK_G1, (7101, '{"data": 200}'), (7104, '{"data": 0}'), (7106, '{"data": 0}')],
}
"""Calls that move a robot."""


@pytest.fixture
def rig(request):
    rig = request.param()
    yield rig
    rig.robot.close()


both = pytest.mark.parametrize("rig", [T1, G1], indirect=True)


def rows(t1, g1):
    """Return the rows of a table: those of the T1, and those of the G1."""
    return [
        pytest.param(kind.values[0], *each, id=f"{kind.id} {str(each)[1:40]}")
        for kind, of_robot in ((T1, t1), (G1, g1))
        for each in of_robot
    ]


@both
def test_a_velocity_is_forwards_and_to_the_left_and_of_the_turn(rig):
    assert rig.walk(0.1, 0.05, 0.2) == 0
    assert rig.commanded == WalkVelocity(forward=0.1, left=0.05, turn=0.2)


@both
def test_a_walk_without_an_end_lasts_until_the_next_velocity(rig):
    rig.walk()
    rig.advance(60.0)
    assert rig.forward == pytest.approx(0.1)
    rig.walk(0.0)
    assert rig.forward == 0.0


@both
def test_a_walk_without_an_end_ends_with_its_program(rig):
    rig.walk()
    rig.advance(20.0)
    assert rig.forward == pytest.approx(0.1)
    rig.programs.drop("program")
    assert rig.forward == 0.0


@both
def test_the_death_of_one_program_leaves_the_walk_of_another(rig):
    rig.walk(client="first")
    rig.walk(0.05, client="second")
    rig.programs.drop("first")
    assert rig.forward == pytest.approx(0.05)


@both
def test_everybody_may_stop_the_walk(rig):
    rig.walk()
    assert rig.walk(0.0, client="another") == 0
    assert rig.forward == 0.0


@pytest.mark.parametrize(
    ("rig", "mode", "calls"),
    rows(
        [(mode, (WALK_T1, SHOOT)) for mode in (booster.DAMPING, booster.PREPARE, booster.CUSTOM)],
        [(unitree.DAMP, (WALK_G1,))],
    ),
    indirect=["rig"],
)
def test_it_walks_only_in_the_modes_for_it(rig, mode, calls):
    assert rig.mode(mode) == 0
    assert {rig.call(*each) for each in calls} == {rig.stopped}


@pytest.mark.parametrize(
    ("rig", "mode"), rows([(mode,) for mode in range(5)], [(unitree.DAMP,)]), indirect=["rig"]
)
def test_the_mode_that_was_set_is_reported(rig, mode):
    assert rig.mode(mode) == 0
    assert rig.reported() == mode


@pytest.mark.parametrize(
    ("rig", "mode", "command", "then"),
    rows(
        [
            (mode, command, lambda rig, client: rig.mode(booster.WALKING, client))
            for mode in (booster.WALKING, booster.PREPARE)
            for command in (
                lambda rig: rig.walk(),
                lambda rig: rig.call(*SHOOT),
                lambda rig: rig.follow({ELBOW: 0.5}),
            )
        ],
        [
            (mode, lambda rig: rig.walk(), lambda rig, client: rig.call(7104, '{"data": 0}', client))
            for mode in (unitree.WALK, unitree.SQUAT)
        ],
    ),
    indirect=["rig"],
)
def test_who_commands_on_is_refused_after_the_reset_whatever_the_mode(rig, mode, command, then):
    rig.mode(mode)
    rig.assembly.gate.stop("a test")
    with suppress(CommandRefused):
        command(rig)
    rig.assembly.gate.reset()
    assert then(rig, "program") == rig.stopped
    assert then(rig, "another") == 0


@both
def test_a_stop_is_no_command_of_its_program(rig):
    rig.assembly.gate.stop("a test")
    rig.walk(0.0)
    rig.assembly.gate.reset()
    assert rig.walk() == 0


@both
def test_after_an_emergency_stop_what_moves_is_refused_and_nothing_is_renewed(rig):
    rig.walk()
    rig.assembly.gate.stop("a test")
    assert {rig.call(*each) for each in MOVING[type(rig)]} == {rig.stopped}
    rig.assembly.gate.reset()
    rig.advance(0.5)
    assert rig.forward == 0.0


@both
def test_a_stopped_robot_stays_in_its_mode(rig):
    rig.mode(unitree.DAMP)
    before = rig.reported()
    rig.assembly.gate.stop("a test")
    assert rig.mode(booster.WALKING) == rig.stopped
    assert rig.reported() == before


@both
def test_who_holds_the_lease_moves_it(rig):
    rig.assembly.gate.acquire("behavior", "dance", 30.0)
    assert {rig.call(*each) for each in MOVING[type(rig)]} == {rig.stopped}


@pytest.mark.parametrize(
    ("rig", "before", "command"),
    rows(
        [
            *((booster.WALKING, each) for each in MOVING[T1Rig]),
            (booster.WALKING, (2006, {"pitch_direction": 1, "yaw_direction": 0})),
            (booster.WALKING, (2005, {"hand_action": 0})),
            (booster.WALKING, (2000, {"mode": booster.DAMPING})),
            (booster.DAMPING, (2008,)),
            (booster.DAMPING, (2008, "")),
            (booster.WALKING, (2030, {"start": True})),
        ],
        [
            (None, WALK_G1),
            (None, (7101, '{"data": 0}')),
            (None, (7101, '{"data": 1}')),
            (None, (7101, '{"data": 2}')),
            (unitree.SQUAT, (7101, '{"data": 4}')),
            (None, (7104, '{"data": 0}')),
            (None, (7106, '{"data": 0}')),
        ],
    ),
    indirect=["rig"],
)
def test_what_moves_is_a_command_of_its_program(rig, monkeypatch, before, command):
    if before is not None:
        rig.mode(before)
        rig.advance(5.0)
    clients = clients_that_ask(rig.assembly.gate, monkeypatch)
    assert rig.call(*command, client="mine") == 0
    assert clients == {"mine"}


@pytest.mark.parametrize(
    ("rig", "operation", "body", "code"),
    rows(
        [
            (2007, "", booster.REFUSED),
            (2011, '{"src": 0, "dst": 2}', booster.REFUSED),
            (2016, '{"dance_id": 0}', booster.REFUSED),
            (2016, '{"dance_id": 1000}', 0),
            (2038, '{"start": true, "version": 0}', booster.REFUSED),
            (2**62, "{}", booster.REFUSED),
            (2005, '{"hand_action": 0, "hand_index": 0}', booster.REFUSED),
            (2000, '{"mode": 5}', booster.BAD_REQUEST),
            (2000, '{"mode": -1}', booster.BAD_REQUEST),
            (2000, '{"mode": 2.0}', booster.BAD_REQUEST),
            (2000, "", booster.BAD_REQUEST),
            (2001, '{"vx": 1e999, "vy": 0, "vyaw": 0}', booster.BAD_REQUEST),
            (2001, '{"vx": 0.1}', booster.BAD_REQUEST),
            (2001, "[" * 4000, booster.BAD_REQUEST),
            (2001, " " * 5000 + '{"vx": 0.1, "vy": 0, "vyaw": 0}', booster.BAD_REQUEST),
            (2043, f'{{"pitch": 0, "yaw": 0, "time_millis": {"9" * 3000}}}', booster.BAD_REQUEST),
        ],
        [
            (7101, '{"data": 3}', unitree.NO_STATE),
            (7106, '{"data": 2}', unitree.NO_TASK),
            (7004, "{}", unitree.NOT_IMPLEMENTED),
            (7104, '{"data": 4294967296}', unitree.WRONG_PARAMETER),
            (2**62, "{}", unitree.NOT_IMPLEMENTED),
            (7102, '{"data": 1}', unitree.NOT_IMPLEMENTED),
            (7105, '{"velocity": [1e999, 0, 0]}', unitree.WRONG_PARAMETER),
            (7105, '{"velocity": [0.1, 0], "duration": 1}', unitree.WRONG_PARAMETER),
            (7105, '{"velocity": [0.1, 0, 0], "duration": -1}', unitree.WRONG_PARAMETER),
            (7101, "[" * 4000, unitree.WRONG_PARAMETER),
            (7101, " " * 5000 + '{"data": 1}', unitree.WRONG_PARAMETER),
            (7101, '{"data": "1"}', unitree.WRONG_PARAMETER),
            (7101, '{"data": 1e999}', unitree.WRONG_PARAMETER),
            (7101, '{"data": NaN}', unitree.WRONG_PARAMETER),
        ],
    ),
    indirect=["rig"],
)
def test_what_it_cannot_is_refused_by_the_makers_code(rig, operation, body, code):
    assert rig.call(operation, body) == code


@pytest.mark.parametrize(
    ("rig", "count", "whole", "operations"),
    [
        pytest.param(T1Rig, 300, MOVE, range(2000, 2051), id="T1"),
        pytest.param(G1Rig, 1000, VELOCITY, [1, 7001, 7005, *range(7101, 7107), 101], id="G1"),
    ],
    indirect=["rig"],
)
def test_mutated_calls_are_answered_and_keep_the_walk_within_its_limits(rig, count, whole, operations):
    draw = random.Random(55)
    highest = rig.robot.walker.limits.forward
    for _ in range(count):
        place = draw.randrange(len(whole))
        text = whole[:place] + chr(draw.randrange(0xD7FF)) + whole[place + draw.randrange(4) :]
        rig.call(draw.choice(operations), text)
        assert abs(rig.forward) <= highest


@pytest.mark.parametrize(
    ("rig", "entrance", "maker"),
    [pytest.param(T1Rig, BOOSTER, "booster", id="T1"), pytest.param(G1Rig, UNITREE, "unitree", id="G1")],
    indirect=["rig"],
)
def test_without_the_package_it_names_the_extra(rig, monkeypatch, entrance, maker):
    parts = (
        "visualhfsm_makers._booster._",
        "visualhfsm_makers._unitree._",
        "visualhfsm_makers._dds",
        "cyclonedds.",
    )
    for name in [name for name in sys.modules if name.startswith(parts)]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    with pytest.raises(RobotError, match=rf"not installed; type: pip install 'visualhfsm\[{maker}\]'"):
        present(entrance.serve)(rig.robot, rig.assembly, {"dds_domain": 1})


@pytest.mark.parametrize(
    ("entrance", "body", "message"),
    [
        (BOOSTER, "G1", "--booster serves a Booster T1; this robot is a Unitree G1"),
        (UNITREE, "T1", "--unitree serves a Unitree G1; this robot is a Booster T1"),
    ],
)
def test_no_other_robot_than_the_makers_is_served(entrance, body, message):
    clock = VirtualClock()
    robot = FakeRobot(clock, body=find_body(body))
    assembly = Assembly(robot, ServerOptions(), clock)
    with pytest.raises(RobotError, match=message):
        present(entrance.serve)(robot, assembly, {"dds_domain": 1})
