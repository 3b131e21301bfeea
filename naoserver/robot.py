"""The door to what a robot has to do, for hardware of one's own: see `naoserver.protocol.robot`."""

from naoserver.protocol.robot import (
    LIMP,
    BodyState,
    Frame,
    JointDevice,
    JointFault,
    JointReading,
    Robot,
)

__all__ = ["LIMP", "BodyState", "Frame", "JointDevice", "JointFault", "JointReading", "Robot"]
