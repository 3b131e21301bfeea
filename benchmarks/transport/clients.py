"""Sixteen clients that call one server without pauses."""

from __future__ import annotations

import statistics
import time
from functools import partial
from pathlib import Path
from typing import Final

from .figures import Effort, Figure, Section, Table, milliseconds, percentile, spread
from .processes import Lab, Worker
from .rounds import interleaved

CLIENTS: Final = 16
FAIR: Final = 0.5
P99: Final = 10e-3

_SECONDS: Final = 4.0


def measure(package: Path, effort: Effort) -> Section:
    """Measure how fairly calls are distributed among clients, each in a process."""
    seconds = effort.seconds(_SECONDS)
    with Lab(package) as lab:
        workers = {kind: lab.pair(kind, CLIENTS)[1] for kind in ("ours", "ice")}
        results = interleaved(
            {kind: partial(_together, each, seconds) for kind, each in workers.items()}, effort.rounds(8)
        )
    rows = []
    for kind, name in (("ours", "generated proxies"), ("ice", "Ice")):
        times = [time for clients in results[kind] for each in clients for time in each]
        rates = [sum(map(len, clients)) / seconds for clients in results[kind]]
        rows.append(
            [
                name,
                str(spread(rates)),
                milliseconds(statistics.median(times)),
                milliseconds(percentile(times, 0.99)),
                milliseconds(max(times)),
                f"{min(map(_slowest, results[kind])):.2f}",
            ]
        )
    slowest = min(map(_slowest, results["ours"]))
    p99 = percentile([time for clients in results["ours"] for each in clients for time in each], 0.99)
    return Section(
        "clients",
        figures=[
            Figure(
                f"{CLIENTS} clients calling one server: the slowest",
                f"at least {FAIR} of the mean",
                f"{slowest:.2f} of the mean in the worst round",
                slowest >= FAIR,
            ),
            Figure(
                f"{CLIENTS} clients calling one server: p99",
                f"under {P99 * 1e3:.0f} ms",
                f"{milliseconds(p99)} ms",
                p99 < P99,
            ),
        ],
        tables=[
            Table(
                f"{CLIENTS} clients, {seconds:g} s a round",
                ["", "calls a second", "p50 ms", "p99 ms", "longest ms", "slowest of mean, worst round"],
                rows,
            )
        ],
        plot={
            kind: [
                sum(len(clients[number]) for clients in rounds) / (seconds * len(rounds))
                for number in range(CLIENTS)
            ]
            for kind, rounds in results.items()
        },
    )


def _together(workers: list[Worker], seconds: float) -> list[list[float]]:
    """Start all clients at one time; return their times."""
    at = time.monotonic() + 1.0
    for worker in workers:
        worker.start("call", operation="step", seconds=seconds, at=at)
    return [worker.finish() for worker in workers]


def _slowest(clients: list[list[float]]) -> float:
    """Return the smallest number of calls of a client, as a share of the mean."""
    counts = [len(each) for each in clients]
    return min(counts) / statistics.mean(counts)
