"""A program for the G1 moves the simulated one: its calls and commands are seen in the physics, in virtual time."""

from __future__ import annotations

import json
import math
import struct

import pytest

from plugins.makers.tests.support.simulated_programs import SimulatedPrograms
from tests.support.soak import cases
from visualhfsm_makers._unitree import _skills
from visualhfsm_makers._unitree._arms import Arms
from visualhfsm_makers._unitree._joints import Joints
from visualhfsm_makers._unitree._loco import CODES, Loco

WIRE = struct.Struct("<2BBx5fI" + "B3x5fI" * 34 + "5I")
UPPER_BODY = range(12, 29)
"""The maker's numbers of the motors of waist and arms."""
LEFT_SHOULDER_ROLL, LEFT_ELBOW = 16, 18
ARMS_ASIDE = {LEFT_SHOULDER_ROLL: math.pi / 2, LEFT_ELBOW: math.pi / 2, 23: -math.pi / 2, 25: math.pi / 2}
"""Where the maker's examples g1_arm5_sdk_dds_example.py and g1_arm7_sdk_dds_example.py lift the arms, in rad."""


class Rig(SimulatedPrograms):
    def __init__(self) -> None:
        super().__init__("G1", "Unitree", CODES)
        self.loco, self.arm = Loco(self.programs).operations, _skills.arm(self.programs)
        self.joints = Joints(self.programs)
        self.arms = Arms(self.programs)

    def call(self, operation, value, service=None):
        parameter = json.dumps({"data": value} if isinstance(value, int) else value)
        assert self.programs.answer(service or self.loco, operation, parameter, "program") == (0, "")

    def lead(self, seconds, targets, way, weight=lambda part: 1.0):
        """Command the upper body as the maker's examples do: from where it is now, by parts of a way."""
        for step in range(round(seconds / 0.05)):
            part = step * 0.05 / seconds
            at = self.robot.read().positions
            values: list[float] = [0, 0]
            for motor in range(35):
                target = targets.get(motor, 0.0)
                q = way(part) * target + (1.0 - way(part)) * at[motor] if motor in UPPER_BODY else 0.0
                q = weight(part) if motor == 29 else q
                values += [0, q, 0.0, 0.0, *((60.0, 1.5) if motor in UPPER_BODY else (0.0, 0.0)), 0]
            self.arms.obey(WIRE.pack(*values, 0, 0, 0, 0, 0), "arms")
            self.live(0.05)

    def at(self, motor):
        return self.robot.read().positions[motor]


@pytest.fixture
def rig():
    rig = Rig()
    rig.live(0.5)
    yield rig
    rig.robot.close()


def test_it_walks_as_long_as_a_velocity_says(rig):
    rig.call(7105, {"velocity": [0.3, 0.0, 0.0], "duration": 2.0})
    rig.live(3.0)
    x = rig.robot.stage.truth().torso.position[0]
    rig.live(1.0)
    assert x > 0.3
    assert rig.robot.stage.truth().torso.position[0] == pytest.approx(x, abs=0.05)


def test_it_crouches_and_stands_up(rig):
    height = rig.programs.height()
    rig.call(7104, 0)
    rig.live(3.0)
    assert rig.programs.height() < height - 0.1
    rig.call(7101, 706)
    rig.live(3.0)
    assert rig.programs.height() > height - 0.03
    assert not rig.robot.state().fallen


def test_it_waves(rig):
    rig.call(7106, 26, rig.arm)
    rig.live(2.5)
    assert rig.robot.read().positions[rig.assembly.body.index("right_shoulder_pitch_joint")] < -2.0


@pytest.mark.parametrize(
    "forward", cases([pytest.param(0.3, id="walking")], [pytest.param(0.0, id="standing")])
)
def test_the_makers_example_of_the_arms_ends_as_it_should(rig, forward):
    held = rig.robot.read().positions
    if forward:
        rig.call(7105, {"velocity": [forward, 0.0, 0.0], "duration": 100.0})
    rig.lead(3.0, {}, lambda part: part)
    rig.lead(6.0, ARMS_ASIDE, lambda part: part)
    assert rig.at(LEFT_SHOULDER_ROLL) > 1.4
    assert rig.at(LEFT_ELBOW) == pytest.approx(math.pi / 2, abs=0.1)
    rig.lead(3.0, {}, lambda part: part)
    rig.lead(1.0, {}, lambda part: part, weight=lambda part: 1.0 - part)
    rig.live(2.0)
    assert rig.at(LEFT_ELBOW) == pytest.approx(held[LEFT_ELBOW], abs=0.05)
    assert rig.robot.state().torso_tilt < 0.1
    assert (rig.robot.stage.truth().torso.position[0] > 3.0) is bool(forward)


def test_arms_of_a_program_that_is_gone_go_back_and_it_walks_on(rig):
    held = rig.robot.read().positions
    rig.call(7105, {"velocity": [0.3, 0.0, 0.0], "duration": 100.0})
    rig.lead(3.0, ARMS_ASIDE, lambda part: 1.0)
    rig.programs.drop("arms")
    rig.live(0.3)
    assert rig.at(LEFT_SHOULDER_ROLL) > held[LEFT_SHOULDER_ROLL] + 0.3  # not at once
    rig.live(2.0)
    assert rig.at(LEFT_SHOULDER_ROLL) == pytest.approx(held[LEFT_SHOULDER_ROLL], abs=0.05)
    assert rig.robot.state().torso_tilt < 0.1


def test_a_posture_that_waits_for_the_end_of_the_walk_takes_the_arms(rig):
    rig.call(7105, {"velocity": [0.3, 0.0, 0.0], "duration": 100.0})
    rig.lead(1.0, ARMS_ASIDE, lambda part: 1.0)
    rig.call(7104, 0)
    rig.lead(4.0, ARMS_ASIDE, lambda part: 1.0)
    assert rig.programs.height() < 0.6
    assert rig.at(LEFT_SHOULDER_ROLL) > 1.0  # and then its program has them again


def test_the_boot_sequence_of_public_programs_ends_upright(rig):
    rig.call(7101, 1)
    rig.call(7101, 4)
    for step in range(1, 12):
        rig.call(7104, {"data": 0.02 * step})
        rig.live(0.05)
    rig.call(7101, 200)
    rig.live(4.0)
    assert rig.robot.state().torso_tilt < 0.1
    rig.call(7105, {"velocity": [0.3, 0.0, 0.0], "duration": 2.0})
