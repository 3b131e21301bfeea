"""The medium between the robots of a team in virtual time: it delays and loses messages as it is told."""

from __future__ import annotations

import random
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from typing import Final, Self

from hfsm_runtime.virtual.clock import TaskClock
from zenoh_ice.transport import Registration

NOISY_LOSS: Final = 0.1
"""Share of the messages that a robot does not hear on a busy wireless network."""
NOISY_DELAY: Final = (0.005, 0.05)
"""In s, from the shortest to the longest."""


class VirtualMedium:
    """Carry messages between the robots of one clock; each listener loses other ones.

    The same seed loses the same messages. Implements `naoserver.serving.medium.Medium`.
    """

    def __init__(
        self,
        clock: TaskClock,
        *,
        seed: int = 0,
        loss: float = 0.0,
        delay: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self._clock: Final = clock
        self._random: Final = random.Random(seed)
        self._loss: Final = loss
        self._delay: Final = delay
        self._listeners: Final = defaultdict[str, dict[int, Callable[[bytes], object]]](dict)
        self._count = 0

    @classmethod
    def noisy(cls, clock: TaskClock, seed: int) -> Self:
        """Return a medium as bad as a busy wireless network: what `--noise` is for a team."""
        return cls(clock, seed=seed, loss=NOISY_LOSS, delay=NOISY_DELAY)

    def send(self, team: str, message: bytes) -> None:
        """Let every listener of a team hear a message after its delay, unless it is lost."""
        for number in self._listeners[team]:
            lost = self._random.random() < self._loss
            when = self._clock.now() + self._random.uniform(*self._delay)
            if not lost:
                self._clock.call_at(when, partial(self._hear, team, number, message))

    def subscribe(self, team: str, callback: Callable[[bytes], object]) -> Registration:
        """Call a function with each message of a team, those that are sent from here included."""
        self._count += 1
        number, listeners = self._count, self._listeners[team]
        listeners[number] = callback
        return Registration(partial(listeners.pop, number, None))

    def _hear(self, team: str, number: int, message: bytes) -> None:
        if (callback := self._listeners[team].get(number)) is not None:
            callback(message)
