"""A trial as a task, and the processes that run tasks: one for each thread, here or on a cluster."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import msgspec

from codegen.messages import Message
from visualhfsm._base.line_process import KilledError, NoAnswerError, TooSlowError
from visualhfsm._base.task_processes import EndedError, TaskProcesses

from ._archive import Archive
from ._errors import TrialsError
from ._outcomes import Outcome
from ._plan import Plan

_ATTEMPTS: Final = 20
"""The most attempts at a trial whose process is killed: most probably it is no fault of the trial."""
_DRAW_LIMIT: Final = 60.0
"""Limit in s for drawing the values of a trial without running it."""


@dataclass(frozen=True, slots=True)
class Task:
    """A trial to run: its plan, whose document is that of the archive, and its number."""

    plan: Plan
    number: int
    archive: Archive
    runs: bool = True
    """Without it, only its values are drawn."""
    recording: str = ""
    """The file into which it is recorded, if it is to be; it is there once the trial has come to its end."""
    quiet: bool = True
    """True if nobody sees what it prints and logs."""

    @property
    def part(self) -> Path | None:
        """The file of a recording that has not ended yet."""
        return Path(f"{self.recording}.part") if self.recording else None

    @property
    def patience(self) -> float:
        """How long it may take by the wall, in s."""
        return self.plan.patience

    def with_archive(self, archive: Archive) -> Task:
        """Return the same trial with another archive, such as one without its content."""
        return replace(self, archive=archive)

    def run(self) -> Outcome:
        """Run it in a process of the thread that calls this. Raises TrialsError."""
        return _of_this_process.run(self)


class TaskResult(msgspec.Struct, frozen=True):
    """The outcome of a task, or why there is none."""

    outcome: Outcome | None = None
    refused: str = ""
    """Why its plan is not possible."""
    needs_archive: bool = False
    """True if its content is to be sent along, once for all tasks with it."""


class Processes(TaskProcesses[TaskResult]):
    """The processes of some threads: one each, which lasts from task to task."""

    def __init__(self) -> None:
        super().__init__(f"{__package__}._worker", TaskResult, "visualhfsm-trials-")

    def run(self, task: Task) -> Outcome:
        """Run a task in the process of this thread. Raises TrialsError for a plan that is not possible."""
        try:
            return self._ask(task, task.plan.patience)
        except KilledError:
            ended = f"its process was killed {_ATTEMPTS} times, perhaps for want of memory"
        except TooSlowError:
            ended = f"took more than {task.plan.patience:g} s"
        except NoAnswerError:
            ended = "ended its process"
        with TrialsError.in_place_of(
            NoAnswerError, "trial {number} cannot be drawn: {reason}", number=task.number
        ):
            return msgspec.structs.replace(self._ask(replace(task, runs=False), _DRAW_LIMIT), reason=ended)

    def _ask(self, task: Task, patience: float) -> Outcome:
        """Return the outcome of a task, which is asked for again when its process is killed meanwhile."""
        for attempt in range(1, _ATTEMPTS + 1):
            try:
                answer = self.ask(task.with_archive(task.archive.without_content), patience)
                if answer.needs_archive:
                    answer = self.ask(task, patience)
                break
            except KilledError:
                if attempt == _ATTEMPTS:
                    raise
            except EndedError as error:
                raise TrialsError.because("the trials have been ended") from error
        if answer.outcome is None:
            raise TrialsError(Message.verbatim(answer.refused))
        return answer.outcome


_of_this_process = Processes()


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0))
