"""Measure whether an emergency stop gets through during an attack on the network.

These are the figures of docs/decisions/0007-limits-of-a-lab-network.md. A student stops the robot all the
time: by `nao stop` as a new process, and over an existing link. Afterwards it is measured how soon a client
that connects, and waits for two seconds, gets an answer again. Everything is on loopback, and every attack is
limited in number and time: liveliness tokens through a router with TLS and roles, TCP connections that stay
silent, or begin a TLS handshake and then stay silent, to the router or to a server without TLS.
"""

from __future__ import annotations

import argparse
import logging
import secrets
import socket
import ssl
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import zenoh

from interfaces.nao import SafetyPrx
from nao_tools._deployment.admission import raise_file_limit
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
        most = sorted(self.took)[int(0.99 * (len(self.took) - 1))]
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


def measure(name: str, keys: Keys) -> None:
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


def main() -> None:
    """Measure the named cases, by default all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--attack", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.attack:
        kind, number, where = options.attack
        if kind == "tokens":
            declare_tokens(int(number), load_settings(where, defaults={"clock": "wall"}))
        else:
            keep_silent(int(number), int(where), hello() if kind == "hello" else b"")
        return
    logging.disable(logging.CRITICAL)
    print("| attack | new process | existing link | new links again after |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        keys = Keys(Path(folder) / "keys")
        for name in options.cases or CASES:
            measure(name, keys)


if __name__ == "__main__":
    main()
