"""Run `make test` again and again: `again.py TIMES [LOOPS]` says how often it was green, and what it took.

With LOOPS, so many processes count beside it without end, as on a busy machine. `soak/again/` keeps what runs
printed that were not green.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
KEPT: Final = ROOT / "soak" / "again"
LIMIT: Final = 3600.0
"""The longest that a run may take, in s."""


def main(times: str, loops: str = "0") -> int:
    """Run it so many times; return 1 if a run was not green."""
    KEPT.mkdir(parents=True, exist_ok=True)
    green, walls, processors = 0, [], []
    with ExitStack() as stack:
        for _ in range(int(loops)):
            busy = stack.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            stack.callback(busy.kill)
        for run in range(1, int(times) + 1):
            began, spent = time.monotonic(), _processor_time()
            done = subprocess.run(
                ["make", "test"], cwd=ROOT, capture_output=True, text=True, timeout=LIMIT, check=False
            )
            walls.append(time.monotonic() - began)
            processors.append(_processor_time() - spent)
            green += done.returncode == 0
            if done.returncode:
                (KEPT / f"{run}.log").write_text(done.stdout + done.stderr, "utf-8")
            print(
                f"run {run} beside {loops} busy loops: {'green' if done.returncode == 0 else 'RED'}, "
                f"{walls[-1]:.0f} s, {processors[-1]:.0f} s of processor time",
                flush=True,
            )
    print(
        f"green: {green} of {times} beside {loops} busy loops; median {median(walls):.0f} s, "
        f"{median(processors):.0f} s of processor time"
    )
    return int(green < int(times))


def _processor_time() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
