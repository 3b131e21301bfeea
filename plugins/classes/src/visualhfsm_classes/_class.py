"""Grade all submissions of a class, in processes side by side."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final, Self, TypeVar

import msgspec

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm import VisualHfsmError
from visualhfsm.plugins import (
    EndedError,
    KilledError,
    NoAnswerError,
    NotReadyError,
    TaskProcesses,
    TooSlowError,
)
from visualhfsm_classes._errors import ComputerFailed, GradingError
from visualhfsm_classes._exercise import Exercise
from visualhfsm_classes._folder import MarksFolder
from visualhfsm_classes._marks import Marks
from visualhfsm_classes._page import write_page
from visualhfsm_classes._submissions import Submission, UnreadableSubmission, copy_submission
from visualhfsm_classes._worker import GradingResult, Task

if TYPE_CHECKING:
    from zenoh_ice.application.cli import Stop

R = TypeVar("R")

_MARGIN: Final = 60.0
"""Wall s beyond the limits of its trials after which a submission is given up."""
_ATTEMPTS: Final = 2
"""The most attempts to grade a submission whose process is killed, perhaps by somebody else."""
_HARMLESS: Final = (
    '<VisualHFSM><SubAutomata id="1" idFather="0"><state initial="true" id="1"><name>rests</name></state>'
    "</SubAutomata></VisualHFSM>"
)
"""A document that does nothing: a computer that cannot grade it can grade none."""
_ENDED: Final = Message("grading has been ended")
_POLL_PERIOD: Final = 0.2
"""s between two looks at whether a signal has come."""


class Graders:
    """Processes that grade the submissions of a class side by side; use it in a `with` block.

    After a signal to `stop` less is done. Methods raise GradingError.
    """

    def __init__(
        self, exercise: Exercise, language: str, stop: Stop, workers: int | None = None, *, unsafe: bool
    ) -> None:
        self._exercise = exercise
        self._language = language
        self._unsafe = unsafe
        self._stop = stop
        number = workers or len(os.sched_getaffinity(0))
        self._pool = ThreadPoolExecutor(number, thread_name_prefix="grader")
        self._processes = _Processes()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._processes.close()
        self._pool.shutdown()

    def grade(self, submissions: Sequence[Submission], graded: Callable[[], object]) -> list[Marks]:
        """Return the marks of submissions in their order; `graded` is called after each."""
        return self._each(
            [partial(self._processes.grade, self._exercise, self._task(each)) for each in submissions], graded
        )

    def write_pages(
        self, rows: Sequence[tuple[Submission, Marks]], folder: MarksFolder, written: Callable[[], object]
    ) -> list[Message]:
        """Write the page of each submission into a folder; return why some cannot be written."""

        def write(submission: Submission, marks: Marks) -> Message | None:
            try:
                with TemporaryDirectory(prefix="visualhfsm-grade-") as made:
                    page = Path(made) / f"{submission.page}.html"
                    self._processes.write_page(self._exercise, self._task(submission), marks, page)
                    for each in (page, page.with_suffix(".md")):
                        folder.write(each.name, each.read_bytes())
            except GradingError:
                raise
            except (VisualHfsmError, OSError) as error:  # it costs this page alone
                return reason(error)
            return None

        found = self._each([partial(write, *row) for row in rows], written)
        return [each for each in found if each is not None]

    def _task(self, submission: Submission) -> Task:
        path = submission.path.absolute()
        return Task(self._exercise.folder.resolve(), path, submission.name, self._language, self._unsafe)

    def _each(self, work: Sequence[Callable[[], R]], done: Callable[[], object]) -> list[R]:
        """Return the results of some work in its order, fewer after a signal to stop."""
        futures = [self._pool.submit(each) for each in work]
        waiting = set(futures)
        try:
            while waiting and not self._stop.is_set():
                ended, waiting = wait(waiting, _POLL_PERIOD, FIRST_COMPLETED)
                for future in ended:
                    future.result()
                    done()
        finally:
            for future in waiting:
                future.cancel()
        return [future.result() for future in futures if future not in waiting]


class _ProgramEnded(Exception):
    """The program that grades has not answered."""

    def __init__(self, what: str, how: str) -> None:
        super().__init__(what, how)
        self.what: Final = what
        """The verdict on the submission, if it is to blame."""
        self.how: Final = how
        """The end of the program, in words."""


class _Processes(TaskProcesses[GradingResult]):
    """A process for each thread, which lasts from submission to submission."""

    def __init__(self) -> None:
        super().__init__(f"{__package__}._worker", GradingResult, "visualhfsm-grade-")

    def grade(self, exercise: Exercise, task: Task) -> Marks:
        """Return the marks of a submission, whatever its document does.

        Raises GradingError, as for a computer that cannot grade any document.
        """
        try:
            return self._grade(exercise, task)
        except _ProgramEnded as ended:
            self._require_computer(exercise, task)
            language = exercise.language(task.language)
            marks = Marks.broken(exercise, task.name, language, f"{ended.what}: {ended.how}")
            with TemporaryDirectory(prefix="visualhfsm-grade-") as folder, suppress(UnreadableSubmission):
                copied = copy_submission(task.submission, Path(folder), exercise.name)
                return msgspec.structs.replace(marks, digest=copied.digest, handed_in=copied.written)
            return marks

    def _require_computer(self, exercise: Exercise, task: Task) -> None:
        """Raise ComputerFailed if a document that does nothing ends the program that grades, too."""
        with TemporaryDirectory(prefix="visualhfsm-grade-") as folder:
            path = Path(folder) / f"{exercise.name}.xml"
            path.write_text(_HARMLESS, "utf-8")
            try:
                self._grade(exercise, replace(task, submission=path))
            except _ProgramEnded as ended:
                judged = any(each.judge for each in exercise.criteria)
                raise ComputerFailed(
                    f"with a document that does nothing, the program that grades: {ended.how}"
                    + judged * "; a judge of the exercise that hangs, or ends its process, does that, too"
                ) from ended

    def _grade(self, exercise: Exercise, task: Task) -> Marks:
        """Return the marks of a submission. Raises _ProgramEnded, and GradingError."""
        patience = sum(plan.runs * plan.patience for plan in exercise.plans.values()) + _MARGIN
        what = how = ""
        for _ in range(_ATTEMPTS):
            try:
                answer = self._ask(task, patience)
            except TooSlowError:  # what its code may take is limited elsewhere
                what, how = "grade it again", f"the computer was too busy to grade it in {patience:g} s"
            except NotReadyError as error:
                if self.closed:
                    raise GradingError(_ENDED) from error
                raise ComputerFailed(f"the program that grades: {error}") from error
            except KilledError as error:
                what, how = "grading it took too much memory, or somebody ended it", str(error)
            except NoAnswerError as error:
                what, how = "reading it ended the program that grades", str(error)
                break
            else:
                if answer.marks is None:
                    raise GradingError(Message.verbatim(answer.refused))
                return answer.marks
            if self.closed:
                raise GradingError(_ENDED)
        raise _ProgramEnded(what, how)

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

    def _ask(self, task: Task, patience: float) -> GradingResult:
        try:
            return self.ask(task, patience)
        except EndedError as error:
            raise GradingError(_ENDED) from error
        except OSError as error:
            raise ComputerFailed(f"it has no folder for temporary files: {error.strerror}") from error
