"""Measure calls and streams beside Ice: small calls, calls in flight, images, a stream of them, many clients.

Ours are measured twice: as between processes of one machine, through a Unix socket, and as between machines,
over Zenoh. Servers and clients are separate processes on loopback; all kinds alternate in rounds of random
order, and the first round is not counted. A figure is the median of the rounds, with the quartiles in
parentheses; a ratio to Ice is that of one round. The last table compares them with their goals.
benchmarks/results/transport.md has the results.

    python benchmarks/bench_transport.py [--quick] [--before TREE]

Ice comes with `pip install -e '.[bench]'`. TREE is a checkout of another commit with its own `.venv`, whose
calls over Zenoh are measured beside.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import math
import os
import platform
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from itertools import chain
from pathlib import Path
from typing import Final, TypeVar

import psutil
from rich.console import Console
from rich.table import Table

from benchmarks.transport.peers import LARGE_IMAGE, SMALL_IMAGE, Kind, generate
from benchmarks.transport.workers import Worker
from tests.support.processes import ComponentProcess, free_endpoint, module

T = TypeVar("T")
Times = Mapping[str, Sequence[Sequence[float]]]
"""Durations in s for each kind, by round."""
Figures = Mapping[str, Sequence[float]]
"""A figure for each kind, by round."""

IN_FLIGHT: Final = 16
CLIENTS: Final = 16
FRAME_RATE: Final = 30.0
STREAM_SECONDS: Final = 2.0
CROWD_SECONDS: Final = 3.0
START_DELAY: Final = 0.3  # s until clients that call together have all begun


def kinds(before: Path | None) -> dict[str, Kind]:
    """Return what is compared; `before` is the tree of another commit, as between machines."""
    compared = {
        "ours": Kind("generated proxy"),
        "network": Kind(
            "generated proxy, over the network", environment={"VISUALHFSM_LOCAL_SOCKETS": "false"}
        ),
        "ice": Kind("Ice, memory tuned", "ice"),
    }
    if before is not None:
        alone = {"VISUALHFSM_SHARED_MEMORY": "false"}
        compared["before"] = Kind(f"over the network, {_commit(before)}", tree=before, environment=alone)
    return compared


class Lab:
    """A server and a client of each kind, in processes."""

    def __init__(self, stack: ExitStack, compared: Mapping[str, Kind], folder: Path, *, quick: bool) -> None:
        self.quick: Final = quick
        self.clients: Final[dict[str, Worker]] = {}
        self.servers: Final[dict[str, Worker]] = {}
        self._kinds: Final = compared
        self._folder: Final = folder
        self._endpoints: Final = {name: free_endpoint() for name in compared}
        for name, kind in compared.items():
            generate(kind, folder / name)
            self.servers[name] = stack.enter_context(self._worker("server", name))
            self.clients[name] = stack.enter_context(self._worker("client", name))

    def measure(
        self, rounds: int, subject: Callable[[str], T], names: Iterable[str] = ()
    ) -> dict[str, list[T]]:
        """Return the results of a subject for each kind, or for those with some names, by round."""
        results: dict[str, list[T]] = {name: [] for name in names or self._kinds}
        for number in range(1 + (max(2, rounds // 8) if self.quick else rounds)):
            for name in random.sample(list(results), len(results)):
                result = subject(name)
                if number:
                    results[name].append(result)
        return results

    def call(self, rounds: int, count: int, size: tuple[int, int] | None = None) -> Times:
        """Call for four doubles, or for an image."""
        return self.measure(rounds, lambda name: self.clients[name].do("call", count, size))

    def stream(self, rounds: int, rate: float) -> Times:
        """Send images; return the latencies of those that arrive."""

        def stream(name: str) -> list[float]:
            server, client = self.servers[name], self.clients[name]
            client.do("arrived")
            server.do("start", rate, LARGE_IMAGE)
            time.sleep(STREAM_SECONDS)
            server.do("stop")
            time.sleep(0.2)  # for those that are on their way
            latencies: list[float] = client.do("arrived")
            return latencies

        return self.measure(rounds, stream)

    def crowd(self, rounds: int) -> dict[str, list[list[list[float]]]]:
        """Let many clients call one server; return the durations in s by round and client."""
        with ExitStack() as stack:
            crowds = {
                name: [stack.enter_context(self._worker("client", name)) for _ in range(CLIENTS)]
                for name in ("ours", "ice")
            }

            def call(name: str) -> list[list[float]]:
                start = time.monotonic() + START_DELAY
                for client in crowds[name]:
                    client.begin("call_together", start, CROWD_SECONDS)
                return [client.answer() for client in crowds[name]]

            return self.measure(rounds, call, crowds)

    def _worker(self, role: str, name: str) -> Worker:
        return Worker(role, self._kinds[name], self._endpoints[name], self._folder / name)


class Report:
    """Print tables, and collect what has a goal."""

    def __init__(self, compared: Mapping[str, Kind]) -> None:
        self.console: Final = Console(width=118)
        self._kinds: Final = compared
        self._goals: Final = Table("figure", "goal", "measured", "", title="Goals")

    def times(self, title: str, unit: str, results: Times) -> tuple[Figures, Figures]:
        """Print a table of durations; return the medians and the 99th percentiles in s."""
        factor = {"us": 1e6, "ms": 1e3}[unit]
        medians, p99 = (
            {name: [_percentile(times, part) for times in rounds] for name, rounds in results.items()}
            for part in (0.5, 0.99)
        )
        columns = (f"p50 {unit}", "times Ice", f"p99 {unit}", "times Ice", f"longest {unit}")
        table = Table("", *columns, title=title)
        for name, rounds in results.items():
            cells = [self._kinds[name].name]
            for figures in (medians, p99):
                cells.append(spread([factor * value for value in figures[name]]))
                cells.append(spread(ratios(figures[name], figures["ice"])))
            table.add_row(*cells, _short(factor * max(map(max, rounds))))
        self.console.print(table)
        return medians, p99

    def rates(self, title: str, rates: Figures) -> None:
        """Print a table of rates."""
        table = Table("", "a second", "times Ice", title=title)
        for name, each in rates.items():
            table.add_row(self._kinds[name].name, spread(each), spread(ratios(each, rates["ice"])))
        self.console.print(table)

    def judge(
        self,
        figure: str,
        values: Sequence[float],
        unit: str,
        *,
        at_most: float = math.inf,
        at_least: float = 0.0,
    ) -> None:
        """Compare the median of the rounds with a goal."""
        goal = f"at least {at_least:.3g}" if at_least else f"at most {at_most:.3g}"
        met = at_least <= statistics.median(values) <= at_most
        self._goals.add_row(figure, f"{goal} {unit}", spread(values), "met" if met else "NOT met")

    def compare(self, figure: str, figures: Figures, *, to: str = "ice", **goal: float) -> None:
        """Compare the ratio of ours to another kind with a goal; over the network to the commit before."""
        kind, of = ("ours", "Ice's") if to == "ice" else ("network", f"that of {self._kinds[to].name}")
        self.judge(figure, ratios(figures[kind], figures[to]), f"times {of}", **goal)

    def finish(self) -> None:
        """Print the figures with their goals."""
        self.console.print(self._goals)


def measure(lab: Lab, report: Report) -> None:
    """Measure everything and print it."""
    small, _ = report.times("4 doubles there and back", "us", lab.call(60, 300))
    report.compare("small call", small, at_most=0.6)
    flying = lab.measure(12, lambda name: lab.clients[name].do("pipeline", 4000, IN_FLIGHT))
    report.rates(f"{IN_FLIGHT} calls in flight", flying)
    report.compare(f"{IN_FLIGHT} calls in flight: rate", flying, at_least=0.65)
    small_image, _ = report.times("an image of 320x240", "ms", lab.call(40, 60, SMALL_IMAGE))
    report.compare("320x240 image by call", small_image, at_most=0.7)
    large_image, _ = report.times("an image of 1280x960", "ms", lab.call(40, 60, LARGE_IMAGE))
    report.compare("1280x960 image by call", large_image, at_most=1 / 3)
    measure_streams(lab, report)
    measure_crowd(lab, report)
    for title, simulators, flags in (
        ("a simulated robot", 1, ()),
        ("simulators on all processors", os.cpu_count() or 1, ("--speed", "100")),
    ):
        with run_simulators(simulators, *flags) as load:
            calls = lab.call(20, 2000)
            loaded = f"{title} (load: {load():.2g} processors)"
        _, p99 = report.times(f"4 doubles, beside {loaded}", "us", calls)
        report.compare(f"small call beside {title}: p99", p99, at_most=1.0)
    if "before" in small:  # rounds differ by a twentieth
        report.compare("small call over Zenoh", small, to="before", at_most=1.05)
        report.compare(f"{IN_FLIGHT} calls in flight over Zenoh: rate", flying, to="before", at_least=0.95)
        report.compare("320x240 image over Zenoh", small_image, to="before", at_most=1.05)
        report.compare("1280x960 image over Zenoh", large_image, to="before", at_most=1.05)


def measure_streams(lab: Lab, report: Report) -> None:
    """Measure a stream of images at a camera's rate, and at its maximum."""
    for client in lab.clients.values():
        client.do("follow")
    title = f"a stream of 1280x960 at {FRAME_RATE:g} images a second: latency"
    latencies, _ = report.times(title, "ms", lab.stream(8, FRAME_RATE))
    fastest = lab.stream(10, 0.0)
    rates = {name: [len(each) / STREAM_SECONDS for each in rounds] for name, rounds in fastest.items()}
    report.rates("images of 1280x960 in a stream at its maximum", rates)
    report.compare("1280x960 stream at its maximum: rate", rates, at_least=4)
    report.compare(f"its latency at {FRAME_RATE:g} images/s", latencies, at_most=0.5)


