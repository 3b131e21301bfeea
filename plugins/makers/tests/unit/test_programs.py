"""What programs of a robot's maker command, on a T1 without physics in virtual time."""

import math
from typing import Literal

import pytest

from naoserver.bodies.capabilities import WalkVelocity
from naoserver.bodies.kinematics import kinematics_of
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand, JointTaken
from naoserver.fake import FakeRobot
from naoserver.moves.walk import WALK
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver.serving.lasting_walk import LastingWalk
from plugins.makers.tests.support.maker_rigs import MakerRig
from visualhfsm_makers._programs import Codes, Programs, Refusal
from zenoh_ice import VirtualClock

WRONG = 400
AHEAD, ASIDE = (0.3, 0.25, 0.15), (0.2, 0.35, 0.1)
"""Places that the left hand reaches, in the frame of the trunk."""


class Rig(MakerRig):
    """A T1 behind its guards, and programs in front of them."""

    def __init__(self):
        super().__init__("T1", "maker", Codes(404, WRONG, 409, 500))

    def reach(self, *places, seconds=1.0):
        self.programs.reach("LArm", places, seconds, "program")

    def advance(self, seconds, step=0.02):
        super().advance(seconds, step)

    @property
    def hand(self):
        """The place of the left hand by its setpoints."""
        angles = self.assembly.body.angles(measured=False)
        return tuple(kinematics_of(self.robot.body).place_of("LArm", angles)[:3, 3])


@pytest.fixture
def rig():
    return Rig()


def test_a_hand_goes_to_a_place(rig):
    rig.reach(AHEAD)
    rig.advance(1.5)
    assert rig.hand == pytest.approx(AHEAD, abs=0.005)


def test_a_hand_goes_through_places_at_even_times(rig):
    rig.reach(ASIDE, AHEAD, seconds=2.0)
    rig.advance(1.0)
    assert rig.hand == pytest.approx(ASIDE, abs=0.02)
    rig.advance(1.5)
    assert rig.hand == pytest.approx(AHEAD, abs=0.005)


@pytest.mark.parametrize("end", [lambda of: of.drop("program"), lambda of: of.end_motion()])
def test_a_hand_stops_with_its_program_and_with_all_motion(rig, end):
    rig.reach(AHEAD)
    rig.advance(0.5)
    end(rig.programs)
    there = rig.hand
    rig.advance(1.0)
    assert rig.hand == pytest.approx(there, abs=0.01)


@pytest.mark.parametrize("place", [(math.nan, 0.0, 0.0), (0.1, math.inf, 0.0)])
def test_a_place_that_is_none(rig, place):
    with pytest.raises(Refusal) as refusal:
        rig.reach(place)
    assert refusal.value.code == WRONG


def test_a_stopped_robot_moves_no_hand(rig):
    rig.assembly.gate.stop("a test")
    with pytest.raises(CommandRefused):
        rig.reach(AHEAD)


def test_a_refusal_is_an_event_of_its_code(rig):
    for code in (WRONG, 409, WRONG):
        assert rig.programs.refused(code, "no") == code
    events = rig.assembly.events.snapshot()[0]
    assert [(event.source, event.message) for event in events] == [
        ("maker", f"answered a program with error {code}: no") for code in (WRONG, 409)
    ]


@pytest.mark.parametrize(("lost", "posture"), [("another", "Crouch"), ("program", "StandInit")])
def test_a_posture_waits_for_the_end_of_the_walk_unless_its_program_is_lost(rig, monkeypatch, lost, posture):
    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moving", True)
        rig.programs.go("Crouch", "program")
        rig.programs.renew()
        rig.programs.drop(lost)
    rig.programs.renew()
    for _ in range(50):
        rig.clock.advance(0.1)
        rig.assembly.player.tick()
    assert rig.programs.posture() == posture


def test_a_stop_while_a_call_is_performed_leaves_nothing_that_waits(rig, monkeypatch):
    begun = []

    def perform(_parameter, client):
        begun.append(client)
        rig.assembly.gate.stop("a test")
        rig.assembly.gate.reset()
        raise JointTaken("Left_Knee_Pitch", WALK, "the walk has it")

    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moves_for", lambda _walk, _client: True)
        assert rig.programs.answer({1: perform}, 1, "", "program") == (0, "")
    rig.programs.renew()
    assert begun == ["program"]


