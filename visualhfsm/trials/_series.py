"""Run the trials of a plan: in processes of this computer, or on a cluster of Dask."""

from __future__ import annotations

import hashlib
import platform
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Protocol

import msgspec

from ._errors import TrialsError
from ._outcome import Outcome
from ._plan import Plan
from ._processes import Processes, processors, run_task
from ._record import Header, Record
from ._snapshot import Snapshot, take_snapshot
from ._summary import Summary, summarize
from ._worker import Task

_PACKAGES: Final = ("visualhfsm", "mujoco", "numpy")
"""What computes the outcome of a trial, besides Python."""
_AHEAD: Final = 3
"""Tasks for each worker that an executor has at a time: so that none waits, and memory stays small."""


_LOOK_AFTER: Final = 0.2
"""After so many s a series looks whether it is to stop."""


class Pool(Protocol):
    """Where trials run."""

    @property
    def workers(self) -> int:
        """How many trials run at a time."""

    def submit(self, task: Task) -> Future[Outcome]:
        """Begin to run a task, as soon as a worker has time."""


class LocalPool:
    """Processes of this computer: by default as many as it has processors. A context that ends them."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers: Final = workers or processors()
        self._processes = Processes()
        self._threads = ThreadPoolExecutor(self.workers, "trials")

    def __enter__(self) -> LocalPool:
        return self

    def __exit__(self, *_: object) -> None:
        self._processes.close()
        self._threads.shutdown(cancel_futures=True)

    def submit(self, task: Task) -> Future[Outcome]:
        """Begin to run a task, as soon as a process has time."""
        return self._threads.submit(self._processes.run, task)


class Cluster:
    """A cluster of Dask by its address, such as tcp://HOST:8786. A context that leaves it.

    Raises TrialsError when it cannot be reached, has no workers, or has other versions than this computer.
    """

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client  # needs the package Dask
        except ModuleNotFoundError as error:
            raise TrialsError(
                "a cluster needs the package distributed: pip install 'visualhfsm[cluster]'"
            ) from error
        try:
            self._client: Any = Client(address, timeout=_CONNECT_LIMIT, set_as_default=False)
        except (OSError, ValueError) as error:
            raise TrialsError(f"the cluster at {address} cannot be reached: {error}") from error
        try:
            self.workers: Final = self._count(address)
            self._executor: Executor = self._client.get_executor(pure=False, retries=_RETRIES)
        except BaseException:
            self._client.close()
            raise

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def submit(self, task: Task) -> Future[Outcome]:
        """Begin to run a task, as soon as a worker has time."""
        return self._executor.submit(run_task, task)

    def _count(self, address: str) -> int:
        found: dict[str, dict[str, str]] = self._client.run(versions)
        if not found:
            raise TrialsError(
                f"the cluster at {address} has no workers: start some with `dask worker {address}`"
            )
        here = versions()
        for worker, theirs in found.items():
            different = [
                f"{name} {theirs.get(name, 'is missing')}" for name in here if theirs.get(name) != here[name]
            ]
            if different:
                mine = ", ".join(f"{name} {here[name]}" for name in here)
                raise TrialsError(f"the worker {worker} has {', '.join(different)}; here are {mine}")
        return sum(self._client.nthreads().values())


_CONNECT_LIMIT: Final = 10.0
_RETRIES: Final = 3
"""How often Dask runs a task again whose worker is lost."""


class Series:
    """The trials of a plan, and the file in which their outcomes are kept."""

    def __init__(self, plan: Plan) -> None:
        self.plan: Final = plan
        self.snapshot: Final[Snapshot] = take_snapshot(Path(plan.document))

    @property
    def header(self) -> Header:
        """What the outcomes are of."""
        described = msgspec.structs.replace(self.plan, document="", runs=1)
        text = msgspec.json.encode(msgspec.to_builtins(described), order="deterministic")
        digest = hashlib.sha256(text + self.snapshot.digest.encode()).hexdigest()
        return Header(Path(self.plan.document).name, digest, versions())

    def outcomes(
        self, numbers: Iterable[int], pool: Pool, stop: threading.Event | None = None
    ) -> Iterator[Outcome]:
        """Yield the outcomes of some trials as they end, until `stop` is set. Raises TrialsError."""
        tasks = ((number, Task(self.plan, number, self.snapshot)) for number in numbers)
        for _, outcome in run_tasks(tasks, pool, stop):
            yield outcome

    def run(
        self,
        record: Record,
        pool: Pool,
        ended: Callable[[Outcome], object] = lambda _: None,
        stop: threading.Event | None = None,
    ) -> None:
        """Run all trials that a file does not have yet, until `stop` is set.

        `ended` is called with each outcome once it is kept. Raises TrialsError; what has ended until then is
        kept.
        """
        missing = (number for number in range(self.plan.runs) if number not in record.done)
        for outcome in self.outcomes(missing, pool, stop):
            record.add(outcome)
            ended(outcome)


def run_tasks(
    tasks: Iterable[tuple[int, Task]], pool: Pool, stop: threading.Event | None = None
) -> Iterator[tuple[int, Outcome]]:
    """Yield the outcomes of tasks as they end, each with the number beside its task, until `stop` is set.

    Raises TrialsError.
    """
    left = iter(tasks)
    running: dict[Future[Outcome], int] = {}
    try:
        while stop is None or not stop.is_set():
            for number, task in islice(left, pool.workers * _AHEAD - len(running)):
                running[pool.submit(task)] = number
            if not running:
                return
            for future in wait(running, _LOOK_AFTER, FIRST_COMPLETED).done:
                yield running.pop(future), future.result()
    finally:
        for future in running:
            future.cancel()


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
    others are computed by `workers` processes of this computer, or by the `cluster` of Dask at an address.
    `ended` is called with each outcome.
    """
    series = Series(plan)
    with TemporaryDirectory() as folder:
        file = out or Path(folder) / "outcomes.jsonl"
        with Record(file, series.header) as record, open_pool(workers, cluster) as pool:
            series.run(record, pool, ended)
        return summarize(file, plan.varying, plan.runs)


def versions() -> dict[str, str]:
    """Return the versions of what computes the outcome of a trial, in this process."""
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}


@contextmanager
def open_pool(workers: int | None = None, cluster: str | None = None) -> Iterator[Pool]:
    """Yield the cluster at an address, or else processes of this computer."""
    with Cluster(cluster) if cluster else LocalPool(workers) as pool:
        yield pool
