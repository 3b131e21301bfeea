"""What the state pump knows of the servants whose state it streams."""

from __future__ import annotations

import math
from typing import Any, Final, Protocol

_REMINDER: Final = 0.5
"""Robot seconds after which a state is sent again that has not changed."""


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


class Changes:
    """Tell which states of something that seldom changes are to be sent: not each of them."""

    def __init__(self) -> None:
        self._last: object = None
        self._sent = -math.inf

    def are_news(self, state: object, time: float) -> bool:
        """Return whether a state differs from the last one sent, or that was long ago in robot time.

        Whoever began to listen since then gets it so.
        """
        if state == self._last and 0.0 <= time - self._sent < _REMINDER:
            return False
        self._last, self._sent = state, time
        return True
