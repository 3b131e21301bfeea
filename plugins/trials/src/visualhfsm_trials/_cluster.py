"""Run trials on a cluster of Dask."""

from __future__ import annotations

import asyncio
import logging
import time
import warnings
from collections.abc import Mapping
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm import VisualHfsmError
from visualhfsm.trials import Archive, TrialsError, Work, versions

R = TypeVar("R")


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterLimits:
    """How long a cluster may be silent, in s."""

    connect: float = 10.0
    """For the scheduler to be reached."""
    answer: float = 10.0
    """For the scheduler to say which workers there are."""
    look: float = 15.0
    """In which a cluster is reached and all of its workers report their versions."""
    close: float = 5.0
    """For the scheduler to hear that this client has gone."""
    check: float = 5.0
    """Between two looks at the cluster."""
    no_worker: float = 60.0
    """Without any worker, after which nobody waits for one to come back."""
    start: float = 120.0
    """Beside a trial's patience, in which one of those that run must end: workers start processes in it."""


class Cluster:
    """A cluster of Dask by its address, such as tcp://HOST:8786. A context that leaves it.

    Raises TrialsError when it cannot be reached, has no workers, or has other versions than this computer.
    """

    def __init__(self, address: str, limits: ClusterLimits = ClusterLimits()) -> None:
        with TrialsError.in_place_of(
            ModuleNotFoundError, "a cluster needs the package distributed: pip install 'visualhfsm[cluster]'"
        ):
            from distributed import Client, KilledWorker  # needs the package Dask
            from distributed.comm import CommClosedError
        self._address = address
        self._limits: Final = limits
        self.lost: Final[tuple[type[BaseException], ...]] = (KilledWorker,)
        self._broken: Final[tuple[type[OSError], ...]] = (ConnectionError, CommClosedError)
        with warnings.catch_warnings(action="ignore"):  # other versions that matter are refused
            found, self.workers = _look_at(address, limits)
            _compare_versions(address, found)
            with TrialsError.in_place_of(
                (OSError, ValueError), "the cluster at {address} cannot be reached: {reason}", address=address
            ):
                self._client: Any = Client(address, timeout=limits.connect, set_as_default=False)
        self._levels = {log: log.level for log in _logs()}
        for log in self._levels:
            log.setLevel(logging.CRITICAL)  # each of its errors is raised here, too, and says it in a line
        self._sent: dict[str, Any] = {}
        self._looked = self._seen = self._moved = time.monotonic()
        self._patience = 0.0
        """s that a trial may take, of the tasks that were submitted."""

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(TimeoutError):  # a scheduler that hangs is left alone
            self._client.close(self._limits.close)
        for log, level in self._levels.items():
            log.setLevel(level)

    def submit(self, task: Work[R]) -> Future[R]:
        """Begin to run a task, as soon as a worker has time."""
        self._patience = task.patience
        self._note_move()
        light = task.with_archive(task.archive.without_content)
        there = self._client.submit(_run, light, self._send(task.archive), pure=False)
        loop = self._client.loop.asyncio_loop
        here: Future[R] = asyncio.run_coroutine_threadsafe(self._receive(there, task.number), loop)
        here.add_done_callback(self._note_move)
        return here

    async def _receive(self, there: Any, number: int) -> Any:  # noqa: ANN401 - a future of Dask
        """Return the outcome of a task when it has ended.

        The futures of Dask's own executor never end when this fails, as for an outcome that was lost with its
        worker, and cannot be computed again.
        """
        try:
            outcome = await there  # `gather` that is cancelled leaves errors that are printed later
        except VisualHfsmError:
            raise
        except CancelledError as error:
            if self._client.status != "running":
                raise self._gone() from error
            raise TrialsError.because(
                "the cluster has lost its trials: its scheduler was started again. What is done is kept, and "
                "the same command goes on"
            ) from error
        except self.lost:
            raise
        except OSError as error:
            raise self._silent(error) from error
        except Exception as error:
            raise TrialsError.because(
                "the cluster at {address} does not give the outcome of trial {number}: {reason}. What is "
                "done is kept, and the same command goes on, with any cluster or without",
                address=self._address,
                number=number,
                reason=reason(error),
            ) from error
        else:
            return outcome
        finally:
            there.release()  # it is not run any more if nobody waits

    def _note_move(self, *_: object) -> None:
        self._moved = time.monotonic()

    def check(self) -> None:
        """Raise TrialsError when the scheduler, or every worker, has been lost, or no trial ends any more."""
        if self._client.status != "running":
            raise self._gone()
        now = time.monotonic()
        if now - self._looked < self._limits.check:
            return
        self._looked = now
        if self._count():
            self._seen = now
        elif now - self._seen > self._limits.no_worker:
            raise self._left(Message("it has had no worker for {limit:g} s", limit=self._limits.no_worker))
        limit = self._patience + self._limits.start
        if now - self._moved > limit:
            raise self._left(Message("none of its trials has ended for {limit:g} s", limit=limit))

    def _gone(self) -> TrialsError:
        return self._left(Message("its scheduler does not answer any more"))

    def _silent(self, error: OSError) -> TrialsError:
        # Dask may note it in the client's status later, or only there: then the question takes too long.
        if isinstance(error, self._broken) or self._client.status != "running":
            return self._gone()
        return self._left(Message("its scheduler does not answer: {reason}", reason=reason(error)))

    def _left(self, why: Message) -> TrialsError:
        return TrialsError.because(
            "the cluster at {address} is lost: {why}. What is done is kept, and the same command "
            "goes on, with any cluster or without",
            address=self._address,
            why=why,
        )

    def _send(self, archive: Archive) -> Any:  # noqa: ANN401 - a future of Dask
        """Return the archive on the cluster: it is sent once, and computed again where it is lost."""
        sent = self._sent.get(archive.digest)
        if sent is None or sent.status == "error":  # its workers were killed
            sent = self._sent[archive.digest] = self._client.submit(_hold, archive, pure=False)
        return sent

    def _count(self) -> int:
        """Return how many workers there are now."""
        try:
            seen = self._client.sync(self._client.scheduler.identity, callback_timeout=self._limits.answer)
        except OSError as error:  # also when it takes too long
            raise self._silent(error) from error
        return len(seen["workers"])


