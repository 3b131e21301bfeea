"""ALMotion: joints, stiffness, the walk, and what is known of the body."""

from __future__ import annotations

from naoserver.qi_service.access import Access
from naoserver.qi_service.joint_motion import JointMotion
from naoserver.qi_service.motion_body import BodyOperations
from naoserver.qi_service.motion_cartesian import CartesianOperations
from naoserver.qi_service.motion_joints import JointOperations
from naoserver.qi_service.motion_reflexes import ReflexOperations
from naoserver.qi_service.motion_stiffness import StiffnessOperations
from naoserver.qi_service.motion_tasks import TaskOperations
from naoserver.qi_service.motion_walk import WalkOperations
from naoserver.qi_service.postures import Postures
from naoserver.qi_service.walking import Walking

__all__ = ["ALMotion"]


class ALMotion(
    JointOperations,
    StiffnessOperations,
    WalkOperations,
    TaskOperations,
    BodyOperations,
    CartesianOperations,
    ReflexOperations,
):
    """All that moves the robot."""

    def __init__(self, access: Access, motion: JointMotion, postures: Postures, walking: Walking) -> None:
        JointOperations.__init__(self, access, motion)
        StiffnessOperations.__init__(self, access, postures)
        WalkOperations.__init__(self, walking)
        TaskOperations.__init__(self, access, motion, walking)
        BodyOperations.__init__(self, access)
        CartesianOperations.__init__(self, access)
        ReflexOperations.__init__(self)