@pytest.mark.parametrize(
    "command",
    [lambda rig: rig.assembly.walk.stop(), lambda rig: rig.assembly.walk.drive({"forward": 0.1}, "another")],
    ids=["stopped", "another walk"],
)
def test_a_posture_that_waits_does_not_begin_after_its_walk_was(rig, monkeypatch, command):
    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moving", True)
        rig.programs.go("Crouch", "program")
        command(rig)
        rig.programs.renew()
    rig.assembly.walk.drive({"forward": 0.0}, "another")
    rig.programs.renew()
    assert not rig.assembly.player.busy


def test_a_posture_waits_on_though_another_program_is_refused(rig, monkeypatch):
    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moving", True)
        rig.programs.go("Crouch", "program")
        rig.assembly.gate.acquire("program", "dance", 30.0)
        with pytest.raises(CommandRefused):
            rig.programs.drive(WalkVelocity(forward=0.1), 1.0, "another")
    rig.programs.renew()
    assert rig.programs.goal() == "Crouch"


def test_the_end_of_all_motion_leaves_nothing_that_waits(rig, monkeypatch):
    monkeypatch.setattr(LastingWalk, "moving", True)
    rig.programs.go("Crouch", "program")
    rig.programs.end_motion()
    assert rig.programs.goal() == "StandInit"


def test_to_stand_replaces_a_posture_that_waits_for_the_end_of_the_walk(rig, monkeypatch):
    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moving", True)
        rig.programs.go("Crouch", "program")
        assert rig.programs.goal() == "Crouch"
        rig.programs.stand("program")
    rig.programs.renew()
    assert not rig.assembly.player.busy


def sends(rig, client, seconds, period):
    for _ in range(round(seconds / period)):
        rig.programs.heard(client)
        for _ in range(round(period / 0.1)):
            rig.clock.advance(0.1)
            rig.programs.renew()
            rig.assembly.walk.watch()


def walks(rig):
    return rig.assembly.walk.commanded().forward > 0.0


def test_a_program_that_sent_regularly_and_is_silent_walks_no_further(rig):
    rig.programs.drive(WalkVelocity(forward=0.1), math.inf, "program")
    sends(rig, "program", seconds=2.5, period=0.1)
    assert walks(rig)
    sends(rig, "another", seconds=1.2, period=0.1)
    assert not walks(rig)
    assert rig.events[-1] == ("ended the walk: its program sent regularly, and nothing for 1 s")


def test_a_pause_of_less_than_a_second_is_no_silence(rig):
    rig.programs.drive(WalkVelocity(forward=0.1), math.inf, "program")
    sends(rig, "program", seconds=2.5, period=0.1)
    sends(rig, "another", seconds=0.7, period=0.1)
    sends(rig, "program", seconds=0.1, period=0.1)
    sends(rig, "another", seconds=20.0, period=0.1)
    assert walks(rig)


def test_a_program_that_is_lost_leaves_nothing(rig):
    for number in range(100):
        rig.programs.heard(f"program {number}")
        rig.programs.drop(f"program {number}")
    assert rig.programs._sending == {}


def test_a_lost_program_renews_no_walk_of_a_behavior(rig):
    rig.programs.drive(WalkVelocity(forward=0.1), math.inf, "program")
    rig.assembly.walk.drive({"forward": 0.1}, "behavior")
    rig.programs.drop("program")
    sends(rig, "another", seconds=2.0, period=0.1)
    assert not walks(rig)


def test_what_waits_of_a_program_that_is_silent_does_not_begin(rig, monkeypatch):
    sends(rig, "program", seconds=2.5, period=0.1)
    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moving", True)
        rig.programs.go("Crouch", "program")
        sends(rig, "another", seconds=1.2, period=0.1)
    rig.programs.renew()
    assert not rig.assembly.player.busy


@pytest.mark.parametrize(
    ("client", "seconds", "period"),
    [("program", 9.0, 3.0), ("program", 1.5, 0.1), ("another", 2.5, 0.1)],
    ids=["now and then", "at its start", "another"],
)
def test_a_program_that_does_not_send_regularly_walks_on(rig, client, seconds, period):
    rig.programs.drive(WalkVelocity(forward=0.1), math.inf, "program")
    sends(rig, client, seconds, period)
    sends(rig, "somebody", seconds=10.0, period=0.1)
    assert walks(rig)


def test_a_program_that_is_silent_ends_the_walk_of_no_behavior(rig):
    rig.programs.drive(WalkVelocity(forward=0.1), 1.0, "program")
    sends(rig, "program", seconds=2.5, period=0.1)
    for _ in range(15):
        rig.assembly.walk.drive({"forward": 0.1}, "behavior")
        sends(rig, "behavior", seconds=0.1, period=0.1)
        assert walks(rig)


