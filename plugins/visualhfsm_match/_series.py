"""Matches in processes, one each: what a document does to its process, it does to its own match alone."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from pathlib import Path
from typing import Final, NamedTuple

from visualhfsm.plugins import NoAnswerError, TaskProcesses
from visualhfsm_match._errors import MatchError
from visualhfsm_match._match import Plan, Result
from visualhfsm_match._process import LONGEST_TURN, Answer, Task
from visualhfsm_match._referee import Event

_MODULE: Final = "visualhfsm_match._process"
_PREFIX: Final = "visualhfsm-match-"
_TEAM: Final = re.compile(r"\W+")
_LONGEST_NAME: Final = 24


class Fixture(NamedTuple):
    """A match to play, the file of its page if there is to be one, and that of its film as it grows."""

    plan: Plan
    page: Path | None = None
    film: Path | None = None


def play_match(fixture: Fixture, limit: float, longest_turn: float = LONGEST_TURN) -> Result:
    """Play a match in a separate process, within `limit` s by the wall. Raises MatchError.

    A team whose code ran when the process ended, or was ended, loses. A piece of code may compute for
    `longest_turn` s of processor time.
    """
    plan, page, film = fixture
    processes = TaskProcesses(_MODULE, Answer, _PREFIX)
    try:
        with tempfile.TemporaryDirectory(prefix=_PREFIX) as folder:
            turns = Path(folder, "turn")
            turns.write_bytes(b"\0")
            try:
                task = Task(plan, str(turns), str(page or ""), str(film or ""), longest_turn)
                answer = processes.ask(task, limit)
            except NoAnswerError as error:
                return _lost(plan, turns.read_bytes()[0], str(error))
    finally:
        processes.close()
    if answer.result is None:
        raise MatchError.of(answer.refused)
    return answer.result


def play_all(fixtures: Iterable[Fixture], workers: int, limit: float) -> Iterator[tuple[Fixture, Result]]:
    """Yield matches with their results, as they end. Raises MatchError."""
    left = iter(fixtures)
    with ThreadPoolExecutor(workers) as pool:
        running: dict[Future[Result], Fixture] = {}
        try:
            while True:
                for each in islice(left, workers - len(running)):
                    running[pool.submit(play_match, each, limit)] = each
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    yield running.pop(future), future.result()
        finally:
            for future in running:
                future.cancel()


def team_names(documents: Sequence[Path]) -> list[str]:
    """Return a name for the team of each document: that of its file, with a number where several have it."""
    names: list[str] = []
    for path in documents:
        stem = _TEAM.sub("_", path.stem)[:_LONGEST_NAME] or "team"
        number = sum(name == stem or name.rpartition("_")[0] == stem for name in names)
        names.append(f"{stem}_{number + 1}" if number else stem)
    return names


def _lost(plan: Plan, turn: int, why: str) -> Result:
    if not 1 <= turn <= len(plan.teams):
        raise MatchError.of(f"{plan.teams[0]} : {plan.teams[1]}: the match cannot be judged: {why}")
    loser, winner = plan.teams[turn - 1], plan.teams[2 - turn]
    reason = f"{loser} loses: {why}"
    return Result(
        teams=plan.teams,
        score=(0, 0),
        winner=winner,
        reason=reason,
        events=(Event(0.0, "lost", reason, loser), Event(0.0, "end", "the end", winner)),
    )
