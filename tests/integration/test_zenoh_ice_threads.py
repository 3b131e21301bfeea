"""How many threads a server has, however many clients it has."""

from __future__ import annotations

import re
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import msgspec
import psutil
import pytest

from interfaces.nao import JointsPrx
from tests.conftest import Pair
from tests.support.calculator_servant import CalculatorI
from tests.support.carriers import LOCAL, LOCAL_SOCKETS, is_used, over_both
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, START_LIMIT
from tests.support.processes import STEADY, ComponentProcess, module
from zenoh_ice import Communicator
from zenoh_ice.carriers._local.messages import (
    LARGEST_MESSAGE,
    REQUEST,
    Response,
    decode_hello,
    decode_to_client,
    encode,
)
from zenoh_ice.data.keys import Target
from zenoh_ice.threads._starting import UserCodeThread

CLIENTS = 5
CONNECTIONS = 100


@over_both
def test_a_robot_server_with_several_clients_has_few_threads(
    endpoint: str, make_communicator: Callable[..., Communicator], carrier: str
) -> None:
    environment = {**STEADY, LOCAL_SOCKETS: str(carrier == LOCAL).lower()}
    with ComponentProcess(module("naoserver.fake", "--listen", endpoint), environment) as server:
        server.wait_for("ready")
        process = psutil.Process(server.process.pid)
        counts = [process.num_threads()]
        received = threading.Semaphore(0)
        bodies = []
        for _ in range(CLIENTS):
            client = make_communicator(connect=[endpoint])
            body = JointsPrx.checkedCast(client.stringToProxy("Body"))
            body.getJointState.subscribe(lambda sample: received.release())
            assert received.acquire(timeout=START_LIMIT)
            bodies.append(body)
        for _ in range(20):
            calls = [body.getJointState.begin() for body in bodies]
            counts.append(process.num_threads())
            for call in calls:
                call.result(CALL_LIMIT)
            for body in bodies:
                body.getJointState()
        assert is_used(carrier, process.pid)
    assert max(counts) <= 25, counts


@pytest.fixture
def connections(pair: Pair) -> Iterator[list[socket.socket]]:
    """Many clients of the server's socket."""
    pair.adapter.add(CalculatorI(), "Calculator")
    found = re.fullmatch(r"\w+\.(\d+)\.(\d+)", pair.server.transport.local_address)
    assert found is not None
    with ExitStack() as end:
        made = []
        for _ in range(CONNECTIONS):
            connection = end.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET))
            connection.settimeout(EVENT_LIMIT)
            connection.connect(f"/proc/{found[1]}/fd/{found[2]}")
            decode_hello(connection.recv(LARGEST_MESSAGE))
            made.append(connection)
        yield made


def test_connections_of_clients_need_no_threads(pair: Pair, connections: list[socket.socket]) -> None:
    counts = [threads()]
    ping = encode((REQUEST, Target(pair.server.realm, "Calculator").prefix, "ice_ping", b"", b"\x80"))
    half = CONNECTIONS // 2  # a servant lets no more than 64 calls wait
    for part in (connections[:half], connections[half:]):
        for connection in part:
            connection.send(ping)
        counts.append(threads())
        for connection in part:
            answer = decode_to_client(connection.recv(LARGEST_MESSAGE))
            assert isinstance(answer, Response)
            assert answer.ok, msgspec.msgpack.decode(answer.payload)
    assert max(counts) < 30, counts


def threads() -> int:
    return sum(isinstance(thread, UserCodeThread) for thread in threading.enumerate())
