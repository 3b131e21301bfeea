"""Serve model files of others by one line each, and say what becomes of them.

    python benchmarks/bench_own_robots.py --public ~/robots   # those of public_robots.tsv, cloned there
    python benchmarks/bench_own_robots.py arm.urdf ~/models   # files, and all model files of folders

Each file is given to `naoserver-sim --body FILE`, without anything else, in a process of its own. It is
served if the server is ready within a minute. Then, in the robot's time, it is left alone for six seconds:
it stays if it neither sinks nor goes on moving. Each joint with a motor is moved by 0.2 rad or 5 cm, or by
half of its range, one after the other, and has moved when it has gone half of that way.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import psutil
from rich.console import Console

from interfaces.nao import DescriptionPrx, GroundTruthPrx, JointsPrx, Vector3
from tests.support.ports import free_port
from zenoh_ice import Communicator, initialize

PUBLIC: Final = Path(__file__).with_name("public_robots.tsv")
MODELS: Final = (".urdf", ".xacro", ".xml", ".mjcf")
READY: Final = 60.0
"""Wall seconds for a server to be ready."""
ALONE: Final = 6.0
"""Robot seconds for which it is left alone."""
STEP: Final = {False: 0.2, True: 0.05}
"""How far a joint is moved in rad, or, if it slides, in m."""
MOVED: Final = 0.5
"""Share of the way that counts as moved."""
REACHED: Final = 3.0
"""Robot seconds in which a joint goes its way."""
SUNK: Final = 0.3
"""Meters below its start at which a robot that nothing holds is found after a while, and others are not."""
STILL: Final = 0.02
"""Largest change of its place in m in two seconds, of a robot that lies or stands still."""
CONSOLE: Final = Console(width=160)


@dataclass(frozen=True)
class Outcome:
    """What became of a file."""

    file: str
    error: str = ""
    seconds: float = 0.0
    """Wall seconds until the server was ready, or had refused the file."""
    megabytes: int = 0
    """Most memory of the server."""
    height: float = 0.0
    """How much higher its root is after it was left alone, in m."""
    drift: float = 0.0
    """How far its root moved in the last two of these seconds, in m."""
    joints: int = 0
    """Joints with a motor."""
    moved: int = 0
    shapes: int = 0
    """Visible shapes, or else contact shapes."""
    said: tuple[str, ...] = ()
    """What the server said before it was ready."""

    @property
    def stays(self) -> bool:
        """Whether it stood or lay still when it was left alone."""
        return not self.error and self.height > -SUNK and self.drift < STILL


class Server:
    """A server of one file, ended at the end of a `with` block."""

    def __init__(self, file: Path) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        command = ["-m", "naoserver_sim", "--body", str(file), "--listen", self.endpoint, "--speed", "max"]
        self._process = subprocess.Popen(
            [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self._watched = psutil.Process(self._process.pid)
        self.said: list[str] = []
        self.megabytes = 0

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def wait(self) -> str:
        """Wait until it is ready; return why it is not, or nothing."""
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdout.fileno(), False)
        text, end = "", time.monotonic() + READY
        while time.monotonic() < end:
            self.look()
            with suppress(TypeError):  # nothing to read yet
                text += self._process.stdout.read()
            self.said = text.splitlines()
            if any(line.startswith("ready") for line in self.said):
                return ""
            if self._process.poll() is not None:
                text += self._process.stdout.read() or ""
                self.said = text.splitlines()
                return text.strip() or f"it ended with {self._process.returncode}"
            time.sleep(0.05)
        return f"not ready within {READY:g} s"

    def look(self) -> None:
        """Note how much memory it has."""
        with suppress(psutil.NoSuchProcess):
            self.megabytes = max(self.megabytes, self._watched.memory_info().rss >> 20)


def tried(file: Path) -> Outcome:
    """Return what becomes of a file."""
    began = time.monotonic()
    with Server(file) as server:
        error = server.wait()
        outcome = Outcome(
            str(file), error, time.monotonic() - began, server.megabytes, said=tuple(server.said)
        )
        if error:
            return outcome
        try:
            with initialize(connect=[server.endpoint], clock="wall") as communicator:
                outcome = observed(communicator, outcome)
        except Exception as problem:  # noqa: BLE001 - whatever a robot does is an outcome
            return replace(outcome, error=f"{type(problem).__name__}: {problem}")
        server.look()
        return replace(outcome, megabytes=server.megabytes)


def observed(communicator: Communicator, outcome: Outcome) -> Outcome:
    """Return what becomes of a robot that is served."""
    joints = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
    truth = GroundTruthPrx.checkedCast(communicator.stringToProxy("GroundTruth"))
    description = DescriptionPrx.checkedCast(communicator.stringToProxy("Description"))
    assert joints is not None
    assert truth is not None
    assert description is not None
    body, looks = json.loads(description.getBody()), description.getLooks()
    seen = len(json.loads(looks).get("shapes", ())) if looks else 0

    def later(seconds: float) -> Vector3:
        """Return the truth after some robot seconds."""
        end, limit = truth.getGroundTruth().time + seconds, time.monotonic() + READY
        while (reading := truth.getGroundTruth()).time < end:
            if time.monotonic() > limit:
                raise TimeoutError(f"its time stands still at {reading.time:g} s")
            time.sleep(0.01)
        return reading.torso.position

    first, before = later(0.0), later(ALONE - 2.0)
    after = later(2.0)
    drift = sum((getattr(after, axis) - getattr(before, axis)) ** 2 for axis in "xyz") ** 0.5
    driven = [joint for joint in body["joints"] if joint["max_torque"] > 0.0]
    driven = [joint for joint in driven if joint["name"] not in followers(body)]
    names = list(joints.getJointNames())
    moved = 0
    for joint in driven:
        at = names.index(joint["name"])
        start = joints.getJointState().positions[at]
        lower, upper = joint.get("lower", -100.0), joint.get("upper", 100.0)
        step = min(STEP[joint["sliding"]], (upper - lower) / 2)
        target = start + step if start + step <= upper else start - step
        with suppress(Exception):
            joints.setJointPositions({joint["name"]: target}, 1.0)
            limit = truth.getGroundTruth().time + REACHED
            while truth.getGroundTruth().time < limit:
                gone = abs(joints.getJointState().positions[at] - start)
                if gone >= MOVED * step:
                    moved += 1
                    break
                time.sleep(0.005)
            joints.setJointPositions({joint["name"]: min(max(start, lower), upper)}, 1.0)
    return replace(
        outcome,
        height=after.z - first.z,
        drift=drift,
        joints=len(driven),
        moved=moved,
        shapes=seen or len(body["shapes"]),
    )


def followers(body: dict[str, Any]) -> set[str]:
    """Return the joints that another one drives."""
    return {coupling["follower"] for coupling in body["couplings"]}


def models(places: Iterable[Path]) -> Iterator[Path]:
    """Yield the files, and the model files of the folders that have at least one joint."""
    for place in places:
        if place.is_file():
            yield place
        else:
            yield from (
                path for path in sorted(place.rglob("*")) if path.suffix in MODELS and has_joints(path)
            )


def has_joints(path: Path) -> bool:
    """Return whether a file is a model with a joint, and no part that others include."""
    try:
        root = ET.parse(path).getroot()
    except (ET.ParseError, OSError):
        return False
    if root.tag == "robot":
        kinds = {joint.get("type") for joint in root.findall("joint")}
        return not kinds.isdisjoint({"revolute", "continuous", "prismatic"})
    return root.tag == "mujoco" and root.find("worldbody//joint") is not None


def public(folder: Path) -> dict[Path, str]:
    """Clone the repositories that are not there yet; return their models, and what they are called."""
    found = {}
    with PUBLIC.open(encoding="utf-8", newline="") as lines:
        for row in csv.DictReader(lines, delimiter="\t"):
            place = folder / row["repository"].rpartition("/")[2]
            if not place.exists():
                url = f"https://github.com/{row['repository']}"
                subprocess.run(["git", "clone", "--quiet", "--depth", "1", url, str(place)], check=True)
            found[place / row["file"]] = row["robot"]
    return found


def row_of(name: str, outcome: Outcome) -> str:
    """Return the row of a robot in the table of plugins/own_robots/docs/own-robot.md."""
    if outcome.error:
        return f"| {name} | {outcome.error.splitlines()[-1]} |"
    return (
        f"| {name} | {outcome.moved} of {outcome.joints}{'' if outcome.stays else ', and it does not stay'} |"
    )


def main() -> None:
    """Try the files that the command line names."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("places", nargs="*", type=Path, help="files and folders")
    parser.add_argument(
        "--public", type=Path, metavar="FOLDER", help="try those of public_robots.tsv, cloned here"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all outcomes there")
    options = parser.parse_args()
    listed = public(options.public) if options.public else {}
    files = [*models(options.places), *listed]
    outcomes = []
    for file in files:
        outcome = tried(file)
        outcomes.append(outcome)
        said = f"[red]{outcome.error.splitlines()[-1]}[/]" if outcome.error else "served"
        CONSOLE.print(f"{file}: {said}, {outcome.seconds:.1f} s, {outcome.megabytes} MB", highlight=False)
        if not outcome.error:
            stays = (
                "stays" if outcome.stays else f"[red]{outcome.height:+.2f} m, drifts {outcome.drift:.3f} m[/]"
            )
            CONSOLE.print(
                f"    {stays}, {outcome.moved} of {outcome.joints} joints move, {outcome.shapes} shapes",
                highlight=False,
            )
        if options.json:
            options.json.write_text(json.dumps([asdict(each) for each in outcomes], indent=1))
    if listed:
        print("| robot | joints that went where they were sent |\n|---|---|")
        for outcome in outcomes:
            if name := listed.get(Path(outcome.file)):
                print(row_of(name, outcome))
    served = [outcome for outcome in outcomes if not outcome.error]
    move = sum(outcome.moved >= 0.9 * outcome.joints for outcome in served)
    CONSOLE.print(
        f"{len(served)} of {len(outcomes)} served, {sum(each.stays for each in served)} stay, "
        f"of {move} at least nine of ten joints move"
    )


if __name__ == "__main__":
    main()
