"""The process that grades submissions: a line with a task, a line with its marks.

It is the teacher's: the code of a submission runs in a `Containment`. But what a stranger wrote is read here,
so that a document that ends the reader costs its own marks and nothing else.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import msgspec
from msgspec.structs import replace

from codegen.reasons import reason
from visualhfsm import VisualHfsmError
from visualhfsm.plugins import MissingPackageError, answer_tasks
from visualhfsm.trials import TrialsError
from visualhfsm_classes._errors import ComputerFailed, ComputerTooBusy, GradingError, SandboxUnavailable
from visualhfsm_classes._exercise import Exercise, read_exercise
from visualhfsm_classes._grade import Grader
from visualhfsm_classes._marks import Marks
from visualhfsm_classes._page import write_page
from visualhfsm_classes._submissions import UnreadableSubmission, copy_submission


@dataclass(frozen=True, slots=True)
class Task:
    """A submission to grade, or to write the page of."""

    exercise: Path
    submission: Path
    name: str
    language: str
    unsafe: bool
    page: Path | None = None
    marks: Marks | None = None
    """The marks of the page."""


class GradingResult(msgspec.Struct, frozen=True):
    """The marks, or what is wrong with the exercise or this computer."""

    marks: Marks | None = None
    refused: str = ""


class _Worker:
    def __init__(self) -> None:
        self._path: Path | None = None
        self._exercise: Exercise

    def answer(self, task: Task) -> GradingResult:
        """Return the answer to a task."""
        try:
            if task.exercise != self._path:
                self._exercise = read_exercise(task.exercise)
                self._path = task.exercise
            with tempfile.TemporaryDirectory(prefix="visualhfsm-grade-") as folder:
                return self._grade(task, Path(folder))
        except (GradingError, MissingPackageError, SandboxUnavailable, TrialsError) as error:
            return GradingResult(refused=str(error))
        except OSError as error:  # of its folders and processes: what is handed in is read with care
            return GradingResult(refused=str(ComputerFailed(str(reason(error)))))
        except ImportError as error:  # the code of submissions is imported elsewhere
            return GradingResult(
                refused=f"{error}: install it with: pip install 'visualhfsm[sim,trials,vision,web]'"
            )

    def _grade(self, task: Task, folder: Path) -> GradingResult:
        exercise = self._exercise
        documents = folder / "submission"
        documents.mkdir()
        try:
            copied = copy_submission(task.submission, documents, exercise.name)
        except UnreadableSubmission as error:
            language = exercise.language(task.language)
            return GradingResult(Marks.broken(exercise, task.name, language, str(error)))
        grader = Grader(exercise, copied.document, task.language, unsafe=task.unsafe)
        if task.page is None or task.marks is None:
            try:
                marks = grader.grade(task.name)
            except ComputerTooBusy as error:
                language = exercise.language(task.language)
                marks = Marks.broken(exercise, task.name, language, f"grade it again: {error}")
            return GradingResult(replace(marks, digest=copied.digest, handed_in=copied.written))
        recording = folder / "worst.mcap"
        try:
            grader.record(task.marks, recording)
            write_page(task.page, exercise, task.marks, recording)
        except MissingPackageError:
            raise
        except VisualHfsmError:  # a run that is too long, or that has no state
            write_page(task.page, exercise, task.marks)
        return GradingResult(task.marks)


if __name__ == "__main__":
    answer_tasks(_Worker().answer)
