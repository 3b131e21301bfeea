"""The operations of the T1's service of the walk, in virtual time and without DDS."""

from __future__ import annotations

import json
import math

import pytest

from interfaces.nao import ActionStatus
from naoserver.bodies.kinematics import kinematics_of
from naoserver.errors import InvalidCommand, RobotError
from naoserver.serving.lasting_walk import LastingWalk
from naoserver.serving.moves import POSTURE
from plugins.makers.tests.support.maker_rigs import T1Rig
from visualhfsm_makers._booster._loco import BAD_REQUEST, CONFLICT, CUSTOM, DAMPING, PREPARE, SOCCER, WALKING

MODE, MOVE, HEAD, WAVE, HEAD_ON, GET_UP, GET_MODE, STATUS, INFO, SHOOT = (
    *(2000, 2001, 2004, 2005, 2006, 2008),
    *(2017, 2018, 2022, 2024),
)
HAND = 2009
GET_UP_WITH_MODE, UPPER_BODY, RESET, HEAD_WITH_TIME = 2025, 2030, 2031, 2043
ELBOW = 4
"""The maker's number of the left elbow's pitch."""


@pytest.fixture
def rig():
    rig = T1Rig()
    yield rig
    rig.robot.close()


def test_a_velocity_in_single_precision_is_not_beyond_a_limit(rig):
    highest = rig.robot.walker.limits.forward
    rig.walk(highest + 1e-8)
    assert rig.assembly.events.snapshot()[1] == 0


@pytest.mark.parametrize("mode", [DAMPING, PREPARE, CUSTOM])
def test_a_mode_without_a_walk_ends_the_walk(rig, mode):
    rig.walk()
    assert rig.mode(mode) == 0
    assert rig.forward == 0.0


def test_damped_it_crouches_and_then_stands_up_to_walk(rig):
    rig.mode(DAMPING)
    rig.advance(5.0)
    assert rig.programs.posture() == "Crouch"
    rig.mode(WALKING)
    rig.advance(5.0)
    assert rig.programs.posture() != "Crouch"
    assert rig.walk() == 0


def crouched(rig):
    rig.mode(DAMPING)
    rig.advance(5.0)


def test_a_mode_replaces_the_posture_of_the_last_one_and_a_move_waits_for_it(rig):
    rig.walk()
    modes = (DAMPING, WALKING, DAMPING, PREPARE, DAMPING, WALKING)
    assert [(rig.mode(mode), rig.advance(0.3)) for mode in modes] == [(0, None)] * 6
    assert (rig.walk(), rig.forward) == (0, 0.0)
    rig.advance(5.0)
    assert rig.programs.posture().startswith("Stand")
    assert rig.forward == pytest.approx(0.1)


@pytest.mark.parametrize(
    "command",
    [
        lambda rig: rig.walk(0.0),
        lambda rig: rig.mode(DAMPING),
        lambda rig: rig.mode(CUSTOM),
        lambda rig: (rig.assembly.gate.stop("a test"), rig.assembly.gate.reset()),
        lambda rig: rig.programs.drop("program"),
        lambda rig: rig.assembly.player.stop(),
        lambda rig: rig.assembly.body.hold(),
    ],
    ids=[
        *("another move", "damping", "custom", "emergency stop", "end of its program"),
        *("stop of the posture", "hold of all joints"),
    ],
)
def test_a_move_that_waits_for_a_posture_does_not_begin_after(rig, command):
    crouched(rig)
    rig.mode(WALKING)
    rig.walk()
    command(rig)
    rig.advance(5.0)
    assert rig.forward == 0.0


def test_the_newest_move_begins_after_the_posture(rig):
    crouched(rig)
    rig.mode(WALKING)
    assert [rig.walk(0.1), rig.call(HEAD, {"pitch": 0.3, "yaw": 0.0}), rig.walk(0.2)] == [0, 0, 0]
    rig.advance(5.0)
    assert rig.forward == pytest.approx(0.2)
    assert rig.angle("Head_pitch") == pytest.approx(0.3, abs=1e-3)


