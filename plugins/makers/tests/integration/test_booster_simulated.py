"""A program for the T1 moves the simulated one: its calls and commands are seen in the physics, in virtual time."""

from __future__ import annotations

import json

import pytest

from naoserver.bodies.kinematics import kinematics_of
from naoserver.serving.moves import MOTION
from plugins.makers.tests.support.simulated_programs import SimulatedPrograms
from visualhfsm_makers._booster._loco import CODES, CUSTOM, DAMPING, WALKING, Loco

MODE, MOVE, WAVE, HAND, SHOOT = 2000, 2001, 2005, 2009, 2024


class Rig(SimulatedPrograms):
    def __init__(self) -> None:
        super().__init__("T1", "Booster", CODES)
        self.loco = Loco(self.programs)

    def call(self, operation, **body):
        answer = self.programs.answer(self.loco.operations, operation, json.dumps(body), "program")
        assert answer == (0, "")

    def angle(self, joint):
        return self.robot.read().positions[self.assembly.body.index(joint)]


@pytest.fixture
def rig():
    rig = Rig()
    rig.live(0.5)
    yield rig
    rig.robot.close()


def test_it_walks_until_it_is_told_to_stop(rig):
    rig.call(MOVE, vx=0.3, vy=0.0, vyaw=0.0)
    rig.live(3.0)
    rig.call(MOVE, vx=0.0, vy=0.0, vyaw=0.0)
    rig.live(1.5)
    x = rig.robot.stage.truth().torso.position[0]
    rig.live(1.0)
    assert x > 0.6
    assert rig.robot.stage.truth().torso.position[0] == pytest.approx(x, abs=0.05)


def test_damped_in_a_walk_it_takes_its_last_step_and_crouches(rig):
    height = rig.programs.height()
    rig.call(MOVE, vx=0.3, vy=0.0, vyaw=0.0)
    rig.live(1.0)
    rig.call(MODE, mode=DAMPING)
    rig.live(5.0)
    assert rig.programs.height() < height - 0.1
    rig.call(MODE, mode=WALKING)
    rig.live(4.0)
    assert rig.programs.height() > height - 0.03
    assert not rig.robot.state().fallen


def test_it_does_not_crouch_after_its_last_step_if_it_was_stopped_meanwhile(rig):
    height = rig.programs.height()
    rig.call(MOVE, vx=0.3, vy=0.0, vyaw=0.0)
    rig.live(1.0)
    rig.call(MODE, mode=DAMPING)
    rig.assembly.gate.stop("a test")
    rig.assembly.gate.reset()
    rig.live(5.0)
    assert rig.programs.height() == pytest.approx(height, abs=0.03)


def test_a_kick_waits_for_the_end_of_the_walk(rig):
    rig.call(MOVE, vx=0.3, vy=0.0, vyaw=0.0)
    rig.live(1.0)
    rig.call(SHOOT)
    assert rig.assembly.player.progress(MOTION).count == 0
    rig.live(3.0)
    assert rig.assembly.player.progress(MOTION).name == "kick"
    rig.live(5.0)
    assert not rig.robot.state().fallen


def test_modes_without_waits_leave_it_in_the_last_one(rig):
    height = rig.programs.height()
    for mode in (DAMPING, WALKING, DAMPING, WALKING):
        rig.call(MODE, mode=mode)
        rig.live(0.4)
    rig.call(MOVE, vx=0.3, vy=0.0, vyaw=0.0)
    rig.live(6.0)
    assert rig.robot.stage.truth().torso.position[0] > 0.3
    assert rig.programs.height() > height - 0.05
    assert not rig.robot.state().fallen


def test_it_waves(rig):
    rig.call(WAVE, hand_action=0, hand_index=1)
    rig.live(2.5)
    assert rig.angle("Right_Shoulder_Pitch") < -2.0


def test_its_hand_goes_to_a_place_while_it_stands(rig):
    place = {"x": 0.3, "y": 0.25, "z": 0.1}
    rig.call(HAND, target_posture={"position": place}, time_millis=1000, hand_index=0)
    rig.live(2.0)
    angles = rig.assembly.body.angles(measured=True)
    hand = kinematics_of(rig.robot.body).place_of("LArm", angles)
    assert hand[:3, 3] == pytest.approx([*place.values()], abs=0.03)
    assert not rig.robot.state().fallen


def test_in_the_custom_mode_a_program_holds_it_upright(rig):
    rig.call(MODE, mode=CUSTOM)
    there = rig.robot.read().positions
    motors = [(angle, 0.0, 0.0, 1000.0, 20.0, 1.0) for angle in there]
    motors[0] = (0.3, 0.0, 0.0, 50.0, 2.0, 1.0)
    rig.live(2.0, lambda: rig.loco.follow(motors, "program"))
    assert rig.angle("AAHead_yaw") == pytest.approx(0.3, abs=0.05)
    assert not rig.robot.state().fallen
