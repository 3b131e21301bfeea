"""Measure starts: of a demo, of commands, of a robot of one's own, and of components; and a server's memory.

    python benchmarks/bench_startup.py [--runs 5] [--only demo,help,server,own,component]

Each figure is a median of wall seconds, with the processor seconds of the process beside it where others load
the machine. `demo` is `make demo` in a prepared environment until the robot's head turns; `help` is a command
with `--help`; `server` is `naoserver-sim` until it is ready, and its memory, without a client; `own` is the
same with a robot of 31 links whose meshes have 800,000 triangles, for the first and for the second time;
`component` is a dance until a client that waits for it has its first snapshot. From F5 in the page it is
`bench_run_and_stop.py`.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from interfaces.hfsm import HfsmMonitorPrx
from interfaces.nao import PoseHeadPrx
from tests.support.meshes import cone, write_stl
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import initialize

TURNING: Final = 0.05
"""Speed in rad/s above which the head counts as turning."""
LIMIT: Final = 300.0  # s for each start, on a machine that is loaded
QUIET: Final = 2.0  # s after which the memory of a server is read
LINKS: Final = 31
TRIANGLES: Final = 800_000
INERTIA: Final = {"ixx": 0.01, "iyy": 0.01, "izz": 0.01, "ixy": 0, "ixz": 0, "iyz": 0}
COMMANDS: Final = ("codegen", "nao", "visualhfsm", "naoserver-sim")
DANCE: Final = str(ROOT / "behaviors/dance.py")

Row = tuple[str, Sequence[tuple[float, ...]], str]
"""What was measured, its figures of each run, and how they are shown."""


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


def demo(runs: int) -> Iterator[Row]:
    """Measure the demo."""
    seconds_until_the_head_turns()  # not counted: it prepares the environment if necessary
    waits = [(seconds_until_the_head_turns(),) for _ in range(runs)]
    yield "make demo until the head turns (at most 8 s)", waits, "{:.2f} s"


def help_texts(runs: int) -> Iterator[Row]:
    """Measure commands that print their options."""
    binaries = Path(sys.executable).parent
    commands = {f"{name} --help": [str(binaries / name)] for name in COMMANDS}
    commands |= {"dance.py --help": [sys.executable, DANCE]}
    for name, command in commands.items():
        yield name, [timed([*command, "--help"]) for _ in range(runs)], "{:.2f} s, processor {:.2f} s"


def timed(command: Sequence[str]) -> tuple[float, float]:
    """Run a command; return its wall and processor seconds."""
    start, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True, timeout=LIMIT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return time.monotonic() - start, used


def processor_seconds(pid: int) -> float:
    """Return what a process has used until now."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def served(*options: str) -> Iterator[tuple[int, str]]:
    """Serve a simulated robot; yield its process and endpoint once it is ready."""
    endpoint = free_endpoint()
    with ComponentProcess(module("naoserver_sim", "--listen", endpoint, *options)) as server:
        server.wait_for("^ready", limit=LIMIT)
        yield server.process.pid, endpoint


def started(*options: str) -> tuple[float, float, float, float]:
    """Start a server; return wall and processor seconds until it is ready, and its RSS and PSS in MB."""
    start = time.monotonic()
    with served(*options) as (pid, _):
        waited, used = time.monotonic() - start, processor_seconds(pid)
        time.sleep(QUIET)
        memory = Path(f"/proc/{pid}/smaps_rollup").read_text()
    sizes = dict(re.findall(r"^(\w+): +(\d+) kB$", memory, re.MULTILINE))
    return waited, used, int(sizes["Rss"]) / 1024, int(sizes["Pss"]) / 1024


_SERVER: Final = "{:.2f} s, processor {:.2f} s, RSS {:.0f} MB, PSS {:.0f} MB"


def server(runs: int) -> Iterator[Row]:
    """Measure the server of the simulated Nao."""
    yield "naoserver-sim until it is ready", [started() for _ in range(runs)], _SERVER


def own_robot(runs: int) -> Iterator[Row]:
    """Measure the server of a humanoid that nobody has simulated before, and again."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = str(Path(folder) / "cache")
        model = Path(folder) / "humanoid.urdf"
        write_humanoid(model)
        yield "a humanoid of 800,000 triangles, first start", [started("--body", str(model))], _SERVER
        again = [started("--body", str(model)) for _ in range(runs)]
        yield "a humanoid of 800,000 triangles, second start", again, _SERVER
    del os.environ["XDG_CACHE_HOME"]


def write_humanoid(path: Path) -> None:
    """Write a chain of links, each with a mesh of its own."""
    parts = []
    for number in range(LINKS):
        sides = TRIANGLES // LINKS // 120
        write_stl(path.with_name(f"{number}.stl"), cone(0.05 + 0.001 * number, 0.1, sides=sides, rings=60))
        mesh = f'<geometry><mesh filename="{number}.stl"/></geometry>'
        inertia = " ".join(f'{axis}="{value}"' for axis, value in INERTIA.items())
        mass = f'<inertial><mass value="1"/><inertia {inertia}/></inertial>'
        parts.append(
            f'<link name="l{number}">{mass}<visual>{mesh}</visual><collision>{mesh}</collision></link>'
        )
        if number:
            ends = f'<parent link="l{(number - 1) // 3}"/><child link="l{number}"/>'
            ends += f'<origin xyz="0.2 {number % 3} 0.1"/>'
            limit = '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="50" velocity="5"/>'
            parts.append(f'<joint name="j{number}" type="revolute">{ends}{limit}</joint>')
    path.write_text(f'<robot name="humanoid">{"".join(parts)}</robot>')


def component(runs: int) -> Iterator[Row]:
    """Measure a component, as the page starts one when F5 is pressed."""
    with (
        served() as (_, endpoint),
        initialize(connect=[endpoint], clock="wall") as communicator,
    ):
        monitor = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy("Hfsm.dance"))
        yield (
            "dance.py until its first snapshot",
            [until_its_snapshot(endpoint, monitor) for _ in range(runs)],
            "{:.3f} s, processor {:.3f} s",
        )


def until_its_snapshot(endpoint: str, monitor: HfsmMonitorPrx) -> tuple[float, float]:
    """Start the dance; return wall and processor seconds until the client has a snapshot of it."""
    start, began = time.monotonic(), time.time()
    with ComponentProcess([sys.executable, DANCE, "--connect", endpoint]) as dance:
        snapshot = monitor.getSnapshot.wait(timeout=LIMIT)
        while snapshot.value.startedAt < began:  # of the dance before
            snapshot = monitor.getSnapshot.wait(after=snapshot, timeout=LIMIT)
        return time.monotonic() - start, processor_seconds(dance.process.pid)


MEASURED: Final[dict[str, Callable[[int], Iterator[Row]]]] = {
    "demo": demo,
    "help": help_texts,
    "server": server,
    "own": own_robot,
    "component": component,
}


def main() -> None:
    """Print the median of each figure, and the extremes of the wall time."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--only", default=",".join(MEASURED))
    options = parser.parse_args()
    for name in options.only.split(","):
        for what, figures, shown in MEASURED[name](options.runs):
            medians = [statistics.median(each) for each in zip(*figures, strict=True)]
            walls = [each[0] for each in figures]
            extremes = f"{min(walls):.2f} to {max(walls):.2f} s in {len(figures)} runs"
            print(f"{what}: {shown.format(*medians)}; {extremes}, load {os.getloadavg()[0]:.0f}", flush=True)


if __name__ == "__main__":
    main()
