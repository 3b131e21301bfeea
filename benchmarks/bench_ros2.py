"""Measure our ROS 2 node beside genuine rclpy: calls, a stream each way, and images, in one run.

Both sides of each pair are processes on this machine, with the same messages, pair after pair: ours over
Zenoh (TCP on loopback), rclpy over Fast DDS (loopback and shared memory, its default). Without the peers,
which `make ros-peers` installs, only ours are measured.

    python benchmarks/bench_ros2.py [--quick] [calls] [stream] [array] [image] [large]
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.support.ports import free_port  # noqa: E402
from tests.support.ros_peers import peers_folder  # noqa: E402

ROUNDS = 5
TASKS = {"calls": 2000, "stream": 10_000, "array": 600, "image": 600, "large": 200}
NAMES = {
    "calls": "call of a service, 3 strings",
    "stream": "100 Hz each way, /clock",
    "array": "30 Hz, 115,200 int64 (921,600 bytes)",
    "image": "30 Hz, sensor_msgs/Image, 640x480 rgb8",
    "large": "10 Hz, sensor_msgs/Image, 1280x960 rgb8",
}


def measure(library: str, task: str, number: int) -> list[dict[str, Any]]:
    """Run both sides of a task; return the figures of each."""
    python = sys.executable if library == "ours" else str(peers_folder() / "bin" / "python")
    port = str(free_port())
    environment = os.environ | {"PYTHONPATH": str(ROOT), "ROS_LOCALHOST_ONLY": "1"}
    script = str(ROOT / "benchmarks" / "ros2_node.py")
    sides = [
        subprocess.Popen(
            [python, script, library, task, side, str(number), port],
            env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        for side in "ab"
    ]  # fmt: skip
    try:
        first, errors = sides[0].communicate(timeout=900)
        second, more = sides[1].communicate(timeout=900)
    finally:
        for each in sides:
            each.kill()
    found = [
        [json.loads(line) for line in text.splitlines() if line.startswith("{")] for text in (first, second)
    ]
    if not all(found):
        raise SystemExit(f"{library}, {task}: {errors}{more}")
    return [each[-1] for each in found]


def row(library: str, task: str, sides: list[dict[str, Any]]) -> dict[str, float]:
    """Print a line of the table; return its figures."""
    ages = sorted(age for each in sides for age in each.get("ages", ()))
    sent, received = (sum(each.get(name, 0) for each in sides) for name in ("sent", "received"))
    median, late = (
        (ages[int(len(ages) * part)] / 1e6 for part in (0.5, 0.99)) if ages else (float("nan"),) * 2
    )
    lost = f"{sent - received} of {sent}" if sent else "-"
    processor = sum(each["processor"] for each in sides)
    print(f"| {NAMES[task]} | {library} | {median:.2f} | {late:.2f} | {lost} | {processor:.1f} |", flush=True)
    return {"median": median, "99 %": late, "processor": processor}


def main() -> None:
    share = 10 if "--quick" in sys.argv else 1
    chosen = [task for task in TASKS if task in sys.argv] or [*TASKS]
    genuine = (peers_folder() / "bin" / "python").exists()
    if not genuine:
        print(f"genuine rclpy is not in {peers_folder()}: make ros-peers installs it\n")
    print("| what | library | median, ms | 99 %, ms | lost | processor, s |\n|---|---|---|---|---|---|")
    ratios = []
    for task in chosen:
        libraries = ["ours", "rclpy"] if genuine else ["ours"]
        found: dict[str, list[dict[str, Any]]] = {library: [] for library in libraries}
        for _ in range(ROUNDS):  # in turn, since a machine is busier at some times than at others
            for library in libraries:
                found[library] += measure(library, task, TASKS[task] // ROUNDS // share)
        ours, *theirs = (row(library, task, sides) for library, sides in found.items())
        ratios += [
            f"{NAMES[task]}: " + ", ".join(f"{k} {ours[k] / each[k]:.2f}" for k in ours) for each in theirs
        ]
    if ratios:
        print("\nours : rclpy (below 1 is less)\n" + "\n".join(f"- {each}" for each in ratios))


if __name__ == "__main__":
    main()
