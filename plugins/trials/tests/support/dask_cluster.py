"""A cluster of Dask on loopback, made of processes as a user starts them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import psutil

from tests.support.limits import START_LIMIT
from tests.support.places import ROOT
from tests.support.ports import free_port
from tests.support.processes import ComponentProcess, assert_gone, module
from tests.support.waiting import until

__all__ = ["DaskCluster"]

_PATIENT: Final = {
    "PYTHONPATH": str(ROOT),
    "DASK_DISTRIBUTED__ADMIN__TICK__LIMIT": "1h",  # a busy machine is no news
    # Pages of HTTP, which nobody reads here, take a third of the time to start.
    "DASK_DISTRIBUTED__SCHEDULER__HTTP__ROUTES": "[]",
    "DASK_DISTRIBUTED__WORKER__HTTP__ROUTES": "[]",
}


class DaskCluster:
    """A scheduler and its workers, each in its own empty folder; leaving the `with` block ends them.

    A task whose worker is killed runs on another one, for so many `failures`.
    """

    def __init__(self, folder: Path, workers: int = 1, threads: int = 1, failures: int = 3) -> None:
        self._folder = folder
        self._threads = threads
        self._first = workers
        self._started = 0
        self._failures = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(failures)}
        self._processes = ExitStack()
        self._scheduler: ComponentProcess | None = None
        self.workers: list[ComponentProcess] = []
        self.address: Final = f"tcp://127.0.0.1:{free_port()}"

    def __enter__(self) -> Self:
        with ExitStack() as started:
            started.push(self._processes)
            self.replenish()
            started.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._processes.__exit__(kind, error, trace)

    @property
    def scheduler(self) -> ComponentProcess:
        """Its scheduler."""
        assert self._scheduler is not None
        return self._scheduler

    def replenish(self) -> None:
        """Start what it had at first and does not run any more: its scheduler, and some of its workers."""
        if self._scheduler is None or self._scheduler.process.poll() is not None:
            for worker in self.workers:
                self.kill(worker)
            self._scheduler = self._start_scheduler()
        self.workers[:] = [worker for worker in self.workers if worker.process.poll() is None]
        for _ in range(self._first - len(self.workers)):
            self.add_worker()
        self.wait()

    def add_worker(self, environment: Mapping[str, str] | None = None) -> ComponentProcess:
        """Start a worker; `environment` is added to its own."""
        name = f"worker{self._started}"
        self._started += 1
        options = ("--host", "127.0.0.1", "--no-dashboard", "--no-nanny", "--nthreads", str(self._threads))
        place = str(self._folder / f"{name}-data")
        worker = self._start(
            name, "worker", self.address, *options, "--local-directory", place, environment=environment
        )
        self.workers.append(worker)
        return worker

    @contextmanager
    def added_worker(self, environment: Mapping[str, str]) -> Iterator[ComponentProcess]:
        """Have one more worker in a `with` block; the scheduler has forgotten it afterwards."""
        worker = self.add_worker(environment)
        try:
            self.wait()
            yield worker
        finally:
            self.workers.remove(worker)
            assert_gone(self.kill(worker))
            found = worker.wait_for(r"Start worker at: +(tcp://\S+)")[1]
            self.scheduler.wait_for(rf"Remove worker .*{found}\b")

    def wait(self) -> None:
        """Wait until all workers that run have found the scheduler."""
        running = [worker for worker in self.workers if worker.process.poll() is None]
        until(lambda: all("Registered to" in worker.output for worker in running), START_LIMIT)

    def kill(self, process: ComponentProcess) -> list[psutil.Process]:
        """Kill a process at once, as a computer that loses its power; return the processes that it had started."""
        if process.process.poll() is not None:
            return []
        below: list[psutil.Process] = psutil.Process(process.process.pid).children(recursive=True)
        process.process.kill()
        process.process.wait()
        return below

    def _start_scheduler(self) -> ComponentProcess:
        port = self.address.rpartition(":")[2]
        options = (
            "--host",
            "127.0.0.1",
            "--port",
            port,
            "--no-dashboard",
            "--dashboard-address",
            "127.0.0.1:0",
        )
        scheduler = self._start("scheduler", "scheduler", *options, environment=self._failures)
        until(lambda: "Scheduler at" in scheduler.output, START_LIMIT)
        return scheduler

    def _start(
        self, name: str, *arguments: str, environment: Mapping[str, str] | None = None
    ) -> ComponentProcess:
        folder = self._folder / name
        folder.mkdir(parents=True, exist_ok=True)
        inherited = environment or {}
        path = os.pathsep.join(each for each in (inherited.get("PYTHONPATH"), str(ROOT)) if each)
        process = ComponentProcess(
            module("dask", *arguments), {**_PATIENT, **inherited, "PYTHONPATH": path}, cwd=folder
        )
        return self._processes.enter_context(process)
