"""ALRobotPosture and ALRobotPose over a fake robot, in virtual time."""

import pytest

pytest.importorskip("qi")

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._behaviors import ALRobotPose


def test_a_posture_at_more_than_full_pace_is_gone_to_at_full_pace(rig):
    assert rig.complete(rig.postures.goToPosture, "Crouch", 1.5) > 0.0
    assert rig.postures.getPosture() == "Crouch"
    with pytest.raises(InvalidCommand, match="above 0"):
        rig.complete(rig.postures.goToPosture, "Stand", -0.5)


def test_a_posture_has_its_former_name_and_an_age(rig):
    poses = rig.access.service(ALRobotPose)
    rig.complete(rig.postures.goToPosture, "Crouch", 1.0)
    assert poses.getActualPoseAndTime() == ["Crouch", 0.0]
    rig.advance(2.0)
    name, age = poses.getActualPoseAndTime()
    assert (name, age) == ("Crouch", pytest.approx(2.0))
    rig.complete(rig.postures.goToPosture, "StandZero", 1.0)
    assert poses.getActualPoseAndTime() == ["Stand", 0.0]
    assert {"Crouch", "Stand", "Unknown"} <= set(poses.getPoseNames())
