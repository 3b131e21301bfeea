"""Coverage in a run of pytest: gathered from the workers of xdist, reported at the end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

from ..errors import DocumentInvalid
from .hits import Hits
from .html import write_page
from .inventory import DocumentItems, take_inventory
from .summary import Summary
from .terminal import report_lines

if TYPE_CHECKING:
    from _pytest.terminal import TerminalReporter

__all__ = ["CoverageSession"]

_OUTPUT: Final = "hfsm_coverage"
_TYPES: Final = ("term", "html", "json")


class CoverageSession:
    """Count what behaviors do in this process, and report what came together."""

    def __init__(self, config: pytest.Config) -> None:
        self.hits: Final = Hits()
        self._config: Final = config
        self._root: Final = config.rootpath.resolve()
        self._documents: Final = self._inventory()
        self._reports: Final = [_report(text) for text in config.getoption("--hfsm-cov-report") or ["term"]]
        self._least: Final[float | None] = config.getoption("--hfsm-cov-fail-under")
        self._summary: Summary | None = None

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Hand over what was counted, or put it together and fail when it is too little."""
        output: dict[str, Any] | None = getattr(self._config, "workeroutput", None)
        if output is not None:  # a worker of xdist
            output[_OUTPUT] = json.dumps(self.hits.to_json())
            return
        self._summary = Summary.of(self._documents, self.hits, self._root)
        if self._too_little(self._summary) and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: object) -> None:  # noqa: ANN401, ARG002 - of xdist
        """Add what a worker has counted."""
        counted = getattr(node, "workeroutput", {}).get(_OUTPUT)
        if counted is not None:
            self.hits.add_json(json.loads(counted))

    def pytest_terminal_summary(self, terminalreporter: TerminalReporter) -> None:
        """Write the reports."""
        summary = self._summary
        if summary is None:
            return
        terminalreporter.section("coverage of automata")
        for kind, target in self._reports:
            if kind == "term":
                for line, missing in report_lines(summary):
                    terminalreporter.write_line(line, red=missing)
            elif kind == "html":
                terminalreporter.write_line(f"written: {write_page(summary, self._root / target)}")
            else:
                file = self._root / target
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(json.dumps(summary.to_json(), indent=2) + "\n", encoding="utf-8")
                terminalreporter.write_line(f"written: {file}")
        if self._too_little(summary):
            terminalreporter.write_line(
                f"FAIL: {summary.all.percent:.1f} % of the automata is covered, "
                f"less than the required {self._least:g} %",
                red=True,
                bold=True,
            )

    def _too_little(self, summary: Summary) -> bool:
        return self._least is not None and summary.all.percent < self._least

    def _inventory(self) -> list[DocumentItems]:
        base = self._config.invocation_params.dir
        try:
            paths = [base / path for path in self._config.getoption("--hfsm-cov")]
            return take_inventory(paths, self._root)
        except (DocumentInvalid, OSError) as error:
            raise pytest.UsageError(str(error)) from error


def _report(text: str) -> tuple[str, Path]:
    kind, _, target = text.partition(":")
    if kind not in _TYPES or (kind == "term") == bool(target):
        raise pytest.UsageError(f"--hfsm-cov-report={text}: it is term, html:DIR or json:FILE")
    return kind, Path(target)
