"""Where the body was in the last moments: a picture shows what was, when it arrives."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.jobs import Job, Periodic
from naoserver.kinematics import Matrix, kinematics_of
from naoserver.robot import Robot

Situation = NDArray[np.float64]
"""The robot time in s, roll and pitch of the torso, and the angles of all joints in rad."""

_PERIOD: Final = 0.02
_MOST_SITUATIONS: Final = 50
"""Situations that are kept: those of a second."""
_WANTED: Final = 1.0
"""Seconds after a picture for which situations are noted, for the next one."""


class BodyHistory:
    """Note the situations of the body while pictures are taken, and return that of a time.

    `job` notes them every 20 ms of robot time from the first picture on, until none was taken for a second;
    `begins` is called when it has something to do again. A picture that is older than all situations counts
    as taken in the oldest one. Thread-safe.
    """

    def __init__(self, robot: Robot, begins: Callable[[], None]) -> None:
        self._robot = robot
        self._kinematics = kinematics_of(robot.body)
        self._begins = begins
        self._lock = threading.Lock()
        self._past: deque[Situation] = deque(maxlen=_MOST_SITUATIONS)
        self._used = -math.inf
        self.job: Final[Job] = Periodic(
            "places of the body",
            robot.clock,
            lambda: _PERIOD,
            self.note,
            thread="state",
            wanted=self._wanted,
        )

    def note(self) -> Situation:
        """Note and return the present situation."""
        joints, senses = self._robot.read(), self._robot.senses
        inertial = senses.inertial() if senses else None
        tilt = (inertial.roll, inertial.pitch) if inertial else (0.0, 0.0)
        situation = np.array([joints.time, *tilt, *joints.positions])
        with self._lock:
            if not self._past or self._past[-1][0] < situation[0]:
                self._past.append(situation)
        return situation

    def at(self, time: float) -> Situation:
        """Return the situation at a time of a picture in s, between the noted ones."""
        rested = not self._wanted()
        self._used = self._robot.clock.now()
        if rested:
            self._begins()
        with self._lock:
            past = list(self._past)
        after = next((index for index, each in enumerate(past) if each[0] >= time), len(past) - 1)
        first, second = past[max(after - 1, 0)], past[after]
        share = (time - float(first[0])) / max(float(second[0] - first[0]), 1e-6)
        return np.asarray(first + min(max(share, 0.0), 1.0) * (second - first), np.float64)

    def _wanted(self) -> bool:
        return self._robot.clock.now() - self._used < _WANTED

    def place_in(self, situation: Situation, link: str) -> Matrix:
        """Return where a link is in the robot's frame."""
        _, roll, pitch, *positions = situation.tolist()
        angles = dict(zip((joint.name for joint in self._robot.joints), positions, strict=True))
        root = self._kinematics.torso_place(angles, roll, pitch)
        return root @ self._kinematics.link_place(link, angles)
