"""The positions of the body's parts in ALMotion."""

import math

import numpy as np
import pytest

pytest.importorskip("qi")

from naoserver.bodies.capabilities import InertialReading
from naoserver.bodies.kinematics import angles_of
from naoserver.errors import InvalidCommand

TORSO, WORLD, ROBOT = 0, 1, 2


def test_in_the_world_it_is_where_it_walked(rig):
    rig.complete(rig.motion.moveTo, 0.2, 0.0, math.pi / 2)
    x, y, heading = rig.motion.getRobotPosition(True)
    torso = rig.motion.getPosition("Torso", WORLD, True)
    assert (*torso[:2], torso[5]) == pytest.approx((x, y, heading))
    ahead = rig.motion.getPosition("CameraTop", WORLD, True)
    assert ahead[1] - y == pytest.approx(rig.motion.getPosition("CameraTop", ROBOT, True)[0], abs=0.01)


def test_the_torso_tilts_in_the_frame_of_the_robot(rig):
    rig.robot.senses.feel(inertial=InertialReading((0, 0, 9.81), (0, 0, 0), 0.1, 0.2))
    assert rig.motion.getPosition("Torso", ROBOT, True)[3:] == pytest.approx([0.1, 0.2, 0.0])


def test_a_transform_reports_the_same(rig):
    matrix = np.array(rig.motion.getTransform("LArm", TORSO, False)).reshape(4, 4)
    assert [*matrix[:3, 3], *angles_of(matrix)] == pytest.approx(rig.motion.getPosition("LArm", TORSO, False))


@pytest.mark.parametrize(("name", "frame"), [("Nose", 0), ("Head", 3), ("Head", "torso")])
def test_what_is_nowhere(rig, name, frame):
    with pytest.raises(InvalidCommand, match="there is no"):
        rig.motion.getPosition(name, frame, True)
