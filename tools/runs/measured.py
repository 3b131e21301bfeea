"""Run a command, and print at its end what it cost beside what it may cost.

`measured.py SECONDS PROCESSOR_SECONDS COMMAND...`: how long it may take, and how much processor time. These
are shown, not enforced: the exit status is that of the command, since machines differ.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time


def main(wall: str, processor: str, *command: str) -> int:
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
    )
    print("took", ", ".join(figures), flush=True)
    return status


def _minutes(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02}"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
