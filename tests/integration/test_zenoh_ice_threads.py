"""How many threads a server has, however many clients it has."""

from __future__ import annotations

import threading
from collections.abc import Callable

import psutil

from interfaces.nao import JointsPrx
from tests.support.carriers import LOCAL, LOCAL_SOCKETS, is_used, over_one
from tests.support.limits import CALL_LIMIT, START_LIMIT
from tests.support.processes import STEADY, ComponentProcess, module
from zenoh_ice import Communicator

CLIENTS = 5
CONNECTIONS = 100


@over_one
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
