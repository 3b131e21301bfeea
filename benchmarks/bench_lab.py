"""Measure whether an emergency stop gets through during an attack on the network, and over a bad one.

The cases of attacks are the figures of docs/decisions/0007-limits-of-a-lab-network.md. A student stops the
robot all the time: by `nao stop` as a new process, and over an existing link. Afterwards it is measured how
soon a client that connects, and waits for two seconds, gets an answer again. Everything is on loopback, and
every attack is limited in number and time: liveliness tokens through a router with TLS and roles, TCP
connections that stay silent, or begin a TLS handshake and then stay silent, to the router or to a server
without TLS.

`bad network`, which needs root on Linux: two network namespaces are joined by a switch in this program, which
delays each packet and drops some, each way, with a seed. In one are a router with TLS and roles and a fake
robot, as in a lab; in the other a new process of `nao stop` runs again and again. Everything ends with the
program.

    python benchmarks/bench_lab.py [CASE...]
    python benchmarks/bench_lab.py "bad network" [--delay 0.2] [--loss 0.05] [--stops 50] [--user operator]
"""

from __future__ import annotations

import argparse
import ctypes
import fcntl
import heapq
import logging
import os
import random
import secrets
import select
import socket
import ssl
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Final

import zenoh

from benchmarks.common import parts, percentile
from interfaces.nao import SafetyPrx
from nao_tools._deployment.admission import raise_file_limit
from nao_tools._security.folder import SecurityFolder
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.security import Keys
from zenoh_ice import ConnectFailedException, SystemException, initialize
from zenoh_ice.carriers.zenoh.session import open_session
from zenoh_ice.settings import Settings, load_settings

LONGEST: Final = 40.0  # s of an attack
HELD: Final = 3.0  # s for which the tokens are held
SILENT: Final = 25.0  # s for which silent connections are held
AFTERWARDS: Final = 90.0  # s within which a fresh stop must get through again
CASES: Final = {
    "nobody": ("", 0),
    "10,000 tokens": ("tokens", 10_000),
    "30,000 tokens": ("tokens", 30_000),
    "600 silent connections, TLS": ("silent", 600),
    "5,000 silent connections, TLS": ("silent", 5_000),
    "600 silent handshakes, TLS": ("hello", 600),
    "200 silent connections, TCP": ("silent tcp", 200),
    "600 silent connections, TCP": ("silent tcp", 600),
}
ROBOT: Final = "10.78.0.1"
PERSON: Final = "10.78.0.2"
PORT: Final = 7447
GOAL: Final = 10.0  # s
PATIENCE: Final = 40.0  # s of one command
_TUNSETIFF: Final = 0x400454CA  # of linux/if_tun.h
_TUN_WITHOUT_HEADER: Final = 0x1001
_CLONE_NEWNET: Final = 0x40000000  # of linux/sched.h
_LARGEST_PACKET: Final = 2048


@dataclass
class Stops:
    """The durations in s of stops of one kind, and the number that failed."""

    took: list[float] = field(default_factory=list)
    failed: int = 0

    def __str__(self) -> str:
        number = len(self.took) + self.failed
        if not self.took:
            return f"0 of {number}"
        median, longest = statistics.median(self.took), max(self.took)
        most = percentile(self.took, 0.99)
        return f"{len(self.took)} of {number}, {median:.3f} s, 99 % {most:.2f} s, at most {longest:.2f} s"


def fresh_stop(settings: Settings, stops: Stops) -> bool:
    """Connect, stop the robot and disconnect; return whether the robot has answered."""
    began = time.monotonic()
    try:
        with initialize(settings) as communicator:
            SafetyPrx.checkedCast(communicator.stringToProxy("Safety")).emergencyStop("bench")
            stops.took.append(time.monotonic() - began)
    except (SystemException, ConnectFailedException):
        stops.failed += 1
        return False
    return True


def new_processes(options: list[str], stops: Stops, end: threading.Event) -> None:
    """Run `nao stop` again and again until `end` is set."""
    while not end.wait(0.5):
        began = time.monotonic()
        command = module("nao_tools", "stop", "--seconds", "10", *options)
        if subprocess.run(command, capture_output=True, check=False).returncode == 0:
            stops.took.append(time.monotonic() - began)
        else:
            stops.failed += 1


def ready_stops(safety: SafetyPrx, stops: Stops, end: threading.Event) -> None:
    """Send stops over one link until `end` is set."""
    while not end.wait(0.25):
        began = time.monotonic()
        try:
            safety.emergencyStop("bench")
        except SystemException:
            stops.failed += 1
        else:
            stops.took.append(time.monotonic() - began)


@contextmanager
def attack(kind: str, number: int, where: str) -> Iterator[subprocess.Popen[bytes] | None]:
    """Run an attacker in a separate process."""
    if not kind:
        yield None
        return
    process = subprocess.Popen([sys.executable, __file__, "--attack", kind, str(number), where])
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def declare_tokens(number: int, settings: Settings) -> None:
    """Declare tokens of clients that do not exist, and hold them."""
    session = open_session(settings)
    end = time.monotonic() + LONGEST
    tokens: list[zenoh.LivelinessToken] = []
    while len(tokens) < number and time.monotonic() < end:
        tokens.append(session.liveliness().declare_token(f"@client/nao/{secrets.token_hex(16)}/-"))
    time.sleep(HELD)


