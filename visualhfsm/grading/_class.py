"""Grade all submissions of a class, in processes side by side."""

from __future__ import annotations

import base64
import os
import pickle
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import msgspec

from codegen.messages import Message
from visualhfsm._line_process import KilledError, LineProcess, NoAnswerError, TooSlowError
from zenoh_ice import typed

from ._errors import GradingError
from ._exercise import Exercise
from ._marks import Marks
from ._page import write_page
from ._submissions import Submission
from ._worker import Answer, Task

if TYPE_CHECKING:
    from zenoh_ice.application.cli import Stop

_MARGIN: Final = 60.0
"""Wall s beyond the limits of its trials after which a submission is given up."""
_ATTEMPTS: Final = 2
"""How often a submission is graded whose process is killed, perhaps by somebody else."""
_ENDED: Final = Message("grading has been ended")
_POLL_PERIOD: Final = 0.2
"""s between two looks at whether a signal has come."""
_ENVIRONMENT: Final[Mapping[str, str]] = {
    "PYTHONHASHSEED": "0",  # the order of sets
    "OPENBLAS_NUM_THREADS": "1",  # other submissions use the other processors
    "OMP_NUM_THREADS": "1",
}


def grade_class(
    exercise: Exercise,
    submissions: Sequence[Submission],
    *,
    language: str,
    unsafe: bool,
    stop: Stop,
    pages: Path | None = None,
    workers: int | None = None,
    graded: Callable[[Marks], object] = lambda _: None,
) -> list[Marks]:
    """Return the marks of all submissions in their order, fewer after a signal to stop.

    With `pages` the page of each is written into that folder. `graded` is called with the marks as they come.
    Raises GradingError.
    """
    number = min(workers or len(os.sched_getaffinity(0)), len(submissions))
    with (
        ThreadPoolExecutor(number, thread_name_prefix="grader") as pool,
        closing(_Processes()) as processes,
    ):

        def grade(submission: Submission) -> Marks:
            path = submission.path.absolute()
            task = Task(exercise.folder.resolve(), path, submission.name, language, unsafe)
            marks = processes.grade(exercise, task)
            if pages is not None:
                processes.write_page(exercise, task, marks, pages / f"{submission.page}.html")
            return marks

        futures = [pool.submit(grade, each) for each in submissions]
        waiting = set(futures)
        try:
            while waiting and not stop.is_set():
                ended, waiting = wait(waiting, _POLL_PERIOD, FIRST_COMPLETED)
                for future in ended:
                    graded(future.result())
        finally:
            for future in waiting:
                future.cancel()
        return [future.result() for future in futures if future not in waiting]


class _Processes:
    """A process for each thread, which lasts from submission to submission."""

    def __init__(self) -> None:
        self._here = threading.local()
        self._lock = threading.Lock()
        self._all: list[LineProcess] = []
        self._closed = False

    def grade(self, exercise: Exercise, task: Task) -> Marks:
        """Return the marks of a submission, whatever its document does. Raises GradingError."""
        patience = sum(plan.runs * plan.patience for plan in exercise.plans.values()) + _MARGIN
        reason = ""
        for _ in range(_ATTEMPTS):
            try:
                answer = self._ask(task, patience)
            except TooSlowError:
                reason = f"grading it took more than {patience:g} s"
                break
            except KilledError:
                reason = "grading it was ended by the system, perhaps for want of memory"
            except NoAnswerError:
                reason = "reading it ended the program that grades"
                break
            else:
                if answer.marks is None:
                    raise GradingError(Message.verbatim(answer.refused))
                return answer.marks
            if self._closed:
                raise GradingError(_ENDED)
        return Marks.broken(exercise, task.name, exercise.language(task.language), reason)

    def write_page(self, exercise: Exercise, task: Task, marks: Marks, page: Path) -> None:
        """Write the page of a submission, with its worst trial if that can be recorded.

        Raises VisualHfsmError.
        """
        if not marks.reason:
            try:
                plan = exercise.plans[marks.worst_plan]
                answer = self._ask(replace(task, page=page, marks=marks), plan.patience + _MARGIN)
            except NoAnswerError:
                pass  # the same trial, recorded, takes longer: its marks are written anyway
            else:
                if answer.marks is None:
                    raise GradingError(Message.verbatim(answer.refused))
                return
        write_page(page, exercise, marks)

    def close(self) -> None:
        """End all processes."""
        with self._lock:
            self._closed = True
            processes = [*self._all]
        for process in processes:
            process.close()

    def _ask(self, task: Task, patience: float) -> Answer:
        answer = self._process().ask(base64.b64encode(pickle.dumps(task)), patience)
        try:
            return typed.from_json(answer, Answer)
        except msgspec.MsgspecError as error:
            raise NoAnswerError(f"it wrote something else: {error}") from error

    def _process(self) -> LineProcess:
        process: LineProcess | None = getattr(self._here, "process", None)
        if process is None:
            with self._lock:
                if self._closed:
                    raise GradingError(_ENDED)
                process = LineProcess(f"{__package__}._worker", _ENVIRONMENT)
                self._all.append(process)
            self._here.process = process
        return process
