"""What tests cost: at the end of a run, the files that take most processor time, and the largest process.

A run of a tier, which TEST_TIER names, also leaves a record in the cache of pytest: the processor time of each file,
in multiples of a fixed loop of Python, which depends less on the machine than seconds do, and which tests failed.
`tools/runs/full.py` reads it.
"""

from __future__ import annotations

import json
import os
import resource
import time
from collections import defaultdict
from collections.abc import Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

__all__ = ["Costs"]

PROCESSOR: Final = "processor time"
"""The property of a test's last report: the processor time, in s, of this process and of those that it has started."""
WALL: Final = "wall time"
"""The property of a test's last report: how long it took, in s, with its fixtures."""
LARGEST: Final = "largest process"
"""The property of a test's last report: the memory, in MB, that the largest of these processes has had so far."""
GREW: Final = "growth"
"""The property of a test's last report: by how much this process has become larger than ever before, in MB."""
LOOPS: Final = "loops"
"""The property of a test's last report: its processor time as a multiple of that of a fixed loop."""
MOST_MEMORY: Final = 600
"""What the largest process of a run may have, in MB."""
SHOWN: Final = int(os.environ.get("TEST_COSTS") or 10)
"""So many files are named."""
GREATEST: Final = 5
"""So many files are named for the memory that they take."""
FEWEST: Final = 20
"""Shorter runs say nothing about their costs."""
TIER: Final = os.environ.get("TEST_TIER", "")
"""Which tests this run has, for its record."""
_TICKS: Final = os.sysconf("SC_CLK_TCK")


@dataclass
class Cost:
    """What the tests of a file took."""

    tests: int = 0
    processor: float = 0.0
    wall: float = 0.0
    grew: float = 0.0
    loops: float = 0.0


class Costs:
    """A plugin that measures each test, in the workers of pytest-xdist too, and sums up the costs at the end.

    The time of a process counts in the test during which it passes, as far as Linux lists the processes: that of a
    browser that all tests share does not count in the last one of them.
    """

    def __init__(self) -> None:
        self._began: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
        self._loop = 0.0
        self._files: Final[defaultdict[str, Cost]] = defaultdict(Cost)
        self._failed: Final[list[str]] = []
        self._largest: tuple[float, str] = (0.0, "")

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self) -> None:
        self._began = (time.monotonic(), _processor_time(), time.process_time(), _own_largest())

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        if call.when == "teardown":
            wall, processor, own, size = self._began
            report.user_properties.append((WALL, time.monotonic() - wall))
            # The processes of Chromium wait for none of theirs, which take their times with them when they end.
            took = max(_processor_time() - processor, time.process_time() - own)
            report.user_properties.append((PROCESSOR, took))
            if TIER:
                self._loop = self._loop or _time_of_loop()
                report.user_properties.append((LOOPS, took / self._loop))
            report.user_properties.append((LARGEST, _largest()))
            report.user_properties.append((GREW, _own_largest() - size))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and report.nodeid not in self._failed:
            self._failed.append(report.nodeid)
        took = {name: value for name, value in report.user_properties if isinstance(value, float)}
        if report.when == "teardown" and PROCESSOR in took:
            cost = self._files[report.nodeid.partition("::")[0]]
            cost.tests += 1
            cost.processor += took[PROCESSOR]
            cost.wall += took[WALL]
            cost.grew += took[GREW]
            cost.loops += took.get(LOOPS, 0.0)
            if took[LARGEST] > self._largest[0]:
                self._largest = took[LARGEST], report.nodeid

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if TIER and self._files:  # pytest-xdist's workers see no reports
            loops = {file: cost.loops for file, cost in self._files.items()}
            folder = Path(session.config.cache.mkdir("tiers"))
            (folder / f"{TIER}.json").write_text(
                json.dumps({"loops": loops, "failed": self._failed}), "utf-8"
            )

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if sum(cost.tests for cost in self._files.values()) < FEWEST:
            return
        terminalreporter.section("costliest files")
        terminalreporter.write_line("processor     wall  tests")
        costliest = sorted(self._files.items(), key=lambda item: -item[1].processor)
        for file, cost in costliest[:SHOWN]:
            terminalreporter.write_line(f"{cost.processor:7.1f} s {cost.wall:6.1f} s {cost.tests:6}  {file}")
        processor, wall = (
            sum(getattr(cost, each) for cost in self._files.values()) for each in ("processor", "wall")
        )
        terminalreporter.write_line(f"{processor:7.1f} s {wall:6.1f} s         all tests")
        grew = sorted(self._files.items(), key=lambda item: -item[1].grew)[:GREATEST]
        named = ", ".join(f"{cost.grew:.0f} MB in {file}" for file, cost in grew)
        terminalreporter.write_line(f"the processes of the tests grew most by {named}")
        memory, test = self._largest
        terminalreporter.write_line(f"largest process {memory:.0f} MB of {MOST_MEMORY}, since {test}")


def _time_of_loop() -> float:
    """Return the processor time of the fixed loop, in s: the least of some, which nothing else delayed."""

    def time_once() -> float:
        began = time.process_time()
        for _ in range(100_000):
            pass
        return time.process_time() - began

    return min(time_once() for _ in range(5))


def _processor_time() -> float:
    return sum(each.ru_utime + each.ru_stime for each in _usages()) + sum(map(_time_of, _running("self")))


def _running(process: int | str) -> Iterator[int]:
    """Yield the processes that a process has started, and those that they have, as far as Linux lists them."""
    if process == "self":
        try:
            os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        except ChildProcessError:  # as in most tests
            return
    for listed in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(FileNotFoundError, ProcessLookupError):  # it has ended
            for child in listed.read_text().split():
                yield int(child)
                yield from _running(int(child))


def _time_of(process: int) -> float:
    """Return the processor time of a process and of those that it waited for, or 0 if it has ended."""
    with suppress(FileNotFoundError, ProcessLookupError):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return sum(map(int, fields[11:15])) / _TICKS
    return 0.0


def _largest() -> float:
    return max(_own_largest(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)


def _own_largest() -> float:
    """Return the most memory in MB that this process had; its usage begins with that of the one that started it."""
    with suppress(FileNotFoundError):
        status = Path("/proc/self/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _usages() -> tuple[resource.struct_rusage, resource.struct_rusage]:
    return resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
