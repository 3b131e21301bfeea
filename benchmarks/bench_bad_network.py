"""Measure whether `nao stop`, as a new process, stops a robot over a network that delays and loses packets.

Needs root on Linux. Two network namespaces are joined by a switch in this program: it delays each packet and
drops some, each way, with a seed. In one are a router with TLS and roles and a fake robot, as in a lab; in
the other a new process of `nao stop` runs again and again. Everything ends with the program.
"""

from __future__ import annotations

import argparse
import ctypes
import fcntl
import heapq
import os
import random
import select
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Final

from nao_tools._security.folder import SecurityFolder
from tests.support.processes import ComponentProcess, module

ROBOT: Final = "10.78.0.1"
PERSON: Final = "10.78.0.2"
PORT: Final = 7447
GOAL: Final = 10.0  # s
LONGEST: Final = 40.0  # s of one command

_TUNSETIFF: Final = 0x400454CA  # of linux/if_tun.h
_TUN_WITHOUT_HEADER: Final = 0x1001
_CLONE_NEWNET: Final = 0x40000000  # of linux/sched.h
_LARGEST_PACKET: Final = 2048


class Switch:
    """A thread that passes packets between two network devices, later or not at all."""

    def __init__(self, first: int, second: int, *, delay: float, loss: float, seed: int) -> None:
        self._ends: Final = {first: second, second: first}
        self._delay: Final = delay
        self._loss: Final = loss
        self._random: Final = random.Random(seed)
        self._ended = threading.Event()
        self._thread: Final = threading.Thread(target=self._run, name="switch")
        self._thread.start()

    def close(self) -> None:
        """End the thread and the devices."""
        self._ended.set()
        self._thread.join()
        for end in self._ends:
            os.close(end)

    def _run(self) -> None:
        waiting: list[tuple[float, int, int, bytes]] = []
        number = 0
        while not self._ended.is_set():
            left = waiting[0][0] - time.monotonic() if waiting else 0.05
            ready, _, _ = select.select(list(self._ends), [], [], min(max(left, 0.0), 0.05))
            for end in ready:
                number += 1
                packet = os.read(end, _LARGEST_PACKET)
                if self._random.random() >= self._loss:
                    heapq.heappush(waiting, (time.monotonic() + self._delay, number, self._ends[end], packet))
            while waiting and waiting[0][0] <= time.monotonic():
                _, _, end, packet = heapq.heappop(waiting)
                os.write(end, packet)


def device(namespace: str, address: str) -> int:
    """Make a network device in a namespace; return the descriptor that reads and writes its packets."""
    libc = ctypes.CDLL(None, use_errno=True)
    here = os.open("/proc/thread-self/ns/net", os.O_RDONLY)
    there = os.open(f"/run/netns/{namespace}", os.O_RDONLY)
    try:
        if libc.setns(there, _CLONE_NEWNET):
            raise OSError(ctypes.get_errno(), f"cannot enter the network namespace {namespace}")
        end = os.open("/dev/net/tun", os.O_RDWR)
        fcntl.ioctl(end, _TUNSETIFF, struct.pack("16sH", b"bad0", _TUN_WITHOUT_HEADER))
        for words in (f"addr add {address}/24 dev bad0", "link set bad0 up mtu 1400", "link set lo up"):
            subprocess.run(["ip", *words.split()], check=True)
        return end
    finally:
        libc.setns(here, _CLONE_NEWNET)
        os.close(there)
        os.close(here)


@contextmanager
def bad_network(delay: float, loss: float, seed: int) -> Iterator[tuple[list[str], list[str]]]:
    """Join two namespaces; yield the beginnings of commands that run in the robot's and in the person's."""
    names = [f"{side}{os.getpid()}" for side in ("robot", "person")]
    with ExitStack() as end:
        for name in names:
            subprocess.run(["ip", "netns", "add", name], check=True)
            end.callback(subprocess.run, ["ip", "netns", "del", name], check=True)
        ends = [device(name, address) for name, address in zip(names, (ROBOT, PERSON), strict=True)]
        end.callback(Switch(*ends, delay=delay, loss=loss, seed=seed).close)
        yield ["ip", "netns", "exec", names[0]], ["ip", "netns", "exec", names[1]]


@contextmanager
def lab(folder: Path, within: list[str]) -> Iterator[None]:
    """Run a router with TLS and roles, and a fake robot, in a namespace."""
    keys = SecurityFolder(folder)
    keys.create(realm="nao", hosts=[ROBOT], port=PORT, valid=timedelta(days=1))
    router = [*within, *module("nao_tools", "router", "--config", f"{folder}/router.toml")]
    robot = [*within, *module("naoserver.fake", "--config", f"{folder}/robot.toml")]
    with ComponentProcess(router) as routing:
        routing.wait_for("listens on")
        with ComponentProcess(robot) as serving:
            serving.wait_for("^ready")
            yield


def stop(within: list[str], settings: Path) -> tuple[float, int, str]:
    """Run `nao stop` once; return how long it took in s, its exit code and its last line."""
    began = time.monotonic()
    command = [*within, *module("nao_tools", "stop", "--config", str(settings))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    lines = (done.stderr + done.stdout).splitlines()
    return time.monotonic() - began, done.returncode, lines[-1] if lines else ""


def main() -> None:
    """Measure and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--delay", type=float, default=0.2, help="s, each way")
    parser.add_argument("--loss", type=float, default=0.05, help="fraction of the packets lost, each way")
    parser.add_argument("--stops", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--user", default="operator", help="whose certificate is used")
    options = parser.parse_args()
    took: list[float] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        bad_network(options.delay, options.loss, options.seed) as (robot, person),
        lab(Path(folder, "keys"), robot),
    ):
        for number in range(1, options.stops + 1):
            seconds, code, text = stop(person, Path(folder, "keys", f"{options.user}.toml"))
            print(f"{number:3}  {seconds:5.2f} s  exit code {code}  {text}", flush=True)
            if code == 0:
                took.append(seconds)
    if not took:
        sys.exit(f"none of {options.stops} succeeded")
    took.sort()
    within = sum(seconds <= GOAL for seconds in took)
    print(
        f"{within} of {options.stops} succeeded within {GOAL:g} s; median {statistics.median(took):.1f} s, "
        f"90 % within {took[int(0.9 * (len(took) - 1))]:.1f} s, at most {took[-1]:.1f} s"
    )


if __name__ == "__main__":
    main()
