"""Attack a running server with hostile queries, samples, tokens, links and messages; measure its resources.

python benchmarks/fuzz_server.py [--seconds SECONDS] [--seed NUMBER]

Prints the memory, threads and open files of the server during the attack, the number of queries by answer,
and the calls of an ordinary client, which may get BusyException. Exits with 1 if that client is no longer
served, or if the server takes more than half a gigabyte. Our code holds about 25 MB of that, which is
bounded; the rest is Zenoh's, and memory that its allocator keeps.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter, deque
from contextlib import suppress

import msgpack
import psutil
import zenoh

from benchmarks.common import options
from tests.support.attachments import encode_call_attachment
from tests.support.calculator import CALCULATOR, CalculatorPrx
from tests.support.hostile_bytes import HostileBytes, bombs
from tests.support.local_strangers import Visitor, address_of
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.stranger import Stranger, stranger
from tests.support.wire_doors import find_door
from zenoh_ice import BusyException, Communicator, initialize
from zenoh_ice.data.keys import Target, servant_token
from zenoh_ice.data.wire import ERROR_ENCODING, decode_error

_ROWS = 12
_IN_FLIGHT = 200
_TOKENS = 5000
_VISITS = 50
_LONGEST_MESSAGE = 1 << 17  # bytes, twice what is read
_MOST_MEMORY = 512.0  # MB
_PATIENCE = 10.0  # s within which a client must be served
_PREFIX = "nao/Calculator/"
_OPERATIONS = ("add", "divide", "split", "fail", "count", "total", "echo", "who", "getReading", "ice_isA")
_OTHER_KEYS = (
    "nao/**",
    f"{_PREFIX}*",
    f"{_PREFIX}none",
    f"{_PREFIX}getReading?x=9999",
    "@process/nao/**",
)
_PAYLOADS = (
    msgpack.packb({"a": 1.0, "b": 2.0}),
    msgpack.packb({"head": {"value": 1, "next": {"value": 2, "next": None}}}),
    msgpack.packb({"text": "declared"}),
    msgpack.packb({"data": b"123"}),
    msgpack.packb({"values": [1.0, 2.0]}),
)
_LARGE = (b"\xc6\x00\x20\x00\x00" + bytes(2 << 20), bytes(8 << 20))


class _Attack:
    """The attack of one stranger, in small steps."""

    def __init__(self, intruder: Stranger, seed: int) -> None:
        self.answers: Counter[str] = Counter()
        self._intruder = intruder
        self._hostile = HostileBytes(seed)
        self._asked: deque[zenoh.Handler[zenoh.Reply]] = deque()
        self._tokens: deque[zenoh.LivelinessToken] = deque()
        self._count = 0

    def step(self) -> None:
        """Do a few hundred hostile operations."""
        hostile = self._hostile
        timeout = hostile.choose((2.0, 0.0))
        about = [encode_call_attachment(CALCULATOR.fingerprint, self._count, "abc", timeout)]
        for _ in range(200):
            self._count += 1
            key = hostile.choose((_PREFIX + hostile.choose(_OPERATIONS),) * 8 + _OTHER_KEYS)
            payload = hostile.next_input(_PAYLOADS)
            if self._count % 500 == 0:
                payload = hostile.choose(bombs() + _LARGE)
            attachment = hostile.choose((None, about[0], hostile.next_input(about)))
            self._asked.append(self._intruder.begin_to_ask(key, payload, attachment))
            if hostile.choose(range(4)) == 0:  # samples of a stream that others publish
                self._intruder.session.put(key.partition("?")[0], payload, attachment=attachment)
            while len(self._asked) > _IN_FLIGHT:
                self._note(self._asked.popleft())
        for _ in range(100):
            name = f"I{hostile.choose(range(20_000))}"
            token = servant_token(Target("nao", name), "::a::B", "f", f"{self._count:x}", 1.0)
            self._tokens.append(self._intruder.session.liveliness().declare_token(token))
        while len(self._tokens) > _TOKENS:
            self._tokens.popleft().undeclare()

    def _note(self, replies: zenoh.Handler[zenoh.Reply]) -> None:
        kinds = [self._kind(reply) for reply in replies]
        self.answers.update(kinds or ["nothing"])

    def _kind(self, reply: zenoh.Reply) -> str:
        if reply.ok is not None:
            return "result"
        assert reply.err is not None
        if str(reply.err.encoding) != ERROR_ENCODING:
            return "timeout"
        return type(decode_error(reply.err.payload, (), "it")).__name__


def main() -> None:
    """Attack, and print the costs."""
    given = options(__doc__, seconds=60.0, seed=1)
    endpoint = free_endpoint()
    with ComponentProcess(module("tests.support.calculator_server", "--listen", endpoint)) as server:
        server.wait_for("^ready")
        with initialize(clock="wall", connect=[endpoint]) as client, stranger(endpoint) as first:
            answers, memory = _run(client, first, endpoint, server.process.pid, given)
    print("\nanswers:", ", ".join(f"{kind} {count}" for kind, count in answers.most_common()))
    sys.exit(memory > _MOST_MEMORY)


def _run(
    client: Communicator, first: Stranger, endpoint: str, pid: int, options: argparse.Namespace
) -> tuple[Counter[str], float]:
    process = psutil.Process(pid)
    calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    door = address_of(client)
    attack = _Attack(first, options.seed)
    most, count = 0.0, 0
    begin = time.monotonic()
    print("| s | MB | threads | files | a call of a client, ms | busy before that |")
    print("|---|---|---|---|---|---|")
    while (now := time.monotonic() - begin) < options.seconds:
        if now >= count * options.seconds / _ROWS:
            count += 1
            took, refusals = _call(calculator)
            resident = process.memory_info().rss / 1e6
            most = max(most, resident)
            threads, files = process.num_threads(), process.num_fds()
            print(
                f"| {now:.0f} | {resident:.0f} | {threads} | {files} | {took:.1f} | {refusals} |", flush=True
            )
            with stranger(endpoint) as other:  # connects, floods and disconnects
                _Attack(other, options.seed + count).step()
            _visit(door, HostileBytes(options.seed + count))
        attack.step()
    return attack.answers, most


def _visit(address: str, hostile: HostileBytes) -> None:
    """Send hostile messages to the server's local socket, over many connections."""
    for _ in range(_VISITS):
        with suppress(OSError), Visitor(address).enter() as visitor:
            for _ in range(10):
                visitor.socket.send(hostile.next_input(find_door("request").sound)[:_LONGEST_MESSAGE])


def _call(calculator: CalculatorPrx) -> tuple[float, int]:
    """Call until it is served; return the time in ms, and the number of BusyExceptions before."""
    refusals = 0
    deadline = time.monotonic() + _PATIENCE
    while True:
        called = time.perf_counter()
        try:
            assert calculator.add(1.0, 2.0) == 3.0
        except BusyException:
            refusals += 1
            if time.monotonic() > deadline:
                raise
        else:
            return (time.perf_counter() - called) * 1e3, refusals


if __name__ == "__main__":
    main()
