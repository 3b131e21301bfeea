"""The process that runs trials: a line with a task, a line with its outcome.

Documents run here, and nothing else does: a trial that hangs, that takes all memory, or that ends the process
costs itself. The random order of sets is fixed by the environment of the process.
"""

from __future__ import annotations

import gc
import os
import resource
import shutil
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path

import msgspec

from hfsm_runtime.errors import MissingLibraryError
from hfsm_runtime.virtual.errors import ExecutionError
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.task_processes import answer_tasks
from zenoh_ice.application.tether import die_with

from ._archive import INTERFACES, unpack
from ._errors import TrialsError
from ._functions import forget_functions
from ._outcomes import Outcome
from ._processes import Task, TaskResult
from ._trial import draw_values, quiet, run_trial


class _Worker:
    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._digest = ""
        self._here = Path()
        self._warm = False

    def answer(self, task: Task) -> TaskResult:
        """Return the answer to a task."""
        answer = self._run(task)
        self._forget_modules()
        gc.collect()  # a trial leaves cycles behind, and the next one is to have all memory
        if self._digest and not self._warm:
            self._warm = True
            gc.freeze()  # all is imported now
        return answer

    def _run(self, task: Task) -> TaskResult:
        if task.archive.digest != self._digest:
            if not task.archive.content:
                return TaskResult(needs_archive=True)
            if self._digest:
                shutil.rmtree(self._here)
            self._digest = task.archive.digest
            self._here = self._folder / self._digest[:16]
            unpack(task.archive.content, self._here)
        soft = task.plan.memory << 20
        resource.setrlimit(resource.RLIMIT_DATA, (soft, resource.getrlimit(resource.RLIMIT_DATA)[1]))
        plan = msgspec.structs.replace(task.plan, document=str(self._here / task.archive.document))
        try:
            if not task.runs:
                return TaskResult(
                    Outcome(number=task.number, values=draw_values(plan, task.number), success=False)
                )
            if task.part is not None:
                task.part.unlink(missing_ok=True)  # of an attempt whose process was killed
            with quiet() if task.quiet else nullcontext():
                outcome = run_trial(plan, task.number, task.part)
            if task.part is not None:
                _keep(task.part, Path(task.recording))
        except (VisualHfsmError, ExecutionError, MissingLibraryError) as error:
            return TaskResult(refused=self._plain(str(error)))
        return TaskResult(
            msgspec.structs.replace(
                outcome, reason=self._plain(outcome.reason), error=self._plain(outcome.error)
            )
        )

    def _forget_modules(self) -> None:
        """Forget the modules beside the document: their variables must not last from trial to trial."""
        forget_functions()
        beside = f"{self._here}/"
        for name, module in [*sys.modules.items()]:
            file = getattr(module, "__file__", None) or ""
            if file.startswith(beside) and name.partition(".")[0] != INTERFACES:
                del sys.modules[name]

    def _plain(self, text: str) -> str:
        """Return a text without the path of the archive, which differs from process to process."""
        return text.replace(f"{self._here}/", "")


def _keep(part: Path, recording: Path) -> None:
    with TrialsError.in_place_of(
        OSError, "{target}: the recording cannot be kept: {reason}", target=str(recording)
    ):
        part.replace(recording)


if __name__ == "__main__":
    die_with(os.getppid())  # a trial that hangs would not notice that nobody waits for it
    with tempfile.TemporaryDirectory(prefix="visualhfsm-trials-") as folder:
        answer_tasks(_Worker(Path(folder).resolve()).answer)
