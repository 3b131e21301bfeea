"""What programs of a robot's maker command, on a T1 without physics in virtual time."""

import math

import pytest

from naoserver._lasting_walk import LastingWalk
from naoserver._programs import Codes, Programs, Refusal
from naoserver.assembly import Assembly
from naoserver.bodies import find_body
from naoserver.errors import CommandRefused
from naoserver.fake import FakeRobot
from naoserver.kinematics import kinematics_of
from naoserver.options import ServerOptions
from zenoh_ice import VirtualClock

WRONG = 400
AHEAD, ASIDE = (0.3, 0.25, 0.15), (0.2, 0.35, 0.1)
"""Places that the left hand reaches, in the frame of the trunk."""


class Rig:
    """A T1 behind its guards, and programs in front of them."""

    def __init__(self):
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock, body=find_body("T1"))
        self.assembly = Assembly(self.robot, ServerOptions(), self.clock)
        self.programs = Programs(self.robot, self.assembly, "maker", Codes(404, WRONG, 409, 500))

    def reach(self, *places, seconds=1.0):
        self.programs.reach("LArm", places, seconds, "program")

    def advance(self, seconds):
        for _ in range(round(seconds / 0.02)):
            self.clock.advance(0.02)
            self.assembly.paths.tick()
            for watched in self.assembly.watched:
                watched.watch()

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


def test_a_way_may_last_for_a_minute(rig):
    rig.reach(AHEAD, seconds=60.0)
    with pytest.raises(Refusal, match="reached within 60 s"):
        rig.reach(AHEAD, seconds=60.1)
