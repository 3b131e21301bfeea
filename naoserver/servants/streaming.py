"""What the state pump knows of the servants whose state it streams."""

from __future__ import annotations

from typing import Protocol

from naoserver.guarded_device import GuardedDevice
from naoserver.robot import JointReading


class StreamsState(Protocol):
    """A servant that streams a part of a device's joint state."""

    @property
    def device(self) -> GuardedDevice:
        """The device whose readings it streams."""
        ...

    @property
    def listening(self) -> bool:
        """Whether anybody listens to its stream."""
        ...

    def publish(self, reading: JointReading) -> None:
        """Send a reading to whoever listens."""
        ...
