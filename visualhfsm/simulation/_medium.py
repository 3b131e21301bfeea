"""The medium between the robots of a team in virtual time: it delays and loses messages as it is reported."""

from __future__ import annotations

import random
from collections import defaultdict
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final, Self

from hfsm_runtime.virtual.clock import TaskClock
from naoserver.serving.medium import Medium
from zenoh_ice.transport import Registration

NOISY_LOSS: Final = 0.1
"""Share of the messages that a robot does not hear on a busy wireless network."""
NOISY_DELAY: Final = (0.005, 0.05)
"""In s, from the shortest to the longest."""


class VirtualMedium:
    """Carry messages between robots, each with the clock of its behavior; each listener loses other ones.

    The same seed loses the same messages.
    """

    def __init__(self, *, seed: int = 0, loss: float = 0.0, delay: tuple[float, float] = (0.0, 0.0)) -> None:
        self._random: Final = random.Random(seed)
        self._loss: Final = loss
        self._delay: Final = delay
        self._listeners: Final = defaultdict[str, dict[_Antenna, Callable[[bytes], object]]](dict)

    @classmethod
    def noisy(cls, seed: int) -> Self:
        """Return a medium as bad as a busy wireless network: what `--noise` is for a team."""
        return cls(seed=seed, loss=NOISY_LOSS, delay=NOISY_DELAY)

    def at(self, clock: TaskClock) -> Medium:
        """Return the medium as a robot reaches it whose behavior has a clock."""
        return _Antenna(clock, self._listeners, self._carry)

    def _carry(self, team: str, message: bytes, sent_at: float) -> None:
        """Let every listener of a team hear a message after its delay, unless it is lost."""
        for antenna in self._listeners[team]:
            lost = self._random.random() < self._loss
            when = sent_at + self._random.uniform(*self._delay)
            if not lost:
                antenna.clock.call_at(when, partial(self._hear, antenna, team, message))

    def _hear(self, antenna: _Antenna, team: str, message: bytes) -> None:
        if (callback := self._listeners[team].get(antenna)) is not None:
            callback(message)


class _Antenna:
    """A medium at a robot; implements `Medium`."""

    def __init__(
        self,
        clock: TaskClock,
        listeners: Mapping[str, dict[_Antenna, Callable[[bytes], object]]],
        carry: Callable[[str, bytes, float], None],
    ) -> None:
        self.clock: Final = clock
        self._listeners: Final = listeners
        self._carry: Final = carry

    def send(self, team: str, message: bytes) -> None:
        self._carry(team, message, self.clock.now())

    def subscribe(self, team: str, callback: Callable[[bytes], object]) -> Registration:
        listeners = self._listeners[team]
        listeners[self] = callback
        return Registration(partial(listeners.pop, self, None))
