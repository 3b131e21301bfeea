"""What the state pump knows of the servants whose state it streams."""

from __future__ import annotations

from typing import Any, Protocol


class StateSource(Protocol):
    """What several servants tell of: one reading serves them all."""

    def read(self) -> Any:  # noqa: ANN401  (what its servants take)
        """Return the newest snapshot without blocking."""
        ...


class StreamsState(Protocol):
    """A servant that streams a part of what its device reads: of the joints, the senses, the odometry."""

    @property
    def device(self) -> StateSource:
        """What is read for it."""
        ...

    @property
    def listening(self) -> bool:
        """Whether anybody listens to its stream."""
        ...

    def publish(self, reading: Any, /) -> None:  # noqa: ANN401  (what its device reads)
        """Send a reading to whoever listens."""
        ...
