"""What a reset of the emergency stop must not start: a program that commands on, by whatever door."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from naoserver.serving.assembly import Assembly
from tests.support.waiting import until

__all__ = ["check_that_a_reset_starts_nothing"]

_GOES_ON: Final = 20
"""How often the program commands after the first refusal that follows the reset."""


def check_that_a_reset_starts_nothing(
    assembly: Assembly,
    command: Callable[[], object],
    moves: Callable[[], bool],
) -> None:
    """Check it of a program whose `command` is sent once by each call, also where that is refused.

    `moves` returns whether the robot moves by it.
    """

    def said(words: str) -> bool:
        return any(words in event.message for event in assembly.events.snapshot()[0])

    until(lambda: command() or moves())
    assembly.gate.stop("a test")
    until(lambda: command() or said("refused a command: the robot is stopped: a test"))
    until(lambda: not moves())
    assembly.gate.reset()
    until(lambda: command() or said("the emergency stop ended the commands"))
    for _ in range(_GOES_ON):
        command()
        assert not moves()
    assembly.gate.reset(resume=True)
    until(lambda: command() or moves())
