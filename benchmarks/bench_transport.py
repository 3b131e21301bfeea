"""Measure calls and streams beside Ice: small calls, calls in flight, images, and a stream of them.

Servers and clients are separate processes on loopback; those of Ice and ours alternate in rounds of random
order, and the first round is not counted. A figure is the median of the rounds, with the quartiles in
parentheses. benchmarks/results/transport.md has the results.

    python benchmarks/bench_transport.py [--quick]

Ice comes with `pip install -e '.[bench]'`.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import os
import platform
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final, TypeVar

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.transport.peers import LARGE_IMAGE, SMALL_IMAGE, generate
from benchmarks.transport.workers import Worker
from tests.support.processes import ComponentProcess, free_endpoint, module

T = TypeVar("T")

KINDS: Final = {"ours": "generated proxy", "ice": "Ice, memory tuned"}
# Without this, large replies of Ice take several times as long; ours run with the same settings.
TUNED_MEMORY: Final = {"MALLOC_MMAP_THRESHOLD_": "134217728", "MALLOC_TRIM_THRESHOLD_": "268435456"}
IN_FLIGHT: Final = 16
FRAME_RATE: Final = 30.0
STREAM_SECONDS: Final = 2.0


class Lab:
    """A server and a client of each kind."""

    def __init__(self, stack: ExitStack, folder: Path, *, quick: bool) -> None:
        self.quick: Final = quick
        self._servers: dict[str, Worker] = {}
        self._clients: dict[str, Worker] = {}
        for kind in KINDS:
            endpoint = free_endpoint()
            self._servers[kind] = stack.enter_context(Worker("server", kind, endpoint, folder))
            self._clients[kind] = stack.enter_context(Worker("client", kind, endpoint, folder))

    def measure(self, rounds: int, subject: Callable[[Worker, Worker], T]) -> dict[str, list[T]]:
        """Return the results of a subject for each kind, by round."""
        results: dict[str, list[T]] = {kind: [] for kind in KINDS}
        for number in range(1 + (max(2, rounds // 8) if self.quick else rounds)):
            for kind in random.sample(list(KINDS), len(KINDS)):
                result = subject(self._servers[kind], self._clients[kind])
                if number:
                    results[kind].append(result)
        return results

    def call(
        self, rounds: int, count: int, size: tuple[int, int] | None = None
    ) -> dict[str, list[list[float]]]:
        """Return the durations of calls in s, by round."""
        return self.measure(rounds, lambda _, client: client.do("call", count, size))

    def stream(self, rounds: int, rate: float) -> dict[str, list[tuple[int, list[float]]]]:
        """Return how many images were sent, and the latencies in s of those that arrived, by round."""

        def stream(server: Worker, client: Worker) -> tuple[int, list[float]]:
            client.do("arrived")
            server.do("start", "video", rate, LARGE_IMAGE)
            time.sleep(STREAM_SECONDS)
            sent = server.do("stop")
            time.sleep(0.2)  # for those that are on their way
            return sent, client.do("arrived")

        return self.measure(rounds, stream)

    def follow(self) -> None:
        """Let the clients follow the streams of images."""
        for client in self._clients.values():
            client.do("follow")

    def send_poses(self, server: Worker, client: Worker) -> list[float]:
        """Return the durations in s of reading the newest pose of a stream of 100 a second."""
        server.do("start", "pose", 100.0)
        times: list[float] = client.do("latest", 100)
        server.do("stop")
        return times


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="an eighth of the rounds: a trial, no figures")
    quick = parser.parse_args().quick
    if importlib.util.find_spec("Ice") is None:
        sys.exit("Ice is missing: pip install -e '.[bench]' (it is built from source, which takes minutes)")
    os.environ.update(TUNED_MEMORY)
    console = Console(width=110)
    console.print(_machine())
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        generate(Path(folder))
        lab = Lab(stack, Path(folder), quick=quick)
        calls = lab.call(60, 300)
        console.print(_table("4 doubles there and back", "us", calls))
        console.print(_table("the newest 4 doubles", "us", lab.measure(20, lab.send_poses)))
        flying = lab.measure(12, lambda _, client: client.do("pipeline", 2000, IN_FLIGHT))
        console.print(_rates(f"{IN_FLIGHT} calls in flight, calls a second", flying))
        for size in (SMALL_IMAGE, LARGE_IMAGE):
            images = lab.call(40, 60, size)
            console.print(_table(f"an image of {size[0]}x{size[1]}", "ms", images))
        lab.follow()
        arrived = {
            kind: [latencies for _, latencies in rounds] for kind, rounds in lab.stream(8, FRAME_RATE).items()
        }
        console.print(_table(f"a stream of 1280x960 at {FRAME_RATE:g} images a second", "ms", arrived))
        fastest = lab.stream(10, 0.0)
        rates = {
            kind: [len(latencies) / STREAM_SECONDS for _, latencies in rounds]
            for kind, rounds in fastest.items()
        }
        console.print(_rates("the stream at its maximum, images a second", rates))
        with ComponentProcess(module("naoserver_sim", "--listen", free_endpoint())) as simulator:
            simulator.wait_for("ready")
            console.print(_table("4 doubles, beside a simulated robot", "us", lab.call(20, 2000)))


def _table(title: str, unit: str, results: Mapping[str, Sequence[Sequence[float]]]) -> Table:
    """Return a table of durations in s, given by round."""
    factor = {"us": 1e6, "ms": 1e3}[unit]
    medians = {kind: [statistics.median(times) for times in rounds] for kind, rounds in results.items()}
    table = Table("", f"p50 {unit}", f"p99 {unit}", f"longest {unit}", "times Ice", title=title)
    for kind, rounds in results.items():
        times = sorted(factor * seconds for each in rounds for seconds in each)
        table.add_row(
            KINDS[kind],
            _spread([factor * median for median in medians[kind]]),
            _short(times[int(0.99 * len(times))]),
            _short(times[-1]),
            _ratio(medians[kind], medians["ice"]),
        )
    return table


def _rates(title: str, rates: Mapping[str, Sequence[float]]) -> Table:
    table = Table("", "", "times Ice", title=title)
    for kind, each in rates.items():
        table.add_row(KINDS[kind], _spread(each), _ratio(each, rates["ice"]))
    return table


def _ratio(values: Sequence[float], others: Sequence[float]) -> str:
    return _spread([value / other for value, other in zip(values, others, strict=True)])


def _spread(values: Sequence[float]) -> str:
    """Return the median and the quartiles of the rounds."""
    low, median, high = statistics.quantiles(values, n=4, method="inclusive")
    return f"{_short(median)} ({_short(low)} to {_short(high)})"


def _short(value: float) -> str:
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def _machine() -> str:
    versions = [f"{name} {importlib.metadata.version(name)}" for name in ("eclipse-zenoh", "zeroc-ice")]
    describe = ["git", "describe", "--always", "--dirty"]
    commit = subprocess.run(describe, capture_output=True, text=True, timeout=10, check=False).stdout.strip()
    when = time.strftime("%Y-%m-%d %H:%M", time.gmtime())
    return (
        f"{when} UTC: {os.cpu_count()} cores, {platform.machine()}, "
        f"{platform.system()} {platform.release()}, Python {platform.python_version()}, "
        f"{', '.join(versions)}, commit {commit}"
    )


if __name__ == "__main__":
    main()