def test_what_waited_does_not_replace_a_later_call(rig):
    crouched(rig)
    rig.mode(WALKING)
    rig.call(HEAD, {"pitch": 0.3, "yaw": 0.0})
    while rig.assembly.player.busy:
        rig.clock.advance(0.1)
        rig.assembly.player.tick()
    rig.call(HEAD, {"pitch": 0.1, "yaw": 0.0})
    rig.advance(2.0)
    assert rig.angle("Head_pitch") == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize(("operation", "motion"), [(WAVE, "wave"), (SHOOT, "kick")])
def test_a_motion_waits_for_the_posture(rig, operation, motion):
    crouched(rig)
    rig.mode(WALKING)
    rig.advance(0.3)
    assert rig.call(operation, {"hand_action": 0}) == 0
    assert rig.assembly.player.progress(POSTURE).status is ActionStatus.Moving
    rig.advance(3.0)
    assert rig.assembly.player.progress(POSTURE).status is ActionStatus.Done
    assert rig.loco._playing() == motion


@pytest.mark.parametrize("operation", [HEAD_ON, MOVE, WAVE, SHOOT])
def test_what_another_program_moves_is_refused(rig, operation):
    crouched(rig)
    rig.mode(WALKING)
    body = {"vx": 0.1, "vy": 0.0, "vyaw": 0.0, "pitch_direction": 1, "yaw_direction": 0, "hand_action": 0}
    assert rig.call(operation, body, client="another") == CONFLICT
    rig.advance(5.0)
    assert rig.programs.posture().startswith("Stand")
    assert rig.forward == 0.0


def test_a_walk_that_is_no_programs_any_more_is_refused_and_goes_on(rig):
    rig.walk()
    rig.advance(0.1)
    rig.walk(0.0)
    rig.advance(3.0)
    rig.assembly.walk.drive({"forward": 0.2}, "behavior")
    assert rig.call(SHOOT) == CONFLICT
    assert rig.forward == pytest.approx(0.2)


def test_it_stands_up_in_the_mode_without_a_walk_after_the_last_steps(rig, monkeypatch):
    crouched(rig)
    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moving", True)
        rig.mode(PREPARE)
    rig.advance(5.0)
    assert rig.programs.posture().startswith("Stand")


def test_a_mode_replaces_all_that_waits(rig):
    crouched(rig)
    rig.mode(WALKING)
    rig.call(HEAD, {"pitch": 0.3, "yaw": 0.0})
    rig.mode(CUSTOM)
    rig.advance(5.0)
    assert rig.angle("Head_pitch") == pytest.approx(0.0, abs=0.05)


def test_what_waited_and_is_refused_is_an_event(rig):
    crouched(rig)
    rig.mode(WALKING)
    rig.walk()
    rig.assembly.gate.acquire("behavior", "dance", 30.0)
    rig.advance(5.0)
    assert len([each for each in rig.events if "409: the robot is held by dance" in each]) == 1, (
        "it is tried once"
    )


def test_the_status_names_what_it_does(rig):
    rig.call(WAVE, {"hand_action": 0, "hand_index": 1})
    status = json.loads(rig.ask(STATUS)[1])
    assert status == {"current_mode": WALKING, "current_body_control": 3, "current_actions": [2]}


def test_the_status_of_a_robot_that_does_nothing(rig):
    assert json.loads(rig.ask(STATUS)[1])["current_actions"] == []


def test_it_says_what_it_is(rig):
    unknown = dict.fromkeys(("serial_number", "edition", "region"), "")
    named = dict.fromkeys(("name", "nickname"), rig.robot.name)
    assert json.loads(rig.ask(INFO)[1]) == {**named, **unknown, "version": "simulation", "model": "T1"}


def test_the_head_turns_to_angles(rig):
    rig.call(HEAD, {"pitch": 0.4, "yaw": -0.5})
    rig.advance(2.0)
    assert (rig.angle("Head_pitch"), rig.angle("AAHead_yaw")) == pytest.approx((0.4, -0.5), abs=1e-3)


