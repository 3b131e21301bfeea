"""Run several trials, or other work: in processes of this computer, or where a plug-in runs them."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from pathlib import Path
from typing import Any, Final, Generic, NamedTuple, Protocol, Self

from codegen.reasons import reason

from ._archive import Archive, make_archive
from ._errors import TrialsError
from ._outcomes import Outcome
from ._plan import Plan
from ._processes import Processes, Task, processors
from ._runners import Pool, R, R_co, Work
from ._scene import check_scene

_AHEAD: Final = 3
"""Tasks for each worker that an executor has at a time: so that none waits, and memory stays small."""
_LOOK_AFTER: Final = 0.2
"""After so many s a series looks whether it is to stop."""
_ATTEMPTS: Final = 20
"""The most submissions of a task whose workers are lost, one after the other."""


class Runs(Protocol[R_co]):
    """Processes that run work of a kind."""

    def run(self, task: Any) -> R_co:  # noqa: ANN401 - of that kind
        """Run it in the process of this thread."""

    def close(self) -> None:
        """End them."""


class ProcessPool(Generic[R]):
    """Processes of this computer: by default as many as it has processors. A context that ends them."""

    lost: Final = ()

    def __init__(self, processes: Runs[R], workers: int | None = None) -> None:
        self.workers: Final = workers or processors()
        self._processes: Final = processes
        self._threads = ThreadPoolExecutor(self.workers, "trials")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._processes.close()
        self._threads.shutdown(cancel_futures=True)

    def submit(self, task: Work[R]) -> Future[R]:
        """Begin to run a task, as soon as a process has time."""
        return self._threads.submit(self._processes.run, task)

    def check(self) -> None:
        """Do nothing: processes are started again."""


class LocalPool(ProcessPool[Outcome]):
    """Processes of this computer that run trials."""

    def __init__(self, workers: int | None = None) -> None:
        super().__init__(Processes(), workers)


class Series:
    """The trials of a plan."""

    def __init__(self, plan: Plan, content: bytes | None = None) -> None:
        """Take what is to run as it is now; `content` is that of the document if it is not saved.

        Raises TrialsError.
        """
        plan.check_names()
        check_scene(plan)
        self.plan: Final = plan
        self.archive: Final[Archive] = make_archive(Path(plan.document), content, plan.others)

    def outcomes(
        self, numbers: Iterable[int], pool: Pool[Outcome], stop: threading.Event | None = None
    ) -> Iterator[Outcome]:
        """Yield the outcomes of some trials as they end, until `stop` is set. Raises TrialsError."""
        tasks = ((number, Task(self.plan, number, self.archive)) for number in numbers)
        for _, outcome in run_tasks(tasks, pool, stop):
            yield outcome


def run_tasks(
    tasks: Iterable[tuple[int, Work[R]]], pool: Pool[R], stop: threading.Event | None = None
) -> Iterator[tuple[int, R]]:
    """Yield the outcomes of tasks as they end, each with the number beside its task, until `stop` is set.

    Raises TrialsError.
    """
    left = iter(tasks)
    running: dict[Future[R], _Submitted] = {}
    try:
        while stop is None or not stop.is_set():
            for number, task in islice(left, pool.workers * _AHEAD - len(running)):
                running[pool.submit(task)] = _Submitted(number, task, 1)
            if not running:
                return
            for future in wait(running, _LOOK_AFTER, FIRST_COMPLETED).done:
                number, task, attempt = running.pop(future)
                try:
                    outcome = future.result()
                except pool.lost as error:
                    if attempt == _ATTEMPTS:
                        raise TrialsError.because(
                            "trial {number} lost its worker {attempt} times: {reason}",
                            number=number,
                            attempt=attempt,
                            reason=reason(error),
                        ) from error
                    running[pool.submit(task)] = _Submitted(number, task, attempt + 1)
                else:
                    yield number, outcome
            pool.check()
    finally:
        for future in running:
            future.cancel()


class _Submitted(NamedTuple):
    number: int
    task: Work[Any]
    attempt: int
