"""Run all that `make test` leaves out, and keep what the files of all tests cost: `full.py [PLUGIN...]`.

Names of plug-ins run all tests of these alone.

The tests run beside the linters. Those that fail run once more, each alone in its process: who fails twice is
red, and who passes then is printed last, under *not sure of*, and is to be fixed before anything else.

`tests/durations.tsv` gets the processor time of each file, as measured here and by the last `make test`:
multiples of a fixed loop of Python, in powers of two, and only where the old row is far from what was
measured, so that noise changes no line.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
TIERS: Final = ROOT / ".pytest_cache" / "d" / "tiers"
"""Where a run of the tests leaves its record: tests/support/costs.py."""
JOBS: Final = ("full-units", "full-others", "lint-all", "docs")
"""Targets of the Makefile, of which the first two are tests and leave records of these names."""
MOST_REPEATED: Final = 20
"""If more tests fail, no late moment is the cause."""
DURATIONS: Final = ROOT / "tests" / "durations.tsv"
HEAD: Final = "file\ttier\tloops"
QUICK: Final = "quick"
"""The tier of `make test`, and its record."""
FAR: Final = 0.8
"""So many powers of two is a measurement from its old row before that changes."""


@dataclass(frozen=True)
class Record:
    """What a run of some tests left: the processor time of each file, in loops, and which tests failed."""

    loops: dict[str, float]
    failed: list[str]


def main(*plug_ins: str) -> int:
    """Run everything; return 1 if something failed twice, or a linter once."""
    jobs = ("full-others",) if plug_ins else JOBS
    tiers = [job for job in jobs if job.startswith("full-")]
    for tier in tiers:
        (TIERS / f"{tier}.json").unlink(missing_ok=True)
    chosen = [f"PLUGINS={' '.join(plug_ins)}"] if plug_ins else []
    status = subprocess.run(
        ["make", "--no-print-directory", "--jobs=3", "--keep-going", *jobs, *chosen], cwd=ROOT, check=False
    )
    records = [read_record(tier) for tier in tiers]
    if missing := [tier for tier, record in zip(tiers, records, strict=True) if record is None]:
        print(f"no report of {', '.join(missing)}", file=sys.stderr)
        return 1
    failed = [test for record in records if record for test in record.failed]
    twice = failed if len(failed) > MOST_REPEATED else [test for test in failed if not passes_alone(test)]
    if not plug_ins:
        measured = {QUICK: [read_record(QUICK)], "full": records}
        write_durations({tier: [each for each in found if each] for tier, found in measured.items()})
    for test in twice:
        print(f"failed: {test}")
    if unsure := [test for test in failed if test not in twice]:
        print("not sure of, as they failed once and passed alone in their process:")
        for test in unsure:
            print(f"    {test}")
    return int(bool(twice) or status.returncode != 0)


def read_record(tier: str) -> Record | None:
    """Return what a run of some tests left, or None if it left nothing."""
    path = TIERS / f"{tier}.json"
    return Record(**json.loads(path.read_text("utf-8"))) if path.exists() else None


def passes_alone(test: str) -> bool:
    """Return whether a test passes in a process of its own."""
    print(f"once more, alone: {test}", flush=True)
    return subprocess.run([sys.executable, "-m", "pytest", "-q", test], cwd=ROOT, check=False).returncode == 0


def write_durations(records: Mapping[str, list[Record]]) -> None:
    """Bring the table of processor times up to date with records of tiers; files that are gone lose rows."""
    measured: Counter[tuple[str, str]] = Counter()
    for tier, found in records.items():
        for record in found:
            measured.update({(file, tier): loops for file, loops in record.loops.items()})
    rows = {row: loops for row, loops in read_durations().items() if (ROOT / row[0]).exists()}
    for row, loops in measured.items():
        power = math.log2(max(loops, 1.0))
        if row not in rows or abs(math.log2(rows[row]) - power) > FAR:
            rows[row] = 2 ** round(power)
    lines = [HEAD, *(f"{file}\t{tier}\t{loops}" for (file, tier), loops in sorted(rows.items()))]
    DURATIONS.write_text("\n".join([*lines, ""]), "utf-8")


def read_durations() -> dict[tuple[str, str], int]:
    """Return the processor time of each file in a tier, in loops."""
    lines = DURATIONS.read_text("utf-8").splitlines()[1:] if DURATIONS.exists() else []
    return {(file, tier): int(loops) for file, tier, loops in (line.split("\t") for line in lines)}


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