def _logs() -> list[logging.Logger]:
    """Return the logs of Dask that have their own level, by which those below them go."""
    names = [*logging.root.manager.loggerDict]
    found = [logging.getLogger(name) for name in names if name.partition(".")[0] == "distributed"]
    return [log for log in found if log.level != logging.NOTSET]


def _look_at(address: str, limits: ClusterLimits) -> tuple[dict[str, object], int]:
    """Return the versions of each worker, or the error instead, and the number of all threads.

    Raises TrialsError. Nothing of a client is left behind that could not connect.
    """
    from distributed import Client

    async def look() -> tuple[dict[str, object], int]:
        client: Any = Client(address, timeout=limits.connect, set_as_default=False, asynchronous=True)
        try:
            await client
            seen = await client.scheduler.identity()
            threads = sum(each["nthreads"] for each in seen["workers"].values())
            return await client.run(versions, on_error="return"), threads
        finally:
            await client.close(limits.close)

    try:
        with ThreadPoolExecutor(1, "cluster") as aside:  # notebooks have an event loop in this thread
            return aside.submit(asyncio.run, asyncio.wait_for(look(), limits.look)).result()
    except TimeoutError as error:
        raise TrialsError.because(
            "the cluster at {address} cannot be reached: not all of it answers within {look_limit:g} s",
            address=address,
            look_limit=limits.look,
        ) from error
    except (OSError, ValueError) as error:
        raise TrialsError.because(
            "the cluster at {address} cannot be reached: {reason}", address=address, reason=reason(error)
        ) from error


def _compare_versions(address: str, found: Mapping[str, object]) -> None:
    found = {
        worker: theirs for worker, theirs in found.items() if not isinstance(theirs, OSError)
    }  # it ended
    if not found:
        raise TrialsError.because(
            "the cluster at {address} has no workers: start some, with `dask worker {address}`",
            address=address,
        )
    here = versions()
    for worker, theirs in found.items():
        if not isinstance(theirs, dict):
            raise TrialsError.because(
                "the worker {worker} cannot run trials, install visualhfsm there: {theirs!r}",
                worker=worker,
                theirs=str(theirs),
            )
        different = [
            f"{name} {theirs.get(name, 'is missing')}" for name in here if theirs.get(name) != here[name]
        ]
        if different:
            mine = ", ".join(f"{name} {here[name]}" for name in here)
            raise TrialsError.because(
                "the worker {worker} has {different}; here are {mine}",
                worker=worker,
                different=", ".join(different),
                mine=mine,
            )


def _hold(archive: Archive) -> Archive:
    return archive


def _run(task: Work[R], archive: Archive) -> R:
    return task.with_archive(archive).run()
