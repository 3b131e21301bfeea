"""Run the trials of a plan, keep what they came to in a file, and say what that says."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec

from visualhfsm.trials import LocalPool, Outcome, Plan, Pool, Series, Task, run_tasks, versions

from ._cluster import Cluster
from ._record import Header, Record
from ._summary import Summary, summarize


class KeptSeries(Series):
    """The trials of a plan, and the file in which their outcomes are kept."""

    @property
    def header(self) -> Header:
        """What the outcomes are of."""
        described = msgspec.structs.replace(self.plan, document="", runs=1)
        text = msgspec.json.encode(msgspec.to_builtins(described), order="deterministic")
        digest = hashlib.sha256(text + self.archive.digest.encode()).hexdigest()
        return Header(Path(self.plan.document).name, digest, versions(), first=1)

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
    series = KeptSeries(plan)
    with TemporaryDirectory() as folder:
        file = out or Path(folder) / "outcomes.jsonl"
        with Record(file, series.header) as record, open_pool(workers, cluster) as pool:
            series.run(record, pool, ended)
        return summarize(file, plan.varying, plan.runs)


@contextmanager
def open_pool(workers: int | None = None, cluster: str | None = None) -> Iterator[Pool[Outcome]]:
    """Yield the cluster at an address, or else processes of this computer."""
    with Cluster(cluster) if cluster else LocalPool(workers) as pool:
        yield pool
