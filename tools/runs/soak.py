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
import signal
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

ROOT: Final = Path(__file__).resolve().parents[2]
KEPT: Final = ROOT / "soak"
RESULTS: Final = ROOT / "benchmarks" / "results" / "soak.md"
LIMIT: Final = 45 * 60.0
"""The longest that a part may take, in s."""
PYTHONS: Final = ("python3.12", "python3.13")
"""Besides the one that runs the other parts; those that are not installed are left out."""
COUNTED: Final = ("tests", "failures", "errors", "skipped")
HEAD: Final = (
    "# The soak",
    "",
    "What `make soak` found when it last ran each of its parts; it writes this page. Times are in minutes.",
    "",
    "| part | passed | failed | skipped | wall | processor | commit | date | machine |",
    "|---|---|---|---|---|---|---|---|---|",
)
FOLDERS: Final = {"unit": 2, "integration": 3, "faults": 2, "e2e": 2}
"""The folders of tests/, and into how many parts their files are divided."""


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


def parts() -> dict[str, list[str]]:
    """Return the commands of all parts."""
    pytest = [sys.executable, "-m", "pytest", "-q", "-n", "logical", "--dist", "worksteal"]
    found = {}
    for folder, count in FOLDERS.items():
        files = sorted(
            path.relative_to(ROOT).as_posix() for path in (ROOT / "tests" / folder).rglob("test_*.py")
        )
        for index in range(count):
            share = files[len(files) * index // count : len(files) * (index + 1) // count]
            found[f"{folder}-{index + 1}"] = [*pytest, *share]
    for python in PYTHONS:
        if subprocess.run([python, "-c", ""], check=False, capture_output=True).returncode == 0:
            environment = f"VENV=.venv/{python}"
            found[python] = ["make", "--no-print-directory", f"PYTHON={python}", environment, "all-tests"]
    return found


def run(part: str, command: list[str], commit: str) -> Result:
    """Run a part to its end or to the limit, and return what came of it."""
    report = KEPT / f"{part}.xml"
    report.unlink(missing_ok=True)
    repeats = {} if part in PYTHONS else {"TEST_SOAK": "1"}
    reported = {"PYTEST_ADDOPTS": f"--junitxml='{report}'"}
    began, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    with (KEPT / f"{part}.log").open("wb") as log:
        child = subprocess.Popen(
            command,
            cwd=ROOT,
            env=os.environ | repeats | reported,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        try:
            child.wait(LIMIT)
        except subprocess.TimeoutExpired:
            print(f"{part} has taken {LIMIT / 60:.0f} min: it is ended")
        finally:
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGTERM)
                child.wait()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    suite = ElementTree.parse(report).getroot().find("testsuite") if report.exists() else None
    counts = (
        {name: int(suite.get(name, 0)) for name in COUNTED}
        if suite is not None
        else dict.fromkeys(COUNTED, 0)
    )
    failed = counts["failures"] + counts["errors"]
    return Result(
        commit,
        datetime.now(UTC).date().isoformat(),
        f"{os.cpu_count()} processors, Python {part[6:] if part in PYTHONS else platform.python_version()}",
        counts["tests"],
        failed or int(child.returncode != 0),  # also if it did not come to its report
        counts["skipped"],
        time.monotonic() - began,
        after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
    )


def current_commit() -> str:
    """Return the short name of the commit, and whether the files differ from it."""
    commit = subprocess.check_output(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, text=True).strip()
    others = f":!{RESULTS.relative_to(ROOT)}"
    changed = subprocess.run(
        ["git", "diff", "--quiet", "HEAD", "--", ".", others], cwd=ROOT, check=False
    ).returncode
    return f"{commit}-changed" if changed else commit


def write_table(results: dict[str, Result]) -> None:
    """Write the results of all parts as a page."""
    rows = [f"| {part} | {result.row} |" for part, result in results.items()]
    RESULTS.write_text("\n".join([*HEAD, *rows, ""]), "utf-8")


def main(*chosen: str) -> int:
    """Run the parts that are left, and return 1 if a test of any part fails."""
    all_parts = parts()
    if unknown := sorted(set(chosen) - set(all_parts)):
        print(f"error: no parts {', '.join(unknown)}; there are {', '.join(all_parts)}", file=sys.stderr)
        return 2
    KEPT.mkdir(exist_ok=True)
    stored = KEPT / "results.json"
    kept = json.loads(stored.read_text("utf-8")) if stored.exists() else {}
    results = {part: Result(**kept[part]) for part in all_parts if part in kept}
    commit = current_commit()
    for part, command in all_parts.items():
        is_left = part not in results or results[part].commit != commit
        if part in chosen or (is_left and not chosen):
            print(f"{part}: see soak/{part}.log", flush=True)
            results[part] = run(part, command, commit)
            print(f"{part}: {results[part].tests} tests, {results[part].failed} failed", flush=True)
            ordered = {each: results[each] for each in all_parts if each in results}
            stored.write_text(json.dumps({each: asdict(result) for each, result in ordered.items()}), "utf-8")
            write_table(ordered)
    return int(any(result.failed for result in results.values()))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
