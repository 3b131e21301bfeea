"""The process that plays one match: a line with the task, a line with its result.

Documents run here, and nothing else does: one that hangs, takes all memory or ends the process loses its
match.
"""

from __future__ import annotations

import mmap
import os
import resource
import signal
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec

from visualhfsm import VisualHfsmError
from visualhfsm.plugins import answer_tasks, write_html
from visualhfsm.trials import quiet
from visualhfsm_match._film import Film
from visualhfsm_match._match import BALL, Plan, Result, play
from visualhfsm_match._page import match_page
from zenoh_ice.application.tether import die_with

_MEMORY: Final = 6 << 30
"""Bytes that a match may take."""
LONGEST_TURN: Final = 20.0
"""s of processor time of one piece of a document's code."""


@dataclass(frozen=True, slots=True)
class Task:
    """A match to play."""

    plan: Plan
    turns: str
    """A file whose only byte says which team's code runs, from 1; 0 if none does."""
    page: str = ""
    """The file of its page, if there is to be one."""
    film: str = ""
    """The file to which its film is written as it grows, if there is one."""
    longest_turn: float = LONGEST_TURN


class Answer(msgspec.Struct, frozen=True):
    """What a match came to, or why it is not possible."""

    result: Result | None = None
    refused: str = ""


class TurnTooLongError(Exception):
    """Code computes for too long."""


def _interrupt(_number: int, _frame: object) -> None:
    raise TurnTooLongError("it computes for too long")


def _answer(task: Task) -> Answer:
    resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY, resource.getrlimit(resource.RLIMIT_DATA)[1]))
    with (
        Path(task.turns).open("r+b") as file,
        mmap.mmap(file.fileno(), 1) as turn,
        Path(task.film).open("ab") if task.film else nullcontext() as live,
    ):
        film = Film(BALL, live)

        def on_turn(team: int) -> None:
            turn[0] = team
            signal.setitimer(signal.ITIMER_PROF, task.longest_turn if team else 0.0)

        try:
            with quiet():
                result = play(task.plan, film, on_turn)
            if task.page:
                write_html(Path(task.page), match_page(task.plan, result, film))
        except VisualHfsmError as error:
            return Answer(refused=str(error))
    return Answer(result)


if __name__ == "__main__":
    die_with(os.getppid())  # a match that hangs would not notice that nobody waits for it
    signal.signal(signal.SIGPROF, _interrupt)
    answer_tasks(_answer)
