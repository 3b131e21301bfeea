"""What tests do, counted: processes, sockets, Zenoh sessions, models of MuJoCo, pages and simulated time.

Clocks measure machines, these numbers measure tests: they keep the quick tier quick. What a test of `make test` may do
is below; what the doors may do together is in tests/budget.toml.
"""

from __future__ import annotations

import sys
import tomllib
from collections import Counter
from collections.abc import Generator
from fnmatch import fnmatch
from functools import wraps
from typing import Any, Final

import pytest
import zenoh

from tests.support.places import ROOT

__all__ = ["BUDGET", "Doors", "begin_test", "quick_loops", "undue_deeds"]

_DONE: Final[Counter[str]] = Counter()
"""How often tests of this process have done each thing so far, their fixtures included; simulated time is in s."""
_BEFORE: Final = pytest.StashKey[Counter[str]]()
"""A copy of it from before a test."""
BUDGET: Final = ROOT / "tests" / "budget.toml"
_DEEDS: Final = "deeds"
"""The property of a door's last report: what it did."""
_EVENTS: Final = {
    "subprocess.Popen": "processes",
    "os.posix_spawn": "processes",
    "os.fork": "processes",
    "os.forkpty": "processes",
    "socket.bind": "sockets",
}
"""Events of Python's audit, and what they count as."""
_MARKS: Final = {"processes": "slow", "sockets": "slow", "sessions": "slow", "models": "sim"}
"""What a unit test may do only with a mark, and which."""


def begin_test(test: pytest.Item) -> None:
    """Count what is done from now on as that of a test, also by libraries that are loaded by now.

    Nothing is loaded for this alone.
    """
    if "audit" not in _counted:
        _counted.add("audit")
        sys.addaudithook(_hear)
        _count_calls(zenoh, "open", "sessions")
    if "mujoco" in sys.modules.keys() - _counted:
        _counted.add("mujoco")
        _count_calls(sys.modules["mujoco"].MjSpec, "compile", "models")
        _count_steps(sys.modules["mujoco"])
    if "playwright.sync_api" in sys.modules.keys() - _counted:
        _counted.add("playwright.sync_api")
        _count_calls(sys.modules["playwright.sync_api"].BrowserContext, "new_page", "pages")
    test.stash[_BEFORE] = _DONE.copy()


def undue_deeds(test: pytest.Item) -> str:
    """Return what a unit test did without the mark for it, and which mark that is; by default, nothing."""
    if not _is_below(test, "tests/unit") or {"slow", "sim"} & {*test.keywords}:
        return ""
    done = _done_by(test)
    return ", ".join(f"{done[what]} {what} without `{mark}`" for what, mark in _MARKS.items() if done[what])


class Doors:
    """A plugin that adds up what the doors of all workers do, and fails a run in which that is above the budget."""

    def __init__(self) -> None:
        self._done: Final[Counter[str]] = Counter()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        if call.when == "teardown" and _is_below(item, "tests/doors"):
            report.user_properties.append((_DEEDS, {"tests": 1, **_done_by(item)}))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "teardown":
            for name, value in report.user_properties:
                if name == _DEEDS and isinstance(value, dict):
                    self._done.update(value)

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if self._above() and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self._done:
            allowed = _budget()["doors"]
            rows = [f"{name} {self._done[name]:.0f} of {most}" for name, most in allowed.items()]
            terminalreporter.write_line(f"the doors: {', '.join(rows)}")
        if above := self._above():
            terminalreporter.write_line(
                f"too much for tests/doors: {', '.join(above)}: take something away, or change tests/budget.toml"
            )

    def _above(self) -> list[str]:
        return [name for name, most in _budget()["doors"].items() if self._done[name] > most]


def quick_loops() -> float:
    """Return the processor time that all files of `make test` may take, as tests/durations.tsv measures it."""
    return _budget()["quick"]["loops"]


def _budget() -> dict[str, dict[str, float]]:
    return tomllib.loads(BUDGET.read_text("utf-8"))


def _is_below(test: pytest.Item, *folders: str) -> bool:
    return any(fnmatch(str(test.path), f"{ROOT}/{folder}/*") for folder in folders)


def _done_by(test: pytest.Item) -> Counter[str]:
    return _DONE - test.stash[_BEFORE]


_counted: Final[set[str]] = set()


def _hear(event: str, _arguments: tuple[Any, ...]) -> None:
    if what := _EVENTS.get(event):
        _DONE[what] += 1


def _count_calls(owner: Any, name: str, what: str) -> None:
    function = getattr(owner, name)

    @wraps(function)
    def counting(*args: Any, **kwargs: Any) -> Any:
        _DONE[what] += 1
        return function(*args, **kwargs)

    setattr(owner, name, counting)


def _count_steps(mujoco: Any) -> None:
    step = mujoco.mj_step

    @wraps(step)
    def counting(model: Any, data: Any, *args: Any, **kwargs: Any) -> None:
        before = data.time
        step(model, data, *args, **kwargs)
        _DONE["simulated_seconds"] += data.time - before

    mujoco.mj_step = counting