def keep_silent(number: int, port: int, first: bytes = b"") -> None:
    """Hold TCP connections that send `first` and then nothing; replace those that the other side closes."""
    raise_file_limit()
    end = time.monotonic() + SILENT
    held: list[socket.socket] = []
    while time.monotonic() < end:
        with suppress(OSError):
            while len(held) < number and time.monotonic() < end:
                held.append(socket.create_connection(("127.0.0.1", port), 1.0))
                held[-1].setblocking(False)
                held[-1].send(first)
        time.sleep(0.05)
        for connection in list(held):
            try:
                over = not connection.recv(16)
            except BlockingIOError:
                continue
            except OSError:
                over = True
            if over:
                held.remove(connection)
                connection.close()


def hello() -> bytes:
    """Return the first bytes of a client of TLS."""
    sent = ssl.MemoryBIO()
    client = ssl.create_default_context().wrap_bio(ssl.MemoryBIO(), sent, server_hostname="localhost")
    with suppress(ssl.SSLWantReadError):
        client.do_handshake()
    return sent.read()


def attacked(name: str, keys: Keys, _: argparse.Namespace) -> None:
    """Run one case and print its row."""
    kind, number = CASES[name]
    plain = free_endpoint()
    user = Settings(connect=(plain,), clock="wall") if kind == "silent tcp" else keys.settings("student")
    options = ["--connect", plain] if kind == "silent tcp" else ["--config", f"{keys.folder}/student.toml"]
    port = user.connect[0].rpartition(":")[2]
    fresh, ready, after = Stops(), Stops(), Stops()
    with ExitStack() as parts:
        if kind == "silent tcp":
            robot = ["--listen", plain]
        else:
            router = parts.enter_context(
                ComponentProcess(module("nao_tools", "router", "--config", f"{keys.folder}/router.toml"))
            )
            router.wait_for("listens on")
            robot = ["--config", f"{keys.folder}/robot.toml"]
        parts.enter_context(ComponentProcess(module("naoserver.fake", *robot))).wait_for("^ready")
        standing = parts.enter_context(initialize(user))
        safety = SafetyPrx.checkedCast(standing.stringToProxy("Safety"))
        end = threading.Event()
        threads = [
            threading.Thread(target=new_processes, args=(options, fresh, end)),
            threading.Thread(target=ready_stops, args=(safety, ready, end)),
        ]
        where = f"{keys.folder}/student.toml" if kind == "tokens" else port
        with attack(kind, number, where) as attacker:
            for thread in threads:
                thread.start()
            if attacker is None:
                time.sleep(5)
            else:
                with suppress(subprocess.TimeoutExpired):
                    attacker.wait(LONGEST + HELD + 10)
        end.set()
        left = time.monotonic()
        for thread in threads:
            thread.join()
        while not fresh_stop(user, after) and time.monotonic() - left < AFTERWARDS:
            time.sleep(0.2)
        again = time.monotonic() - left
    back = f"{again:.1f} s" if after.took else f"not within {AFTERWARDS:g} s"
    print(f"| {name} | {fresh} | {ready} | {back} |", flush=True)


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


def bad_stops(given: argparse.Namespace) -> None:
    """Stop a robot over a bad network, and print the figures."""
    stops = Stops()
    with (
        tempfile.TemporaryDirectory() as folder,
        bad_network(given.delay, given.loss, given.seed) as (robot, person),
        lab(Path(folder, "keys"), robot),
    ):
        settings = str(Path(folder, "keys", f"{given.user}.toml"))
        command = [*person, *module("nao_tools", "stop", "--config", settings)]
        for number in range(1, given.stops + 1):
            began = time.monotonic()
            done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
            seconds, text = time.monotonic() - began, (done.stderr + done.stdout).strip().rpartition("\n")[2]
            print(f"{number:3}  {seconds:5.2f} s  exit code {done.returncode}  {text}", flush=True)
            if done.returncode == 0:
                stops.took.append(seconds)
            else:
                stops.failed += 1
    within = sum(seconds <= GOAL for seconds in stops.took)
    print(f"{within} of {given.stops} succeeded within {GOAL:g} s; {stops}")


def main() -> None:
    """Measure the named cases, by default all attacks."""
    if "--attack" in sys.argv:
        kind, number, where = sys.argv[2:]
        if kind == "tokens":
            declare_tokens(int(number), load_settings(where, defaults={"clock": "wall"}))
        else:
            keep_silent(int(number), int(where), hello() if kind == "hello" else b"")
        return
    logging.disable(logging.CRITICAL)
    print("| attack | new process | existing link | new links again after |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        keys = Keys(Path(folder) / "keys")
        measured = {name: partial(attacked, name, keys) for name in CASES} | {"bad network": bad_stops}
        parts(
            __doc__,
            measured,
            on_request=["bad network"],
            delay=0.2,
            loss=0.05,
            stops=50,
            seed=1,
            user="operator",
        )


if __name__ == "__main__":
    main()
