"""A program for the G1 moves the simulated one: its calls and commands are seen in the physics, in virtual time."""

from __future__ import annotations

import json

import pytest

from naoserver.unitree import _skills
from naoserver.unitree._joints import Joints
from naoserver.unitree._loco import CODES, Loco
from tests.support.simulated_programs import SimulatedPrograms


class Rig(SimulatedPrograms):
    def __init__(self) -> None:
        super().__init__("G1", "Unitree", CODES)
        self.loco, self.arm = Loco(self.programs).operations, _skills.arm(self.programs)
        self.joints = Joints(self.programs)

    def call(self, operation, value, service=None):
        parameter = json.dumps({"data": value} if isinstance(value, int) else value)
        assert self.programs.answer(service or self.loco, operation, parameter, "program") == (0, "")


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