def measure_crowd(lab: Lab, report: Report) -> None:
    """Measure many clients that call one server."""
    crowd = lab.crowd(6)
    calls = {name: [list(chain(*clients)) for clients in rounds] for name, rounds in crowd.items()}
    _, p99 = report.times(f"4 doubles, {CLIENTS} clients of one server", "us", calls)
    counts = [[len(each) for each in clients] for clients in crowd["ours"]]
    shares = [min(each) / statistics.mean(each) for each in counts]
    report.judge(f"{CLIENTS} clients: the slowest", shares, "of the mean", at_least=0.9)
    report.judge(f"{CLIENTS} clients: p99", [1e3 * each for each in p99["ours"]], "ms", at_most=1.0)


@contextmanager
def run_simulators(count: int, *flags: str) -> Iterator[Callable[[], float]]:
    """Run simulated robots without clients; give a function that returns how many processors they took."""
    with ExitStack() as stack:
        processes = []
        for _ in range(count):
            command = module("naoserver_sim", "--listen", free_endpoint(), *flags)
            simulator = stack.enter_context(ComponentProcess(command))
            simulator.wait_for("ready")
            processes.append(psutil.Process(simulator.process.pid))

        def used() -> float:
            return sum(sum(process.cpu_times()[:2]) for process in processes)

        start, before = time.monotonic(), used()
        yield lambda: (used() - before) / (time.monotonic() - start)


