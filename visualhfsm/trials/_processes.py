"""Run tasks in processes: one for each thread of the executor that runs them, here or on a cluster."""

from __future__ import annotations

import base64
import os
import pickle
import threading
from collections.abc import Mapping
from tempfile import TemporaryDirectory
from typing import Final

import msgspec

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._line_process import KilledError, LineProcess, NoAnswerError, TooSlowError
from zenoh_ice import typed

from ._errors import TrialsError
from ._outcomes import Outcome
from ._worker import Answer, Task

_ATTEMPTS: Final = 20
"""How often a trial is run whose process is killed: most probably it is no fault of the trial."""
_DRAW_LIMIT: Final = 60.0
"""Limit in s for drawing the values of a trial without running it."""
_ENVIRONMENT: Final[Mapping[str, str]] = {
    "PYTHONHASHSEED": "0",  # the order of sets
    "OPENBLAS_NUM_THREADS": "1",  # other trials use the other processors
    "OMP_NUM_THREADS": "1",
}


class Processes:
    """The processes of some threads: one each, which lasts from task to task."""

    def __init__(self) -> None:
        self._here = threading.local()
        self._lock = threading.Lock()
        self._all: list[LineProcess] = []
        self._files: TemporaryDirectory[str] | None = None
        """What they unpack and write; they are killed, and remove nothing."""
        self._closed = False

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
        try:
            return msgspec.structs.replace(self._ask(task.without_run, _DRAW_LIMIT), reason=ended)
        except NoAnswerError as error:
            raise TrialsError(
                Message("trial {number} cannot be drawn: {reason}", number=task.number, reason=reason(error))
            ) from error

    def _ask(self, task: Task, patience: float) -> Outcome:
        """Return the outcome of a task, which is asked for again when its process is killed meanwhile."""
        for attempt in range(1, _ATTEMPTS + 1):
            try:
                answer = self._answer(task.without_snapshot, patience)
                if answer.needs_snapshot:
                    answer = self._answer(task, patience)
                break
            except KilledError:
                if attempt == _ATTEMPTS:
                    raise
        if answer.outcome is None:
            raise TrialsError(Message.verbatim(answer.refused))
        return answer.outcome

    def _answer(self, task: Task, patience: float) -> Answer:
        if self._closed:
            raise TrialsError(Message("the trials have been ended"))
        answer = self._process().ask(base64.b64encode(pickle.dumps(task)), patience)
        try:
            return typed.from_json(answer, Answer)
        except msgspec.MsgspecError as error:
            raise NoAnswerError(f"it wrote something else: {error}") from error

    def close(self) -> None:
        """End all processes."""
        with self._lock:
            self._closed = True
            processes = [*self._all]
        for process in processes:
            process.close()
        if self._files is not None:
            self._files.cleanup()

    def _process(self) -> LineProcess:
        process: LineProcess | None = getattr(self._here, "process", None)
        if process is None:
            with self._lock:
                self._files = self._files or TemporaryDirectory(
                    prefix="visualhfsm-trials-", ignore_cleanup_errors=True
                )
                environment = {**_ENVIRONMENT, "TMPDIR": self._files.name}
                process = LineProcess(f"{__package__}._worker", environment)
                self._all.append(process)
            self._here.process = process
        return process


_of_this_process = Processes()


def run_task(task: Task) -> Outcome:
    """Run a task in a process of the thread that calls this: for the workers of a cluster."""
    return _of_this_process.run(task)


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0))
