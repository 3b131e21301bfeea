"""What tests cost: at the end of a run, the files that take most processor time, and the largest process."""

from __future__ import annotations

import resource
import time
from collections import defaultdict
from collections.abc import Generator
from dataclasses import dataclass
from typing import Final

import pytest

__all__ = ["Costs"]

PROCESSOR: Final = "processor time"
"""The property of a test's last report: the processor time, in s, of this process and of those that it waited for."""
WALL: Final = "wall time"
"""The property of a test's last report: how long it took, in s, with its fixtures."""
LARGEST: Final = "largest process"
"""The property of a test's last report: the memory, in MB, that the largest of these processes has had so far."""
MOST_MEMORY: Final = 700
"""What the largest process of a run may have, in MB."""
SHOWN: Final = 10
"""So many files are named."""
FEWEST: Final = 20
"""Shorter runs say nothing about their costs."""


@dataclass
class Cost:
    """What the tests of a file took."""

    tests: int = 0
    processor: float = 0.0
    wall: float = 0.0


class Costs:
    """A plugin that measures each test, in the workers of pytest-xdist too, and sums up the costs at the end.

    The time of a process counts in the test that waits for its end: what fixtures of a module start, in its last one.
    """

    def __init__(self) -> None:
        self._began: tuple[float, float] = (0.0, 0.0)
        self._files: Final[defaultdict[str, Cost]] = defaultdict(Cost)
        self._largest: tuple[float, str] = (0.0, "")

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self) -> None:
        self._began = (time.monotonic(), _processor_time())

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        if call.when == "teardown":
            wall, processor = self._began
            report.user_properties.append((WALL, time.monotonic() - wall))
            report.user_properties.append((PROCESSOR, _processor_time() - processor))
            report.user_properties.append((LARGEST, _largest()))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        took = {name: value for name, value in report.user_properties if isinstance(value, float)}
        if report.when == "teardown" and PROCESSOR in took:
            cost = self._files[report.nodeid.partition("::")[0]]
            cost.tests += 1
            cost.processor += took[PROCESSOR]
            cost.wall += took[WALL]
            if took[LARGEST] > self._largest[0]:
                self._largest = took[LARGEST], report.nodeid

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
        memory, test = self._largest
        terminalreporter.write_line(f"largest process {memory:.0f} MB of {MOST_MEMORY}, since {test}")


def _processor_time() -> float:
    return sum(each.ru_utime + each.ru_stime for each in _usages())


def _largest() -> float:
    return max(each.ru_maxrss for each in _usages()) / 1024


def _usages() -> tuple[resource.struct_rusage, resource.struct_rusage]:
    return resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
