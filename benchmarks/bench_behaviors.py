"""Measure the paper's experiments end to end, with a process for each component, by the robot's camera.

`follow_ball`: the share of images, from the third second on, with the green ball in the middle third of both
axes, on the default waypoints and on three random files. `dance_and_follow`: the times of the state changes,
and the largest tilt of the torso.

    python benchmarks/bench_behaviors.py [--seconds 60] [--only follow|dance]
"""

from __future__ import annotations

import argparse
import math
import random
import signal
import statistics
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from interfaces.hfsm import HfsmMonitorPrx
from interfaces.jderobot import CameraPrx, ImageData
from interfaces.nao import HealthPrx
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import Communicator, initialize

SETTLED = 2.0
"""Seconds until the ball must be in the middle."""


@dataclass(frozen=True)
class Following:
    """How well the head followed."""

    frames: int
    centered: float
    seen: float
    median_error: float
    worst_error: float


def ball_center(image: ImageData) -> tuple[float, float] | None:
    """Return the mean position of clearly green pixels relative to the image center, or None."""
    height, width = image.description.height, image.description.width
    red, green, blue = (
        np.frombuffer(image.pixelData, np.uint8).reshape(height, width, 3).astype(np.int16).transpose(2, 0, 1)
    )
    rows, columns = np.nonzero((green > red + 50) & (green > blue + 50))
    if len(rows) < 20:
        return None
    return float(columns.mean() - (width - 1) / 2), float(rows.mean() - (height - 1) / 2)


def measure_following(communicator: Communicator, seconds: float) -> Following:
    """Watch the camera for a while and evaluate every image after the first two seconds."""
    camera = CameraPrx.checkedCast(communicator.stringToProxy("Camera"))
    errors: list[float] = []
    frames = centered = 0
    sample = camera.getImageData.wait(timeout=5.0)
    start = sample.time
    while sample.time - start < seconds:
        if sample.time - start > SETTLED:
            frames += 1
            center = ball_center(sample.value)
            if center is not None:
                u, v = center
                size = sample.value.description
                centered += abs(u) < size.width / 6 and abs(v) < size.height / 6
                errors.append(math.hypot(u, v))
        sample = camera.getImageData.wait(after=sample, timeout=5.0)
    return Following(
        frames,
        centered / frames,
        len(errors) / frames,
        statistics.median(errors) if errors else math.nan,
        max(errors, default=math.nan),
    )


def random_waypoints(seed: int, path: Path) -> Path:
    """Write waypoints 0.7 to 1.2 m away, within 0.6 rad of straight ahead, 0.3 to 0.7 m high."""
    generator = random.Random(seed)
    lines = ["x,y,z"]
    for _ in range(12):
        distance, yaw = generator.uniform(0.7, 1.2), generator.uniform(-0.6, 0.6)
        lines.append(
            f"{distance * math.cos(yaw):.3f},{distance * math.sin(yaw):.3f},{generator.uniform(0.3, 0.7):.3f}"
        )
    path.write_text("\n".join(lines) + "\n")
    return path


def follow(name: str, seconds: float, waypoints: Path | None) -> None:
    """Run follow_ball on one file of waypoints and print a row."""
    endpoint = free_endpoint()
    with ExitStack() as stack:
        run = stack.enter_context
        run(ComponentProcess(module("naoserver_sim", "--listen", endpoint))).wait_for("ready")
        run(
            ComponentProcess(
                module(
                    "ballmover", "green", *([str(waypoints)] if waypoints else []),
                    "--loop", "--speed", "0.25", "--connect", endpoint,
                )
            )
        )  # fmt: skip
        communicator = run(initialize(connect=[endpoint]))
        run(ComponentProcess(module("behaviors.follow_ball", "--connect", endpoint)))
        HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy("Hfsm.follow_ball")).getSnapshot.wait(
            timeout=15
        )
        result = measure_following(communicator, seconds)
    print(
        f"{name:<22} {result.frames:>6} {result.centered:>8.1%} {result.seen:>7.1%} "
        f"{result.median_error:>8.1f} {result.worst_error:>8.1f}",
        flush=True,
    )


def dance(seconds: float) -> None:
    """Run dance_and_follow and print when its states changed."""
    endpoint = free_endpoint()
    with ExitStack() as stack:
        run = stack.enter_context
        run(ComponentProcess(module("naoserver_sim", "--listen", endpoint))).wait_for("ready")
        for color in ("red", "green"):
            run(ComponentProcess(module("ballmover", color, "--loop", "--connect", endpoint)))
        communicator = run(initialize(connect=[endpoint]))
        run(ComponentProcess(module("behaviors.dance_and_follow", "--connect", endpoint)))
        monitor = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy("Hfsm.dance_and_follow"))
        health = HealthPrx.uncheckedCast(communicator.stringToProxy("Health"))
        sample = monitor.getSnapshot.wait(timeout=15)
        structure = monitor.getStructure()
        names = {(a.id, s.id): f"{a.name}/{s.name}" for a in structure.automata for s in a.states}
        changes: list[tuple[float, str]] = []
        states: dict[int, tuple[int, bool]] = {}
        tilts: list[float] = []
        deadline = time.monotonic() + seconds + 20
        while sample.value.time < seconds and time.monotonic() < deadline:
            for automaton in sample.value.automata:
                state = (automaton.state, automaton.ghost)
                if states.get(automaton.id) != state:
                    states[automaton.id] = state
                    ghost = " (ghost)" if automaton.ghost else ""
                    changes.append((sample.value.time, names[automaton.id, automaton.state] + ghost))
            report = health.getHealth.latest()
            if report is not None:
                tilts.append(report.value.torsoTilt)
            sample = monitor.getSnapshot.wait(after=sample, timeout=5.0)
    for at, name in changes:
        if "follow" not in name.split("/")[-1] or at == changes[0][0] or "/followBall" in name:
            print(f"  {at:8.3f} s  {name}")
    print(f"  largest tilt of the torso: {math.degrees(max(tilts)):.1f} degrees (at most 10)")


def main() -> None:
    """Run the requested measurements."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--only", choices=["follow", "dance"])
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # so that it stops the components
    if arguments.only != "dance":
        print(
            f"{'follow_ball':<22} {'frames':>6} {'centered':>8} {'seen':>7} {'median':>8} {'worst':>8}"
            "  (centered: at least 95 %; errors in pixels)"
        )
        follow("default waypoints", arguments.seconds, None)
        with tempfile.TemporaryDirectory() as folder:
            for seed in (1, 2, 3):
                path = random_waypoints(seed, Path(folder) / f"random{seed}.csv")
                follow(f"random waypoints {seed}", arguments.seconds, path)
    if arguments.only != "follow":
        print("dance_and_follow (root at 10, 20, 30, 40, 50 s within 0.2 s; green at 8 s, red at 26 s)")
        dance(arguments.seconds)


if __name__ == "__main__":
    main()
