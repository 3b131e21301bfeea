"""The process that grades submissions: a line with a task, a line with its marks.

It is the teacher's: the code of a submission runs in a `Containment`. But what a stranger wrote is read here,
so that a document that ends the reader costs its own marks and nothing else.
"""

from __future__ import annotations

import base64
import pickle
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec

from codegen.reasons import reason
from visualhfsm._base.errors import MissingPackageError, VisualHfsmError
from visualhfsm._base.line_process import answer_lines
from visualhfsm.trials import TrialsError

from ._errors import ComputerFailed, ComputerTooBusy, GradingError, SandboxUnavailable
from ._exercise import Exercise, read_exercise
from ._grade import Grader
from ._marks import Marks
from ._page import write_page
from ._submissions import UnreadableSubmission, copy_submission

_MOST_MEMORY: Final = 1 << 40
"""Limit of the address space in bytes, of which a simulation takes much and uses little."""


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
    """Those of the page."""


class GradingResult(msgspec.Struct, frozen=True):
    """The marks, or what is wrong with the exercise or this computer."""

    marks: Marks | None = None
    refused: str = ""


class _Worker:
    def __init__(self) -> None:
        self._path: Path | None = None
        self._exercise: Exercise

    def answer(self, line: bytes) -> bytes:
        """Return the answer to a task."""
        task: Task = pickle.loads(base64.b64decode(line))  # noqa: S301 - from the process that started this one
        try:
            if task.exercise != self._path:
                self._exercise = read_exercise(task.exercise)
                self._path = task.exercise
            with tempfile.TemporaryDirectory(prefix="visualhfsm-grade-") as folder:
                answer = self._grade(task, Path(folder))
        except (GradingError, MissingPackageError, SandboxUnavailable, TrialsError) as error:
            answer = GradingResult(refused=str(error))
        except OSError as error:  # of its folders and processes: what is handed in is read with care
            answer = GradingResult(refused=str(ComputerFailed(str(reason(error)))))
        except ImportError as error:  # the code of submissions is imported elsewhere
            answer = GradingResult(
                refused=f"{error}: install it with: pip install 'visualhfsm[sim,trials,vision,web]'"
            )
        return msgspec.json.encode(answer)

    def _grade(self, task: Task, folder: Path) -> GradingResult:
        exercise = self._exercise
        documents = folder / "submission"
        documents.mkdir()
        try:
            document = copy_submission(task.submission, documents, exercise.name)
        except UnreadableSubmission as error:
            language = exercise.language(task.language)
            return GradingResult(Marks.broken(exercise, task.name, language, str(error)))
        grader = Grader(exercise, document, task.language, unsafe=task.unsafe)
        if task.page is None or task.marks is None:
            try:
                return GradingResult(grader.grade(task.name))
            except ComputerTooBusy as error:
                language = exercise.language(task.language)
                return GradingResult(Marks.broken(exercise, task.name, language, f"grade it again: {error}"))
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
    answer_lines(_Worker().answer, _MOST_MEMORY)
