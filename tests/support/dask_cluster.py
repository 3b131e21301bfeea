"""A cluster of Dask on loopback, made of processes as a user starts them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import psutil

from tests.support.limits import START_LIMIT
from tests.support.places import ROOT
from tests.support.ports import free_port
from tests.support.processes import ComponentProcess, module
from tests.support.waiting import until

__all__ = ["DaskCluster"]

_PATIENT: Final = {
    "PYTHONPATH": str(ROOT),
    "DASK_DISTRIBUTED__ADMIN__TICK__LIMIT": "1h",  # a busy machine is no news
}


class DaskCluster:
    """A scheduler and its workers, each in its own empty folder; leaving the `with` block ends them.

    A task whose worker is killed runs on another one, for so many `failures`.
    """

    def __init__(self, folder: Path, workers: int = 1, threads: int = 1, failures: int = 3) -> None:
        self._folder = folder
        self._threads = threads
        self._first = workers
        self._failures = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(failures)}
        self._processes = ExitStack()
        self.workers: list[ComponentProcess] = []
        self.address: Final = f"tcp://127.0.0.1:{free_port()}"

    def __enter__(self) -> Self:
        with ExitStack() as started:
            started.push(self._processes)
            port = self.address.rpartition(":")[2]
            options = ("--host", "127.0.0.1", "--port", port, "--no-dashboard")
            self.scheduler = self._start("scheduler", "scheduler", *options, environment=self._failures)
            until(lambda: "Scheduler at" in self.scheduler.output, START_LIMIT)
            for _ in range(self._first):
                self.add_worker()
            self.wait()
            started.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._processes.__exit__(kind, error, trace)

    def add_worker(self, environment: Mapping[str, str] | None = None) -> ComponentProcess:
        """Start a worker; `environment` is added to its own."""
        name = f"worker{len(self.workers)}"
        options = ("--host", "127.0.0.1", "--no-dashboard", "--no-nanny", "--nthreads", str(self._threads))
        place = str(self._folder / f"{name}-data")
        worker = self._start(
            name, "worker", self.address, *options, "--local-directory", place, environment=environment
        )
        self.workers.append(worker)
        return worker

    def wait(self) -> None:
        """Wait until all workers that run have found the scheduler."""
        running = [worker for worker in self.workers if worker.process.poll() is None]
        until(lambda: all("Registered to" in worker.output for worker in running), START_LIMIT)

    def kill(self, process: ComponentProcess) -> list[psutil.Process]:
        """Kill a process at once, as a computer that loses its power; return the processes that it had started."""
        below: list[psutil.Process] = psutil.Process(process.process.pid).children(recursive=True)
        process.process.kill()
        process.process.wait()
        return below

    def _start(
        self, name: str, *arguments: str, environment: Mapping[str, str] | None = None
    ) -> ComponentProcess:
        folder = self._folder / name
        folder.mkdir(parents=True)
        inherited = environment or {}
        path = os.pathsep.join(each for each in (inherited.get("PYTHONPATH"), str(ROOT)) if each)
        process = ComponentProcess(
            module("dask", *arguments), {**_PATIENT, **inherited, "PYTHONPATH": path}, cwd=folder
        )
        return self._processes.enter_context(process)
