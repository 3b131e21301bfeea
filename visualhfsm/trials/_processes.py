"""Run tasks in processes: one for each thread of the executor that runs them, here or on a cluster."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Final

import msgspec

from codegen.messages import Message
from visualhfsm._base.line_process import KilledError, NoAnswerError, TooSlowError
from visualhfsm._base.task_processes import EndedError, TaskProcesses

from ._errors import TrialsError
from ._outcomes import Outcome
from ._worker import Task, TaskResult

_ATTEMPTS: Final = 20
"""The most attempts at a trial whose process is killed: most probably it is no fault of the trial."""
_DRAW_LIMIT: Final = 60.0
"""Limit in s for drawing the values of a trial without running it."""


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


def run_task(task: Task) -> Outcome:
    """Run a task in a process of the thread that calls this: for the workers of a cluster."""
    return _of_this_process.run(task)


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0))
