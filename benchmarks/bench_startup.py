"""Measure the time from `make demo` in a prepared environment until the robot's head turns.

python benchmarks/bench_startup.py [--runs 5]
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from interfaces.nao import PoseHeadPrx
from tests.support.processes import ComponentProcess
from zenoh_ice import initialize

TURNING = 0.05
"""Speed in rad/s above which the head counts as turning."""


def seconds_until_the_head_turns() -> float:
    """Start the demo once; return the wall seconds until the stream of the head shows that it turns."""
    start = time.monotonic()
    with ComponentProcess(["make", "--no-print-directory", "demo"]) as demo:
        endpoint = demo.wait_for(r"endpoint (tcp/[\w.:-]+)")[1]
        with initialize(connect=[endpoint], clock="wall") as communicator:
            head = PoseHeadPrx.uncheckedCast(communicator.stringToProxy("Head"))
            pose = head.getPose.wait(timeout=30)
            while max(abs(pose.value.panSpeed), abs(pose.value.tiltSpeed)) < TURNING:
                pose = head.getPose.wait(after=pose, timeout=30)
            waited = time.monotonic() - start
        os.killpg(
            demo.process.pid, signal.SIGINT
        )  # like Ctrl-C in a terminal: make itself does not forward it
        demo.wait()
    return waited


def main() -> None:
    """Print the median and the extremes."""
    parser = argparse.ArgumentParser(description=re.sub(r"\n.*", "", __doc__ or ""))
    parser.add_argument("--runs", type=int, default=5)
    seconds_until_the_head_turns()  # not counted: it prepares the environment if necessary
    waits = [seconds_until_the_head_turns() for _ in range(parser.parse_args().runs)]
    print(
        f"make demo until the head turns: median {statistics.median(waits):.1f} s, "
        f"{min(waits):.1f} to {max(waits):.1f} s in {len(waits)} runs (at most 8 s)"
    )


if __name__ == "__main__":
    main()
