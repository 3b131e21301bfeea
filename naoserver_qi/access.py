"""What the services read, and the guarded ways by which they command."""

from __future__ import annotations

from typing import Final

import numpy as np

from naoserver.assembly import Assembly
from naoserver.errors import InvalidCommand
from naoserver.kinematics import Matrix, place_of, rotation
from naoserver.robot import Robot
from naoserver.servants.motions import PosturesI
from naoserver.walk_guard import WalkGuard
from naoserver_qi.calls import Call

CLIENT: Final = "NAOqi"
"""The client that guards see: libqi does not distinguish its clients. It holds no lease."""
PERIOD: Final = 0.02
"""Robot seconds between two setpoints: ALMotion's cycle."""
_TORSO, _WORLD, _ROBOT = 0, 1, 2
"""NAOqi's numbers of frames."""
_ENDING: Final = 5.0
"""Robot seconds that a walk or a motion gets to end."""


class Access:
    """A robot, and the guards before whatever moves it."""

    def __init__(self, robot: Robot, assembly: Assembly) -> None:
        self.robot: Final = robot
        self.body: Final = assembly.body
        """Its joints."""
        self.walk: Final = next((guard for guard in assembly.watched if isinstance(guard, WalkGuard)), None)
        """Its walk; None when it has none."""
        self.player: Final = assembly.player
        """What plays motions."""
        postures = assembly.servants["Postures"]
        assert isinstance(postures, PosturesI)
        self.postures: Final = postures
        """What brings it into postures."""

    def free(self, call: Call) -> None:
        """End the walk, or whatever else moves joints by itself, and wait until no joint is claimed.

        Returns anyway after some seconds, and when the call is cancelled.
        """
        joints = [joint.name for joint in self.body.joints]
        for _ in range(round(_ENDING / PERIOD)):
            if not self.body.claims.stop(joints) or call.wait(PERIOD):
                return

    def angles(self, *, measured: bool) -> dict[str, float]:
        """Return the measured angle or the setpoint of every joint in rad."""
        reading = self.body.read()
        values = reading.positions if measured else reading.commands
        return {joint.name: value for joint, value in zip(self.body.joints, values, strict=True)}

    def place(self, name: str, frame: object, *, measured: bool) -> Matrix:
        """Return where a joint, effector or camera is, by measured angles or by setpoints.

        `frame` is 0 for the torso's, 1 for the world's, which is that of odometry, and 2 for the robot's,
        which stands upright on the floor below the torso and faces as it does. Raises InvalidCommand for
        another.
        """
        if frame not in (_TORSO, _WORLD, _ROBOT):
            raise InvalidCommand("frame", f"there is no frame {str(frame)[:60]!r}; 0 torso, 1 world, 2 robot")
        angles = self.angles(measured=measured)
        place = place_of(name, angles)
        if frame == _TORSO:
            return place
        torso = np.eye(4)
        if self.robot.senses is not None:
            inertial = self.robot.senses.read().inertial
            torso = rotation((0.0, 1.0, 0.0), inertial.pitch) @ rotation((1.0, 0.0, 0.0), inertial.roll)
        # The lower sole stands on the floor.
        torso[2, 3] = -min(float((torso @ place_of(leg, angles))[2, 3]) for leg in ("LLeg", "RLeg"))
        place = torso @ place
        if frame == _WORLD and self.walk is not None:
            at = self.walk.read()
            floor = rotation((0.0, 0.0, 1.0), at.heading)
            floor[:2, 3] = at.x, at.y
            place = floor @ place
        return place