def test_the_head_takes_the_time_that_it_is_given(rig):
    rig.call(HEAD_WITH_TIME, {"pitch": 0.4, "yaw": 0.0, "time_millis": 4000})
    rig.advance(2.0)
    assert rig.assembly.body.angles(measured=False)["Head_pitch"] == pytest.approx(0.2, abs=1e-5)


def test_the_head_turns_in_a_direction_until_it_is_stopped(rig):
    rig.call(HEAD_ON, {"pitch_direction": 1, "yaw_direction": 0})
    rig.advance(0.5)
    rig.call(HEAD_ON, {"pitch_direction": 0, "yaw_direction": 0})
    there = rig.angle("Head_pitch")
    rig.advance(2.0)
    assert 0.0 < rig.angle("Head_pitch") == pytest.approx(there, abs=0.05)


@pytest.mark.parametrize("way", [1, -1])
def test_the_head_turns_slowly_in_a_direction_to_its_limit(rig, way):
    rig.call(HEAD_ON, {"pitch_direction": 0, "yaw_direction": way})
    rig.advance(1.0)
    assert rig.angle("AAHead_yaw") == pytest.approx(way * 0.5, abs=0.1)
    assert rig.angle("Head_pitch") == 0.0
    rig.advance(20.0)
    facts = rig.robot.body.joint["AAHead_yaw"]
    assert rig.angle("AAHead_yaw") == pytest.approx(facts.upper if way > 0 else facts.lower)


def test_the_head_that_turns_in_a_direction_stops_no_other_joint(rig):
    rig.mode(CUSTOM)
    rig.follow({ELBOW: 0.5})
    rig.call(HEAD_ON, {"pitch_direction": 1, "yaw_direction": 0})
    assert rig.assembly.gains.moves_for("program")


def test_the_time_of_a_turn_is_for_the_way_from_where_the_head_is(rig):
    rig.call(HEAD, {"pitch": 0.4, "yaw": 0.0})
    rig.advance(2.0)
    rig.call(HEAD_WITH_TIME, {"pitch": 0.2, "yaw": 0.0, "time_millis": 4000})
    rig.advance(2.0)
    assert rig.angle("Head_pitch") == pytest.approx(0.3, abs=0.03)


def test_it_waves_until_the_hand_closes(rig):
    rig.call(WAVE, {"hand_action": 0, "hand_index": 1})
    rig.advance(1.0)
    assert rig.angle("Right_Shoulder_Pitch") < -1.0
    rig.call(WAVE, {"hand_action": 1, "hand_index": 1})
    rig.advance(5.0)
    assert rig.angle("Right_Shoulder_Pitch") == pytest.approx(0.0, abs=0.1)


def test_a_hand_that_closes_ends_its_wave_at_once(rig):
    rig.call(WAVE, {"hand_action": 0})
    rig.advance(0.5)
    rig.call(WAVE, {"hand_action": 1})
    assert json.loads(rig.ask(STATUS)[1])["current_actions"] == []


def test_a_refusal_has_no_result_and_its_event_says_why(rig):
    assert rig.ask(MODE, {"mode": 5}) == (BAD_REQUEST, "")
    rig.assembly.gate.stop("a test")
    assert rig.ask(MODE, {"mode": WALKING}) == (CONFLICT, "")
    said = f"answered a program with error {CONFLICT}: the robot is stopped: a test; reset the emergency stop first"
    assert rig.events[-1] == said


def test_crouching_it_is_lower(rig):
    high = rig.programs.height()
    rig.mode(DAMPING)
    rig.advance(5.0)
    assert 0.2 < rig.programs.height() < high - 0.1 < 0.8


def test_a_hand_that_closes_ends_nothing_else(rig):
    rig.call(SHOOT)
    rig.call(WAVE, {"hand_action": 1})
    assert json.loads(rig.ask(STATUS)[1])["current_body_control"] == 9


def test_a_wave_that_is_over_is_none(rig):
    rig.call(WAVE, {"hand_action": 0})
    rig.advance(20.0)
    assert json.loads(rig.ask(STATUS)[1])["current_actions"] == []


