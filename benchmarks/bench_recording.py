"""Measure the cost of a recording: processor time of dance_and_follow on the fake robot, with and without it.

Runs without recording, with `--record`, and with `--record-images` alternate, so that other load of the
machine affects all of them. The start of the processes is not counted.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

import psutil

from tests.support.processes import ComponentProcess, free_endpoint, module

SECONDS: Final = 10.0
ROUNDS: Final = 3
WARM_UP: Final = 3.0


def measure(endpoint: str, options: list[str]) -> float:
    """Return the share of a core that a component takes."""
    command = module("behaviors.dance_and_follow", "--connect", endpoint, *options)
    with ComponentProcess(command) as component:
        time.sleep(WARM_UP)
        process = psutil.Process(component.process.pid)
        before, began = process.cpu_times(), time.perf_counter()
        time.sleep(SECONDS)
        after, ended = process.cpu_times(), time.perf_counter()
    share: float = (after.user + after.system - before.user - before.system) / (ended - began)
    return share


def main() -> None:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS
    endpoint = free_endpoint()
    with (
        tempfile.TemporaryDirectory() as folder,
        ComponentProcess(module("naoserver.fake", "--listen", endpoint)) as server,
    ):
        server.wait_for("ready")
        path = Path(folder, "run.mcap")
        kinds = {
            "without": [],
            "--record": ["--record", str(path)],
            "--record-images": ["--record", str(path), "--record-images"],
        }
        shares: dict[str, list[float]] = {kind: [] for kind in kinds}
        sizes: dict[str, float] = {}
        for _ in range(rounds):
            for kind, options in kinds.items():
                shares[kind].append(measure(endpoint, options))
                if path.exists():
                    sizes[kind] = path.stat().st_size / (SECONDS + WARM_UP) / 1000
                    path.unlink()
    base = statistics.median(shares["without"])
    print(
        f"{'dance_and_follow':<20}{'% of a core':>14}{'more':>10}{'kB/s':>10}   {rounds} x {SECONDS:g} s each"
    )
    for kind, found in shares.items():
        share = statistics.median(found)
        more = "" if kind == "without" else f"{100 * (share - base):+.1f}"
        size = f"{sizes[kind]:.0f}" if kind in sizes else ""
        print(f"{kind:<20}{100 * share:>14.1f}{more:>10}{size:>10}")


if __name__ == "__main__":
    main()
