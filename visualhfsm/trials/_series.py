"""Run the trials of a plan: in processes of this computer, or where a plug-in runs them."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Generic, NamedTuple, Protocol, Self

import msgspec

from codegen.reasons import reason

from ._archive import Archive, make_archive
from ._errors import TrialsError
from ._outcomes import Header, Outcome, Record, versions
from ._plan import Plan
from ._processes import Processes, Task, processors
from ._runners import Pool, R, R_co, Work, find_runner
from ._scene import check_scene
from ._summary import Summary, summarize

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
    """The trials of a plan, and the file in which their outcomes are kept."""

    def __init__(self, plan: Plan, content: bytes | None = None) -> None:
        """Take what is to run as it is now; `content` is that of the document if it is not saved.

        Raises TrialsError.
        """
        plan.check_names()
        check_scene(plan)
        self.plan: Final = plan
        self.archive: Final[Archive] = make_archive(Path(plan.document), content, plan.others)

    @property
    def header(self) -> Header:
        """What the outcomes are of."""
        described = msgspec.structs.replace(self.plan, document="", runs=1)
        text = msgspec.json.encode(msgspec.to_builtins(described), order="deterministic")
        digest = hashlib.sha256(text + self.archive.digest.encode()).hexdigest()
        return Header(Path(self.plan.document).name, digest, versions(), first=1)

    def outcomes(
        self, numbers: Iterable[int], pool: Pool[Outcome], stop: threading.Event | None = None
    ) -> Iterator[Outcome]:
        """Yield the outcomes of some trials as they end, until `stop` is set. Raises TrialsError."""
        tasks = ((number, Task(self.plan, number, self.archive)) for number in numbers)
        for _, outcome in run_tasks(tasks, pool, stop):
            yield outcome

    def run(
        self,
        record: Record,
        pool: Pool[Outcome],
        ended: Callable[[Outcome], object] = lambda _: None,
        stop: threading.Event | None = None,
    ) -> None:
        """Run all trials that a file does not have yet, until `stop` is set.

        `ended` is called with each outcome once it is kept. Raises TrialsError; what has ended until then is
        kept.
        """
        record.look(self.plan.runs)
        missing = (number for number in self.plan.trials if number not in record.done)
        for outcome in self.outcomes(missing, pool, stop):
            record.add(outcome)
            ended(outcome)

    def record(
        self, recordings: Mapping[int, Path], workers: int | None = None, stop: threading.Event | None = None
    ) -> None:
        """Run trials again, each recorded in a file; one that does not come to its end has none.

        Raises TrialsError.
        """
        tasks = [
            Task(self.plan, number, self.archive, recording=str(path.absolute()))
            for number, path in recordings.items()
        ]
        try:
            with LocalPool(workers) as pool:
                for _ in run_tasks([(task.number, task) for task in tasks], pool, stop):
                    pass
        finally:
            for task in tasks:
                if task.part is not None:
                    task.part.unlink(missing_ok=True)

    def show(self, number: int, recording: Path | None = None) -> Outcome:
        """Run one trial, perhaps recorded in a file; what it prints and logs is seen. Raises TrialsError."""
        into = "" if recording is None else str(recording.absolute())
        task = Task(self.plan, number, self.archive, recording=into, quiet=False)
        if recording is not None:
            recording.unlink(missing_ok=True)
        try:
            with LocalPool(1) as pool:
                return pool.submit(task).result()
        finally:
            if task.part is not None:
                task.part.unlink(missing_ok=True)


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


def run_trials(
    plan: Plan,
    *,
    out: Path | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    ended: Callable[[Outcome], object] = lambda _: None,
) -> Summary:
    """Run the trials of a plan, and return what they say. Raises TrialsError.

    With `out`, a file, outcomes are kept there, and those that it has already are not computed again. The
    others are computed by `workers` processes of this computer, or by the `cluster` at an address.
    `ended` is called with each outcome.
    """
    series = Series(plan)
    with TemporaryDirectory() as folder:
        file = out or Path(folder) / "outcomes.jsonl"
        with Record(file, series.header) as record, open_pool(workers, cluster) as pool:
            series.run(record, pool, ended)
        return summarize(file, plan.varying, plan.runs)


@contextmanager
def open_pool(workers: int | None = None, cluster: str | None = None) -> Iterator[Pool[Outcome]]:
    """Yield the cluster at an address, or else processes of this computer."""
    with find_runner(cluster) if cluster else LocalPool(workers) as pool:
        yield pool
