"""Readings for the services, and their guarded commands."""

from __future__ import annotations

import logging
import threading
from dataclasses import asdict
from typing import Final

from interfaces.nao import ActionStatus
from naoserver.assembly import Assembly
from naoserver.capabilities import Odometry, WalkVelocity
from naoserver.errors import HardwareFailure, InvalidCommand, RobotError
from naoserver.kinematics import Matrix, place_of, rotation, torso_place
from naoserver.robot import Robot
from naoserver.servants.motions import PosturesI
from naoserver.walk_guard import WalkGuard
from naoserver.walk_to import Way
from naoserver_qi.calls import Call

_logger = logging.getLogger(__name__)

CLIENT: Final = "NAOqi"
"""The client that guards see: libqi does not distinguish its clients. It holds no lease."""
PERIOD: Final = 0.02
"""Robot seconds between two setpoints: ALMotion's cycle."""
_TORSO, _WORLD, _ROBOT = 0, 1, 2
"""NAOqi's numbers of frames."""
_ENDING: Final = 5.0
"""Robot seconds that a walk or a motion gets to end."""
RENEWAL: Final = 0.15
"""Wall seconds after which a command is renewed: well within the guard's timeout."""
_STILL: Final = WalkVelocity()


class Access:
    """A robot, and the guards before whatever moves it."""

    def __init__(self, robot: Robot, assembly: Assembly) -> None:
        self.robot: Final = robot
        self.body: Final = assembly.body
        """Its joints."""
        self.walk: Final = next((guard for guard in assembly.watched if isinstance(guard, WalkGuard)), None)
        """Its walk; None when it has none."""
        self.walk_to: Final = assembly.walk_to
        """Its walk to a place; None when it has none."""
        self.player: Final = assembly.player
        """The player of motions."""
        postures = assembly.servants["Postures"]
        assert isinstance(postures, PosturesI)
        self.postures: Final = postures
        """The controller of postures."""

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
        inertial = self.robot.senses.read().inertial if self.robot.senses else None
        place = torso_place(angles, *((inertial.roll, inertial.pitch) if inertial else ())) @ place
        if frame == _WORLD and self.walk is not None:
            at = self.walk.read()
            floor = rotation((0.0, 0.0, 1.0), at.heading)
            floor[:2, 3] = at.x, at.y
            place = floor @ place
        return place


class Walking:
    """Walk through the guard, and renew what was commanded until something ends it.

    The guard stops what is not renewed. libqi does not report when a client is gone, so a walk continues as
    it does on the real robot, until stopMove, another client, a fall, the emergency stop or the end of the
    service.
    """

    def __init__(self, access: Access) -> None:
        self._walker = access.robot.walker
        self._access = access
        self._lock = threading.Lock()
        self._wanted = _STILL
        self._closed = False

    @property
    def guard(self) -> WalkGuard:
        """The walk behind its safety layer. Raises HardwareFailure when there is none."""
        if self._access.walk is None:
            raise HardwareFailure("this robot does not walk")
        return self._access.walk

    @property
    def active(self) -> bool:
        """Whether a velocity is commanded."""
        return self._access.walk is not None and self._access.walk.commanded() != _STILL

    @property
    def moving(self) -> bool:
        """Whether it moves the legs: from a command until it stands on both feet again."""
        return self.active or (self._walker is not None and self._walker.walking)

    def go(self, velocity: WalkVelocity, limits: WalkVelocity | None = None) -> None:
        """Walk at a velocity within limits until further notice. Raises as `WalkGuard.drive` does."""
        with self._lock:
            if self._closed:
                return
            self._drive(velocity, limits)

    def stop(self) -> None:
        """End the walk on both feet; nobody is refused to."""
        with self._lock:
            self._wanted = _STILL
            if self._access.walk is not None:
                self._access.walk.stop()

    def go_to(
        self, call: Call, place: tuple[float, float, float], start: Odometry, highest: WalkVelocity
    ) -> bool:
        """Walk to a place in m and rad as the robot stood at `start`; return whether it came."""
        walk_to = self._access.walk_to
        if walk_to is None:
            raise HardwareFailure("this robot does not walk")
        with self._lock:
            if self._closed:
                return False
            walk_to.begin(Way(place, start, highest), CLIENT)
        try:
            while walk_to.busy:
                if call.wait(PERIOD):
                    return False
            return walk_to.state().status is ActionStatus.Done
        finally:
            self.stop()
            self._access.free(call)

    def renew(self) -> None:
        """Renew the commanded velocity, unless something ended the walk; due every RENEWAL while `active`."""
        with self._lock:
            if self._wanted == _STILL:
                return
            if self.guard.commanded() != self._wanted:  # it was ended, or another client walks
                self._wanted = _STILL
                return
            try:
                self._drive(self._wanted)
            except RobotError as error:
                _logger.warning("the walk ends: %s", error)
                self._wanted = _STILL

    def close(self) -> None:
        """End the walk for good."""
        self.stop()
        with self._lock:
            self._closed = True

    def _drive(self, velocity: WalkVelocity, limits: WalkVelocity | None = None) -> None:
        self.guard.drive(asdict(velocity), CLIENT, limits)
        self._wanted = self.guard.commanded()  # as it was limited
