"""Measure what each pupil in a JupyterHub needs: memory of their processes, and processor time.

Every pupil logs in, opens the page, starts a simulated robot and runs a behavior that looks for a ball in the
pictures of its camera, while the page shows the robot in 3D. `memory` is the proportional set size of all
processes of a pupil (what several share counts in parts), `RSS` counts the whole of it for each process.
The browser is not measured: it runs on the pupil's computer.

    python benchmarks/bench_classroom.py [--pupils 4] [--seconds 10]
"""

from __future__ import annotations

import contextlib
import shutil
import tempfile
import threading
import time
from pathlib import Path
from typing import Final

import psutil
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from benchmarks.common import options
from tests.support.editor import Window
from tests.support.jupyter_hub import Hub, jupyter_hub

ROOT: Final = Path(__file__).resolve().parents[1]
BEHAVIOR: Final = "follow_ball.xml"
START: Final = 90.0  # s within which a robot must be there


class Pupil:
    """A pupil with the page open."""

    def __init__(self, hub: Hub, name: str, open_things: contextlib.ExitStack) -> None:
        self.login: Final = hub.login(name)
        self._hub = hub
        self._open = open_things
        shutil.copy(ROOT / "behaviors" / BEHAVIOR, self.login.home)

    def open_page(self) -> None:
        """Open the page, which starts the editor."""
        self.login.get(f"{self.login.path}visualhfsm/")
        self.window = Window(self._socket("ws"))
        self.window.ask("hello")

    def start_robot(self) -> None:
        """Start a simulated robot and show it in 3D."""
        self.window.ask("simulate", world="balls")
        deadline = time.monotonic() + START
        while not any(push.get("status") == "present" for push in self.window.pushes):
            assert time.monotonic() < deadline, "no robot"
            self.window.ask("listFiles")
            time.sleep(0.2)
        poses = self._socket("poses")
        viewer = threading.Thread(target=_watch, args=(poses,), daemon=True)
        viewer.start()

    def run(self) -> None:
        """Run the behavior and follow it."""
        tab = self.window.ask("open", path=BEHAVIOR)["tab"]
        self.window.ask("start", tab=tab)
        self.window.wait_for_push("started", tab=tab, status="started")

    def processes(self) -> list[psutil.Process]:
        """Return the Jupyter server and all below it."""
        return self._hub.processes(self.login.name)

    def _socket(self, path: str) -> ClientConnection:
        return self._open.enter_context(self.login.socket(f"{self.login.path}visualhfsm/{path}"))


def _watch(poses: ClientConnection) -> None:
    """Take frames as a page does that draws 60 times a second at most."""
    with contextlib.suppress(ConnectionClosed):
        for _ in poses:
            time.sleep(1 / 60)
            poses.send("drawn")


def _cpu(processes: list[psutil.Process]) -> float:
    total = 0.0
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            times = process.cpu_times()
            total += times.user + times.system
    return total


def _measure(what: str, pupils: list[Pupil], hub: psutil.Process, seconds: float) -> None:
    """Print a row of the table, after the processes have settled."""
    time.sleep(3)
    everything = [process for pupil in pupils for process in pupil.processes()]
    common = [hub, *(each for each in hub.children() if each not in everything)]
    before, before_common = _cpu(everything), _cpu(common)
    time.sleep(seconds)
    share, share_common = _cpu(everything) - before, _cpu(common) - before_common
    pss = rss = 0
    for process in everything:
        with contextlib.suppress(psutil.NoSuchProcess):
            memory = process.memory_full_info()
            pss, rss = pss + memory.pss, rss + memory.rss
    count = len(pupils)
    print(
        f"| {what} | {pss / count / 1e6:.0f} MB | {rss / count / 1e6:.0f} MB | "
        f"{100 * share / seconds / count:.0f} % | {100 * share_common / seconds:.0f} % |",
        flush=True,
    )


def main() -> None:
    """Print a table."""
    given = options(__doc__, pupils=4, seconds=10.0)
    print(f"{given.pupils} pupils; each, and at the end the hub with its proxy:\n")
    print("| | memory | RSS | processor | hub |\n|---|---|---|---|---|", flush=True)
    with (
        tempfile.TemporaryDirectory() as folder,
        jupyter_hub(Path(folder), cameras=True) as hub,
        contextlib.ExitStack() as open_things,
    ):
        pupils = [Pupil(hub, f"pupil{number}", open_things) for number in range(given.pupils)]
        process = psutil.Process(hub.process.process.pid)
        _measure("Jupyter alone", pupils, process, given.seconds)
        for what, step in (
            ("the editor's page open", Pupil.open_page),
            ("a simulated robot, shown in 3D", Pupil.start_robot),
            ("a behavior that looks through its camera", Pupil.run),
        ):
            for pupil in pupils:
                step(pupil)
            _measure(what, pupils, process, given.seconds)


if __name__ == "__main__":
    main()
