"""Run a command, and print at its end what it cost beside what it may cost.

`measured.py SECONDS PROCESSOR_SECONDS MEGABYTES COMMAND...`: how long it may take, how much processor
time, and the size of its largest process. They are shown, not enforced: the exit status is the command's,
since machines differ.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from typing import Final

MEGABYTE: Final = 1024
"""In KiB, in which Linux counts."""


def main(wall: str, processor: str, memory: str, *command: str) -> int:
    """Run the command and return its exit status."""
    began = time.monotonic()
    try:
        status = subprocess.run(command, check=False).returncode
    except KeyboardInterrupt:
        status = 130
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    figures = (
        f"{_minutes(time.monotonic() - began)} min of {_minutes(float(wall))}",
        f"processor time {_minutes(spent.ru_utime + spent.ru_stime)} min of {_minutes(float(processor))}",
        f"largest process {spent.ru_maxrss / MEGABYTE:.0f} MB of {memory}",
    )
    print("took", ", ".join(figures), flush=True)
    return status


def _minutes(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02}"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
