"""What becomes of a behavior whose robot fails: whether it goes on, notices, falls or hangs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from naoserver.bodies.capabilities import STILL

if TYPE_CHECKING:
    from visualhfsm.simulation import Behavior

SUCCEEDED: Final = "succeeded"
STOPPED: Final = "stopped"
FAILED: Final = "failed"
FELL: Final = "fell"
HUNG: Final = "hung"

_STILL: Final = 2.0
"""Seconds at the end in which a robot that was stopped does not move."""
_IDLE: Final = 2.5
"""Seconds without a cycle of any automaton after which a behavior hangs, and as many for each failed call.

That is more than the limit of a call.
"""


class Fate:
    """Watch a behavior from the moment on at which its robot fails, ten times a second."""

    def __init__(self, behavior: Behavior, cycles: Callable[[], int]) -> None:
        self._behavior: Final = behavior
        self._cycles: Final = cycles
        self._since: float | None = None
        self._goals: object = None
        self._moved = self._cycled = self._said = 0.0
        self._count = -1
        self._word: object = None
        self.walked = 0.0
        """The longest time in s for which it walked on without a change of its states, and without a word."""
        self.at = 0.0
        """Since when it is what `end` returned, in s of the trial."""

    def begin(self) -> None:
        """Begin to watch: the robot fails now."""
        self._since = self._moved = self._cycled = self._said = self._behavior.time

    def watch(self) -> None:
        """Look at it."""
        if self._since is None:
            return
        behavior, device, now = self._behavior, self._behavior.robot.device, self._behavior.time
        walks = device.walker is not None and device.walker.commanded() != STILL
        goals = device.read().commands
        if walks or goals != self._goals:
            self._moved, self._goals = now, goals
        if (count := self._cycles()) != self._count:
            self._cycled, self._count = now, count
        said = device.voice.utterance().count if device.voice is not None else 0
        word = (tuple(behavior.active_paths), said)
        if not walks or word != self._word:
            self._said, self._word = now, word
        self.walked = max(self.walked, now - self._said)

    def end(self, *, reached: bool, success: bool) -> str:
        """Return what became of it; `reached` is whether it is where it is to come to, as far as it is."""
        behavior = self._behavior
        self.at = now = behavior.time
        if behavior.robot.state.fallen:
            return FELL
        if reached and success:
            return SUCCEEDED
        ended = behavior.ended.is_set() or behavior.halted
        failed = sum(call.error is not None for call in behavior.calls() if call.time >= self._cycled)
        if not ended and self._since is not None and now - self._cycled > _IDLE * (1 + failed):
            self.at = self._cycled
            return HUNG
        if ended or now - self._moved > _STILL:
            self.at = self._moved
            return STOPPED
        return SUCCEEDED if success else FAILED
