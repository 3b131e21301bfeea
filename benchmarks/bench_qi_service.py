"""Measure a robot that is served as NAOqi: the duration of calls over libqi, and the rate of images.

The robot runs in a separate process: the fake one or, with --simulated, the one in MuJoCo.

    python benchmarks/bench_qi_service.py [--simulated] [--seconds 5]
"""

from __future__ import annotations

import argparse
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import qi
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from naoserver.body import H25
from naoserver.libqi import start_libqi

ROOT = Path(__file__).resolve().parents[1]
CONSOLE = Console(width=100)
ANYWHERE = "tcp://127.0.0.1:0"
RATE = 30
ASKED_LOST = 0.05
CALLS = 1000


@contextmanager
def robot(simulated: bool) -> Iterator[str]:
    """Serve a robot in another process and yield its address."""
    options = ["naoserver.qi", "--qi", ANYWHERE]
    if simulated:
        options = ["naoserver_sim", "--listen", "tcp/127.0.0.1:0", "--qi", ANYWHERE]
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", *options], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        url = ""
        for line in process.stdout:
            if found := re.search(r"tcp://\S+", line):
                url = found[0]
            if line.startswith("ready"):
                break
        yield url
    finally:
        process.terminate()
        process.wait(30)


def latencies(call: Callable[[], object]) -> tuple[float, float]:
    """Return the median and the 95th percentile of the duration of a call in ms."""
    for _ in range(20):
        call()
    times = []
    for _ in range(CALLS):
        begin = time.perf_counter()
        call()
        times.append((time.perf_counter() - begin) * 1e3)
    return statistics.median(times), statistics.quantiles(times, n=20)[-1]


def pictures(video: qi.Object, seconds: float) -> tuple[float, float]:
    """Return the new images of 640x480 per second, and the share of lost ones."""
    handle = video.subscribeCamera("bench", 0, 2, 11, RATE)
    try:
        video.getImageRemote(handle)
        stamps = set()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            picture = video.getImageRemote(handle)
            stamps.add((picture[4], picture[5]))
            time.sleep(1 / RATE / 8)
    finally:
        video.unsubscribe(handle)
    return len(stamps) / seconds, max(0.0, 1.0 - len(stamps) / seconds / RATE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--simulated", action="store_true", help="the robot in MuJoCo")
    parser.add_argument("--seconds", type=float, default=5.0, help="duration of counting images")
    options = parser.parse_args()
    start_libqi()
    table = Table(title=f"{'simulated' if options.simulated else 'fake'} robot served as NAOqi")
    table.add_column("what")
    table.add_column("asked", justify="right")
    table.add_column("median", justify="right")
    table.add_column("95 %", justify="right")
    with robot(options.simulated) as url:
        session = qi.Session()
        session.connect(url)
        motion, memory = session.service("ALMotion"), session.service("ALMemory")
        keys = [
            f"Device/SubDeviceList/{joint}/{what}/Value"
            for joint in H25.joint_names
            for what in ("Position/Sensor", "Position/Actuator", "Hardness/Actuator", "Temperature/Sensor")
        ]
        for name, call in {
            "getAngles of one joint": lambda: motion.getAngles("HeadYaw", True),
            "getAngles of the body": lambda: motion.getAngles("Body", True),
            "setAngles of the head": lambda: motion.setAngles(["HeadYaw", "HeadPitch"], [0.1, 0.0], 0.1),
            f"getListData of {len(keys)} keys": lambda: memory.getListData(keys),
        }.items():
            median, most = latencies(call)
            table.add_row(name, "", f"{median:.2f} ms", f"{most:.2f} ms")
        rate, lost = pictures(session.service("ALVideoDevice"), options.seconds)
        table.add_row("images of 640x480 per second", f"{RATE}", f"{rate:.1f}", "")
        table.add_row("pictures lost", f"< {ASKED_LOST:.0%}", f"{lost:.1%}", "")
        session.close()
    CONSOLE.print(table)


if __name__ == "__main__":
    main()
