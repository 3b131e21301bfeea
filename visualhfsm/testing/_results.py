"""Results of tests for the editor, as lines of JSON: how each test went, and what it passed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec
import pytest

from visualhfsm._base.languages import encode_message
from visualhfsm._document.places import Place
from visualhfsm._processes.test_results import CodeRun, Hit, TestResult
from visualhfsm.simulation import Behavior

from ._coverage import Hits
from ._lines import Lines

_LONGEST_REASON: Final = 2000
_LONGEST_TIMELINE: Final = 4000
_TIMELINE: Final = "\ntimeline of "
"""The beginning of a timeline in the message of an error."""
_MOST_HITS: Final = 20_000
_LINE: Final = "hfsm_result"
"""The attribute of a report in which a worker of xdist sends its line to the controller."""


class Results:
    """Writes a line for each test into a file: a plugin of pytest."""

    def __init__(self, config: pytest.Config, path: Path, lines: Lines) -> None:
        self._path: Final = path
        self._is_worker: Final = hasattr(config, "workerinput")
        self._hits = Hits()
        self._lines = lines
        self._behaviors: list[Behavior] = []
        self._known: set[tuple[str, Place, int]] = set()
        """The code that was written down: documents, places and versions."""

    def watch(self, behavior: Behavior) -> None:
        """Count what a behavior of the present test does."""
        self._hits.watch(lambda: behavior.document, behavior.tree)
        self._behaviors.append(behavior)

    def pytest_runtest_logstart(self) -> None:
        """Begin a test."""
        self._hits.clear()
        self._behaviors.clear()

    @pytest.hookimpl(tryfirst=True)  # before xdist sends the report of a worker
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Write down how a test went; one that cannot begin, or not end, has failed."""
        if (line := getattr(report, _LINE, None)) is not None:
            self._write(line)
        elif report.when == "call" or not report.passed:
            line = _line(self._result(report))
            if self._is_worker:
                setattr(report, _LINE, line)
            else:
                self._write(line)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Write down that a file of tests cannot be read; xdist's controller hears it of its workers."""
        if report.failed and not self._is_worker:
            reason = str(report.longrepr)[-_LONGEST_REASON:]
            self._write(_line(TestResult(name=report.nodeid, outcome="failed", reason=reason)))

    def _result(self, report: pytest.TestReport) -> TestResult:
        reason, mark, rest = _reason(report).partition(_TIMELINE)
        timeline = next((text for name, text in report.sections if name == "behavior"), mark.strip() + rest)
        return TestResult(
            name=report.nodeid,
            outcome=report.outcome,
            seconds=round(report.duration, 3),
            reason=reason[:_LONGEST_REASON],
            timeline=timeline[-_LONGEST_TIMELINE:],
            hits=tuple(self._counted()),
            ended=tuple(self._current()) if report.failed else (),
            code=tuple(self._code()),
            unmeasured=self._lines.unmeasured,
        )

    def _counted(self) -> Iterator[Hit]:
        for (document, automaton, kind, id_), count in self._hits.most_common(_MOST_HITS):
            yield Hit(document, automaton, kind, id_, count)

    def _current(self) -> Iterator[Hit]:
        for behavior in self._behaviors:
            path = str((behavior.document or Path()).resolve())
            for run in behavior.tree.actors:
                if run.active:
                    yield Hit(path, run.automaton.id, "entered", run.current.id, 1)

    def _code(self) -> Iterator[CodeRun]:
        for code in self._lines.pieces():
            key = code.document, code.place, code.version
            if code.ran or key not in self._known:
                self._known.add(key)
                yield code

    def _write(self, line: str) -> None:
        with self._path.open("a", encoding="utf-8") as file:
            file.write(f"{line}\n")


def _line(result: TestResult) -> str:
    return msgspec.json.encode(result, enc_hook=encode_message).decode()


def _reason(report: pytest.TestReport) -> str:
    if report.passed:
        return ""
    if isinstance(report.longrepr, tuple):
        return str(report.longrepr[-1])
    crash = getattr(report.longrepr, "reprcrash", None)
    if crash is None:
        return str(report.longrepr)
    message = crash.message.removeprefix("hfsm_runtime.virtual.errors.")
    return f"{Path(crash.path).name}:{crash.lineno}: {message}"
