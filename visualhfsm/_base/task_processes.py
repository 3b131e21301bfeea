"""Run tasks in processes, one for each thread that asks."""

from __future__ import annotations

import base64
import pickle
import threading
from collections.abc import Callable, Mapping
from tempfile import TemporaryDirectory
from typing import Any, Final, Generic, TypeVar

import msgspec

from visualhfsm._base.line_process import LineProcess, NoAnswerError, answer_lines
from zenoh_ice.data import typed

_ENVIRONMENT: Final[Mapping[str, str]] = {
    "PYTHONHASHSEED": "0",  # the order of sets
    "OPENBLAS_NUM_THREADS": "1",  # other tasks use the other processors
    "OMP_NUM_THREADS": "1",
}

_MOST_MEMORY: Final = 1 << 40
"""Limit of the address space of a process in bytes: simulations take much of it and use little."""

Result = TypeVar("Result", bound=msgspec.Struct)


class EndedError(Exception):
    """The processes have been ended."""


class TaskProcesses(Generic[Result]):
    """The processes of some threads: one each, which runs a `module` and lasts from task to task.

    Tasks go there pickled, and answers come back as JSON. The folder of their temporary files begins with
    `prefix`.
    """

    def __init__(self, module: str, answer: type[Result], prefix: str) -> None:
        self._module: Final = module
        self._answer: Final = answer
        self._prefix: Final = prefix
        self._lock = threading.Lock()
        self._of_thread: dict[int, LineProcess] = {}
        """By the number of the thread; one that has ended leaves its process to the next of its number."""
        self._files: TemporaryDirectory[str] | None = None
        """The folder into which they unpack and write: a process that is killed removes nothing."""
        self.closed = False

    def ask(self, task: object, patience: float) -> Result:
        """Return the answer of this thread's process to a task, within `patience` s of being ready.

        Raises NoAnswerError, EndedError, and OSError if there is no folder for temporary files.
        """
        answer = self._process().ask(base64.b64encode(pickle.dumps(task)), patience)
        try:
            return typed.from_json(answer, self._answer)
        except msgspec.MsgspecError as error:
            raise NoAnswerError(f"it wrote something else: {error}") from error

    def close(self) -> None:
        """End all processes."""
        with self._lock:
            self.closed = True
        for process in self._of_thread.values():
            process.close()
        if self._files is not None:
            self._files.cleanup()

    def _process(self) -> LineProcess:
        with self._lock:
            if self.closed:
                raise EndedError
            self._files = self._files or TemporaryDirectory(prefix=self._prefix, ignore_cleanup_errors=True)
            environment = {**_ENVIRONMENT, "TMPDIR": self._files.name}
            return self._of_thread.setdefault(threading.get_ident(), LineProcess(self._module, environment))


def answer_tasks(answer: Callable[[Any], msgspec.Struct]) -> None:
    """Answer the tasks of the `TaskProcesses` that started this process, until it ends."""
    answer_lines(
        lambda line: msgspec.json.encode(answer(pickle.loads(base64.b64decode(line)))),  # noqa: S301 - of ours
        _MOST_MEMORY,
    )