def ratios(values: Sequence[float], others: Sequence[float]) -> list[float]:
    """Return the ratio of each round."""
    return [value / other for value, other in zip(values, others, strict=True)]


def spread(values: Sequence[float]) -> str:
    """Return the median and the quartiles of the rounds."""
    low, median, high = statistics.quantiles(values, n=4, method="inclusive")
    return f"{_short(median)} ({_short(low)} to {_short(high)})"


def _short(value: float) -> str:
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def _percentile(times: Sequence[float], part: float) -> float:
    return sorted(times)[int(part * len(times))]


def _commit(tree: Path) -> str:
    describe = ["git", "-C", str(tree), "describe", "--always", "--dirty"]
    return subprocess.run(describe, capture_output=True, text=True, timeout=10, check=False).stdout.strip()


def _machine() -> str:
    versions = [f"{name} {importlib.metadata.version(name)}" for name in ("eclipse-zenoh", "zeroc-ice")]
    when = time.strftime("%Y-%m-%d %H:%M", time.gmtime())
    return (
        f"{when} UTC: {os.cpu_count()} cores, {platform.machine()}, "
        f"{platform.system()} {platform.release()}, Python {platform.python_version()}, "
        f"{', '.join(versions)}, commit {_commit(Path(__file__).parent)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="an eighth of the rounds: a trial, no figures")
    parser.add_argument("--before", type=Path, metavar="TREE", help="another commit's checkout")
    options = parser.parse_args()
    if importlib.util.find_spec("Ice") is None:
        sys.exit("Ice is missing: pip install -e '.[bench]' (it is built from source, which takes minutes)")
    compared = kinds(options.before)
    report = Report(compared)
    report.console.print(_machine())
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        measure(Lab(stack, compared, Path(folder), quick=options.quick), report)
    report.finish()


if __name__ == "__main__":
    main()
