"""Several components on one clock, in one thread: a robot each, in one world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Final

from .clock import NEVER, TaskClock
from .execution import Execution

_SECOND: Final = 1_000_000_000


class Together:
    """Executions that share a clock; of cycles due at one time those of the first run first.

    `runs` may be changed between two calls of `advance`. `on_turn` is called with the number of the execution
    whose code runs from now on, None for what belongs to none, or goes on after a sleep.
    """

    def __init__(
        self, clock: TaskClock, on_turn: Callable[[int | None], object] = lambda _number: None
    ) -> None:
        self.runs: Sequence[Execution | None] = ()
        self._clock: Final = clock
        self._on_turn: Final = on_turn

    def advance(self, seconds: float, failed: Callable[[int, Exception], object]) -> None:
        """Run all cycles that fall due in the next `seconds`, the end included.

        `failed` gets what an execution raised, with its number; it may take it out of `runs`.
        """
        clock = self._clock
        end = clock.moment + round(seconds * _SECOND)
        with ExitStack() as shown:
            for run in self.runs:
                if run is not None:
                    run.alone = False
                    shown.enter_context(run.time_shown())
            while (due := min((run.due for run in self.runs if run is not None), default=NEVER)) <= end:
                self._move_to(max(due, clock.moment))
                for number, run in enumerate(self.runs):
                    if run is not None and run.due <= clock.moment:
                        self._on_turn(number)
                        try:
                            run.advance(0.0)
                        except Exception as error:  # noqa: BLE001 - whatever user code raises
                            failed(number, error)
                        self._on_turn(None)
            self._move_to(end)

    def _move_to(self, when: int) -> None:
        asleep = {number for _, number, _ in self._clock.asleep}
        self._clock.move_to(when)
        if asleep.difference(number for _, number, _ in self._clock.asleep):
            for run in self.runs:
                if run is not None:
                    run.let_late_ones_begin()