def test_a_command_of_fewer_motors_leaves_the_others(rig):
    rig.mode(CUSTOM)
    rig.loco.follow([(0.5, 0.0, 0.0, 50.0, 2.0, float(n == ELBOW)) for n in range(ELBOW + 1)], "program")
    assert rig.assembly.gains.moves_for("program")


def test_it_shoots(rig):
    assert rig.call(SHOOT) == 0
    assert json.loads(rig.ask(STATUS)[1])["current_body_control"] == 9


def test_getting_up_leads_to_a_mode(rig):
    rig.mode(DAMPING)
    rig.call(GET_UP, {"version": 0})
    assert json.loads(rig.ask(GET_MODE)[1])["mode"] == WALKING
    rig.call(GET_UP_WITH_MODE, {"mode": SOCCER, "version": 0})
    assert json.loads(rig.ask(GET_MODE)[1])["mode"] == SOCCER


def test_odometry_begins_anew_where_it_is_reset(rig):
    rig.walk(0.1, turn=0.3)
    rig.advance(3.0)
    rig.call(RESET, "")
    assert rig.loco.place() == pytest.approx((0.0, 0.0, 0.0))
    rig.call(RESET, {"x": 1.0, "y": 2.0, "theta": math.pi / 2})
    assert rig.loco.place() == pytest.approx((1.0, 2.0, math.pi / 2))
    rig.walk(0.1)
    rig.advance(1.0)
    x, y, _heading = rig.loco.place()
    assert (x, y) == pytest.approx((1.0, 2.1), abs=0.02)


def test_joints_follow_commands_in_the_custom_mode_alone(rig):
    with pytest.raises(InvalidCommand, match="mode 3") as refusal:
        rig.follow({ELBOW: 0.5})
    assert refusal.value.field == "mode"
    rig.mode(CUSTOM)
    rig.follow({ELBOW: 0.5})
    rig.advance(0.1)
    assert rig.angle("Left_Elbow_Pitch") > 0.0


def test_the_upper_body_follows_commands_beside_the_walk(rig):
    rig.call(UPPER_BODY, {"start": True})
    rig.walk()
    rig.follow({ELBOW: 0.5})
    rig.advance(0.1)
    assert rig.angle("Left_Elbow_Pitch") > 0.0
    with pytest.raises(RobotError, match="mode 3"):
        rig.follow({14: 0.5})


def test_it_walks_after_the_custom_mode_while_commands_still_come(rig):
    rig.mode(CUSTOM)
    rig.follow({ELBOW: 0.0})
    assert [rig.mode(WALKING), rig.walk()] == [0, 0]


def posture(x: float, y: float, z: float) -> dict[str, object]:
    """Return a posture as the maker's programs send it."""
    return {"position": {"x": x, "y": y, "z": z}, "orientation": {"roll": -1.57, "pitch": -1.57, "yaw": 0.0}}


@pytest.mark.parametrize(("hand", "effector", "side"), [(0, "LArm", 1.0), (1, "RArm", -1.0)])
@pytest.mark.parametrize("way", [{}, {"has_aux": True, "aux_posture": posture(0.2, 0.3, 0.1)}])
def test_a_hand_goes_to_a_place_in_the_frame_of_the_trunk(rig, hand, effector, side, way):
    goal = (0.3, side * 0.25, 0.1)
    body = {"target_posture": posture(*goal), "time_millis": 1000, "hand_index": hand}
    assert rig.call(HAND, body | way) == 0
    rig.advance(2.5)
    angles = rig.assembly.body.angles(measured=False)
    place = kinematics_of(rig.robot.body).place_of(effector, angles)
    assert place[:3, 3] == pytest.approx(goal, abs=0.005)


@pytest.mark.parametrize(
    "change",
    [
        {"hand_index": 2},
        {"time_millis": 0},
        {"time_millis": 60_001},
        {"time_millis": 10**9},
        {"target_posture": None},
    ],
)
def test_a_hand_that_is_none_and_a_way_that_is_none(rig, change):
    body = {"target_posture": posture(0.3, 0.25, 0.1), "time_millis": 1000, "hand_index": 0}
    assert rig.call(HAND, body | change) == BAD_REQUEST
