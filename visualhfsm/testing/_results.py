"""Results of tests for the editor, as lines of JSON: how each test went, and what it passed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec
import pytest

from codegen.parsing import parse_python
from visualhfsm._base.languages import encode_message
from visualhfsm._document.places import Place
from visualhfsm._processes.document_tests import END_OF_RESULTS, CodeRun, Hit, TestResult
from visualhfsm.simulation import Behavior

from ._coverage import Hits
from ._lines import Lines

_LONGEST_REASON: Final = 2000
_LONGEST_TIMELINE: Final = 4000
_TIMELINE: Final = "\ntimeline of "
"""The beginning of a timeline in the message of an error."""
_MOST_HITS: Final = 20_000


class Results:
    """Writes a line for each test into a file: a plugin of pytest."""

    def __init__(self, config: pytest.Config, path: Path, lines: Lines) -> None:
        self._path: Final = path
        self._root: Final = config.rootpath
        self._is_worker: Final = hasattr(config, "workerinput")  # of xdist
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

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Write down how a test went; one that cannot begin, or not end, has failed."""
        # What a worker of xdist has written comes to its controller, too, which says "???" of a crash.
        by_worker = hasattr(report, "node") and str(report.when) != "???"
        if by_worker or (report.when != "call" and report.passed):
            return
        reason, mark, rest = _reason(report).partition(_TIMELINE)
        timeline = next((text for name, text in report.sections if name == "behavior"), mark.lstrip() + rest)
        self._write(
            TestResult(
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
        )

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Write down that a file of tests cannot be read."""
        if report.failed and not self._is_worker:  # xdist's controller hears it once
            reason = self._mistake(report.nodeid) or str(report.longrepr)[-_LONGEST_REASON:]
            self._write(TestResult(name=report.nodeid, outcome="failed", reason=reason))

    def _mistake(self, name: str) -> str:
        """Return where a file of tests is no Python, and why: what pytest says begins with its own lines."""
        try:
            parse_python((self._root / name).read_bytes())
        except SyntaxError as error:
            return f"{Path(name).name}:{error.lineno or 1}: {type(error).__name__}: {error.msg}"
        except (OSError, ValueError, RecursionError, MemoryError):
            pass  # pytest says it
        return ""

    def pytest_sessionfinish(self) -> None:
        """Write down that no test ended this process."""
        if not self._is_worker and self._path.is_file():  # which a test may have deleted
            with self._path.open("ab") as file:
                file.write(END_OF_RESULTS[1:])

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

    def _write(self, result: TestResult) -> None:
        with self._path.open("ab") as file:
            file.write(msgspec.json.encode(result, enc_hook=encode_message) + b"\n")


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