def test_a_program_that_is_silent_ends_the_walk_of_no_other(rig):
    sends(rig, "program", seconds=2.5, period=0.1)
    rig.programs.drive(WalkVelocity(forward=0.1), math.inf, "another")
    sends(rig, "another", seconds=1.5, period=0.1)
    assert walks(rig)


def test_a_way_may_last_for_a_minute(rig):
    rig.reach(AHEAD, seconds=60.0)
    with pytest.raises(Refusal, match="reached within 60 s"):
        rig.reach(AHEAD, seconds=60.1)


def test_a_call_has_a_longest_parameter(rig):
    operations = {1: lambda parameter, _client: len(parameter)}
    assert rig.programs.answer(operations, 1, 4096 * " ", "program") == (0, "4096")
    assert rig.programs.answer(operations, 1, 4097 * " ", "program") == (WRONG, "")


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (Refusal(123, "not so"), 123),
        (CommandRefused("not so"), 409),
        (InvalidCommand("joint", "not so"), 409),
        (HardwareFailure("not so"), 500),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_call_that_fails_has_no_result_and_its_event_says_why(rig, error, code):
    def fail(_parameter, _client):
        raise error

    assert rig.programs.answer({1: fail}, 1, "", "program") == (code, "")
    newest = rig.assembly.events.snapshot()[0][-1]
    assert newest.message == f"answered a program with error {code}: not so"


@pytest.mark.parametrize("error", [OSError, SystemExit])
def test_a_driver_that_fails_leaves_no_program_waiting(rig, caplog, error):
    def fail(_parameter, _client):
        raise error("no bus")

    assert rig.programs.answer({1: fail}, 1, "", "program") == (500, "")
    newest = rig.assembly.events.snapshot()[0][-1]
    assert newest.message == f"answered a program with error 500: {error.__name__}: no bus"
    assert "a call of a program failed" in caplog.text


def test_what_is_said_of_a_parameter_has_a_longest_length(rig):
    with pytest.raises(Refusal) as refusal:
        rig.programs.read('"' + 1000 * "a" + '"', Literal["b"])
    assert len(str(refusal.value)) == 200


def test_a_posture_that_waited_and_is_refused_is_an_event(rig, monkeypatch):
    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moving", True)
        rig.programs.go("Crouch", "program")
    rig.assembly.gate.acquire("behavior", "dance", 30.0)
    rig.programs.renew()
    assert "held by dance" in rig.events[-1]


def go_after_a_walk(rig, monkeypatch):
    with monkeypatch.context() as walking:
        walking.setattr(LastingWalk, "moving", True)
        rig.programs.go("Crouch", "program")
    rig.programs.renew()


@pytest.mark.parametrize(
    ("start", "posture", "go"),
    [
        ("StandInit", "Crouch", lambda rig, _: rig.programs.go("Crouch", "program")),
        ("StandInit", "Crouch", go_after_a_walk),
        ("Crouch", "Stand", lambda rig, _: rig.programs.stand("program")),
    ],
    ids=["at once", "after a walk", "to stand"],
)
def test_a_posture_is_taken_at_full_pace(rig, monkeypatch, start, posture, go):
    def seconds(begin):
        rig.robot.place(rig.robot.body.postures[start].angles)
        begin()
        begun = rig.clock.now()
        while rig.assembly.player.busy:
            rig.clock.advance(0.02)
            rig.assembly.player.tick()
        return rig.clock.now() - begun

    full = seconds(lambda: rig.assembly.postures.go(posture, 1.0, "program"))
    assert seconds(lambda: go(rig, monkeypatch)) == pytest.approx(full) != 0.0


def test_the_height_is_that_of_the_joints_as_they_are_measured(rig):
    rig.programs.go("Crouch", "program")
    for _ in range(10):
        rig.clock.advance(0.02)
        rig.assembly.player.tick()
    measured = rig.assembly.body.angles(measured=True)
    place = kinematics_of(rig.robot.body).torso_place(measured)
    assert rig.programs.height() == pytest.approx(place[2, 3], abs=1e-9)


def test_a_way_begins_where_the_setpoints_of_a_moving_hand_are(rig):
    rig.reach(AHEAD)
    rig.advance(0.5)
    there = rig.hand
    rig.reach(ASIDE, seconds=60.0)
    rig.advance(0.1)
    assert rig.hand == pytest.approx(there, abs=1e-3)


def test_a_robot_whose_motors_take_no_gains_says_so():
    robot = FakeRobot(VirtualClock())
    programs = Programs(
        robot, Assembly(robot, ServerOptions(), robot.clock), "maker", Codes(404, WRONG, 409, 500)
    )
    with pytest.raises(HardwareFailure, match=r"^the motors of this robot take no gains by command$"):
        programs.gains  # noqa: B018
