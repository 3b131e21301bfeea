"""A robot that does not come to rest when it is stopped."""

from __future__ import annotations

from dataclasses import replace

from naoserver.fake import FakeRobot
from naoserver.robot import JointReading


class Coasting(FakeRobot):
    """A robot one of whose joints moves as long as a test says."""

    def __init__(self) -> None:
        super().__init__()
        self.coasts = True
        self.reads = 0

    def read(self) -> JointReading:
        self.reads += 1
        reading = super().read()
        return replace(reading, velocities=(1.5, *reading.velocities[1:])) if self.coasts else reading
