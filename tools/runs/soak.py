"""Run the tests with all repetitions, in parts: `soak.py [PART...]`, by default all parts that are left.

A part has ended within 45 minutes, and is not run again at the same commit: after an interruption, the same
command goes on with the next part. `soak/` keeps the output of each part, and benchmarks/results/soak.md the
results of all. Parts of other Pythons run where PATH has them.
"""

from __future__ import annotations

import json
import os
import platform
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

ROOT: Final = Path(__file__).resolve().parents[2]
LIMIT: Final = 45 * 60.0
"""The longest that a part may take, in s."""
END_LIMIT: Final = 30.0
"""How long a part that is ended may take for it, in s, before it is killed."""
FOLDERS: Final = {"doors": 1, "unit": 2, "integration": 3, "faults": 2, "e2e": 2}
"""The folders of tests/, and into how many parts their files are divided; each plug-in is one part."""
PYTHONS: Final = ("python3.12", "python3.13")
"""Besides the one that runs the other parts; those that are not installed are left out."""
COUNTED: Final = ("tests", "failures", "errors", "skipped")
"""What a report of pytest counts."""
HEAD: Final = (
    "# The soak",
    "",
    "What `make soak` found when it last ran each of its parts; it writes this page. Times are in minutes.",
    "",
    "| part | passed | failed | skipped | wall | processor | commit | date | machine |",
    "|---|---|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True)
class Result:
    """What came of a part: counts of tests, and times in s."""

    commit: str
    date: str
    machine: str
    tests: int
    failed: int
    skipped: int
    seconds: float
    processor: float

    @property
    def row(self) -> str:
        """The cells of its row in the table."""
        passed = self.tests - self.failed - self.skipped
        wall, processor = (f"{seconds / 60:.1f}" for seconds in (self.seconds, self.processor))
        cells = (passed, self.failed, self.skipped, wall, processor, self.commit, self.date, self.machine)
        return " | ".join(map(str, cells))


class Soak:
    """Parts, by name, each a command that runs pytest, and their results, kept in a folder and on a page."""

    def __init__(
        self, parts: Mapping[str, list[str]], folder: Path, page: Path, commit: str, limit: float = LIMIT
    ) -> None:
        self._parts: Final = parts
        self._folder: Final = folder
        self._page: Final = page
        self._commit: Final = commit
        self._limit: Final = limit
        self._stored: Final = folder / "results.json"
        folder.mkdir(exist_ok=True)
        kept = json.loads(self._stored.read_text("utf-8")) if self._stored.exists() else {}
        self.results: Final = {part: Result(**kept[part]) for part in parts if part in kept}

    def left(self) -> list[str]:
        """Return the parts that have not run at this commit."""
        done = {part for part, result in self.results.items() if result.commit == self._commit}
        return [part for part in self._parts if part not in done]

    def run(self, chosen: Iterable[str]) -> None:
        """Run some parts, and keep the result of each as soon as there is one."""
        for part in chosen:
            print(f"{part}: see {self._folder.name}/{part}.log", flush=True)
            result = self.results[part] = self._run_part(part)
            print(f"{part}: {result.tests} tests, {result.failed} failed", flush=True)
            ordered = {each: self.results[each] for each in self._parts if each in self.results}
            self._stored.write_text(json.dumps({each: asdict(result) for each, result in ordered.items()}))
            rows = [f"| {each} | {result.row} |" for each, result in ordered.items()]
            self._page.write_text("\n".join([*HEAD, *rows, ""]), "utf-8")

    def _run_part(self, part: str) -> Result:
        report = self._folder / f"{part}.xml"
        report.unlink(missing_ok=True)
        repeats = {} if part in PYTHONS else {"TEST_SOAK": "1"}
        environment = os.environ | repeats | {"PYTEST_ADDOPTS": f"--junitxml='{report}'"}
        began, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
        with (self._folder / f"{part}.log").open("wb") as log:
            child = subprocess.Popen(
                self._parts[part], cwd=ROOT, env=environment, stdout=log, stderr=log, start_new_session=True
            )
            try:
                child.wait(self._limit)
            except subprocess.TimeoutExpired:
                print(f"{part} has taken {self._limit / 60:.0f} min: it is ended", flush=True)
            finally:
                if child.poll() is None:
                    _end_group(child)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        tests, failures, errors, skipped = _counts(report)
        python = part[6:] if part in PYTHONS else platform.python_version()
        return Result(
            self._commit,
            datetime.now(UTC).date().isoformat(),
            f"{os.cpu_count()} processors, Python {python}",
            tests,
            failures + errors or int(child.returncode != 0),  # also if it did not come to its report
            skipped,
            time.monotonic() - began,
            after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        )


def _end_group(child: subprocess.Popen[bytes]) -> None:
    """End a process that leads a group with all of the group, those that ignore SIGTERM too."""
    os.killpg(child.pid, signal.SIGTERM)
    try:
        child.wait(END_LIMIT)
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()


def _counts(report: Path) -> list[int]:
    suite = ElementTree.parse(report).getroot().find("testsuite") if report.exists() else None
    return [0 if suite is None else int(suite.get(name, "0")) for name in COUNTED]


def all_parts() -> dict[str, list[str]]:
    """Return the command of each part."""
    pytest = [sys.executable, "-m", "pytest", "-q", "-n", "logical", "--dist", "worksteal"]
    found = {}
    for folder, count in FOLDERS.items():
        paths = sorted((ROOT / "tests" / folder).rglob("test_*.py"))
        files = [path.relative_to(ROOT).as_posix() for path in paths]
        for index in range(count):
            share = files[len(files) * index // count : len(files) * (index + 1) // count]
            found[f"{folder}-{index + 1}"] = [*pytest, *share]
    for plug_in in sorted(path.parent for path in ROOT.glob("plugins/*/pyproject.toml")):
        found[plug_in.name] = [*pytest, (plug_in / "tests").relative_to(ROOT).as_posix()]
        found[f"without-{plug_in.name}"] = [sys.executable, "tools/runs/without.py", plug_in.name]
    found["without-plug-ins"] = [sys.executable, "tools/runs/without.py"]
    for python in PYTHONS:
        if _is_installed(python):
            environment = [f"PYTHON={python}", f"VENV=.venv/{python}"]
            found[python] = ["make", "--no-print-directory", *environment, "test", "test-all"]
    return found


def _is_installed(python: str) -> bool:
    # pyenv has commands of all its versions: those of versions that are not chosen fail.
    command = shutil.which(python)
    if command is None:
        return False
    return subprocess.run([command, "-c", ""], check=False, capture_output=True).returncode == 0


def current_commit(written: Path) -> str:
    """Return the short name of the commit, and whether any file but `written` differs from it."""
    commit = subprocess.check_output(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, text=True).strip()
    differs = ["git", "diff", "--quiet", "HEAD", "--", ".", f":!{written.relative_to(ROOT)}"]
    changed = subprocess.run(differs, cwd=ROOT, check=False).returncode
    return f"{commit} with changes" if changed else commit


def main(*chosen: str) -> int:
    """Run the parts that are left or those that are named; return 1 if a test of any part failed."""
    parts, page = all_parts(), ROOT / "benchmarks" / "results" / "soak.md"
    if unknown := sorted(set(chosen) - set(parts)):
        print(f"error: no parts {', '.join(unknown)}; there are {', '.join(parts)}", file=sys.stderr)
        return 2
    soak = Soak(parts, ROOT / "soak", page, current_commit(page))
    soak.run(chosen or soak.left())
    return int(any(result.failed for result in soak.results.values()))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
