"""Local sockets where files, folders, groups or containers are in their way: then the network carries calls."""

from __future__ import annotations

import os
import resource
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import psutil
import pytest

from tests.support.calculator import CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from tests.support.carriers import is_used, local_connections
from tests.support.limits import EVENT_LIMIT
from tests.support.processes import STEADY, ComponentProcess, free_endpoint, module
from tests.support.waiting import until
from zenoh_ice import Communicator
from zenoh_ice.data.keys import parse_servant_token

MakeCommunicator = Callable[..., Communicator]

SERVER = "tests.support.calculator_server"
AS_OTHER_GROUP = f"import os, runpy; os.setgid(65534); runpy.run_module({SERVER!r}, run_name='__main__')"
# Root gives up CAP_KILL for now; another user forbids dumps, as the system does for a program with capabilities.
NOT_INSPECTED = f"""
import ctypes, runpy, struct
header, sets = struct.pack("Ii", 0x20080522, 0), (ctypes.c_uint32 * 6)()
libc = ctypes.CDLL(None)
libc.capget(header, sets)
sets[0] &= ~(1 << 5)
assert libc.capset(header, sets) == 0
assert libc.prctl(4, 0) == 0
runpy.run_module({SERVER!r}, run_name='__main__')
"""
MOST_THREADS = 25
CLIENTS = 1000


@contextmanager
def server(
    endpoint: str, *command: str, environment: dict[str, str] | None = None
) -> Iterator[ComponentProcess]:
    with ComponentProcess([*command, "--listen", endpoint], {**STEADY, **(environment or {})}) as process:
        process.wait_for("^ready")
        yield process


def calculator_of(client: Communicator) -> CalculatorPrx:
    calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    assert calculator.add(1.0, 2.0) == 3.0
    assert calculator.add.begin(1.0, 2.0).result(EVENT_LIMIT) == 3.0
    return calculator


def test_folders_that_differ_do_not_matter(
    endpoint: str, make_communicator: MakeCommunicator, tmp_path: Path
) -> None:
    with server(endpoint, *module(SERVER), environment={"XDG_RUNTIME_DIR": str(tmp_path)}) as process:
        calculator_of(make_communicator(connect=[endpoint]))
        assert is_used("local", process.process.pid)
        assert list(tmp_path.iterdir()) == []
        process.process.kill()
        process.process.wait()
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("temporary", [True, False])
def test_a_folder_that_cannot_be_written_is_warned_of_once_if_there_is_no_other(
    make_communicator: MakeCommunicator,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    tmp_path: Path,
    temporary: bool,
) -> None:
    """As on a full disk."""
    endpoint = free_endpoint()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "none"))
    if not temporary:
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    adapter = make_communicator(listen=[endpoint]).createObjectAdapter("Test")
    for identity in ("Calculator", "Other"):
        adapter.add(CalculatorI(), identity)
    adapter.activate()
    calculator_of(make_communicator(connect=[endpoint]))
    assert is_used("local" if temporary else "network")
    assert caplog.text.count("others of this machine call over the network") == (0 if temporary else 1)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may change its group")
def test_a_server_of_another_group_is_called_over_the_network(
    endpoint: str, make_communicator: MakeCommunicator
) -> None:
    with server(endpoint, sys.executable, "-c", AS_OTHER_GROUP) as process:
        calculator_of(make_communicator(connect=[endpoint]))
        assert is_used("network")
        assert is_used("network", process.process.pid)


def test_a_server_that_no_other_process_may_inspect_is_called_over_the_network(
    endpoint: str, make_communicator: MakeCommunicator
) -> None:
    with server(endpoint, sys.executable, "-c", NOT_INSPECTED) as process:
        calculator_of(make_communicator(connect=[endpoint]))
        assert is_used("network")
        assert "others of this machine call over the network" in process.output


def test_a_server_among_other_processes_is_called_over_the_network(
    endpoint: str, make_communicator: MakeCommunicator
) -> None:
    """As in a container."""
    apart = ["unshare", "--pid", "--fork", "--kill-child", "--mount-proc"]
    try:
        subprocess.run([*apart, "true"], check=True, capture_output=True, timeout=EVENT_LIMIT)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no namespace of processes may be made here")
    with server(endpoint, *apart, *module(SERVER)) as process:
        calculator_of(make_communicator(connect=[endpoint]))
        assert is_used("network")
        process.process.send_signal(signal.SIGKILL)


def test_a_thousand_clients_leave_a_server_files_and_cost_no_threads(
    endpoint: str, make_communicator: MakeCommunicator
) -> None:
    """Those for whom it has no room call over the network."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, max(soft, 2 * CLIENTS)), hard))
    limited = ["sh", "-c", 'ulimit -n 256; exec "$@"', "sh", *module(SERVER)]
    try:
        with server(endpoint, *limited) as process, ExitStack() as clients:
            first = calculator_of(make_communicator(connect=[endpoint]))
            greeted = 0
            for _ in range(CLIENTS):
                client = clients.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET))
                client.settimeout(EVENT_LIMIT)
                client.connect(door_of(first))
                greeted += bool(client.recv(1 << 16))
            assert 100 < greeted < 128
            before = local_connections()
            calculator_of(make_communicator(connect=[endpoint]))
            assert local_connections() == before
            assert first.add(1.0, 2.0) == 3.0
            status = psutil.Process(process.process.pid)
            assert status.num_threads() <= MOST_THREADS
            assert status.num_fds() < 256
            clients.close()
            until(lambda: local_connections(process.process.pid) <= 4)
            assert "Traceback" not in process.output
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def door_of(calculator: CalculatorPrx) -> str:
    """Return the path at which the server of a calculator is reached."""
    addresses: list[str] = []

    def note(key: str, came: bool) -> None:
        token = parse_servant_token(key)
        if token is not None and came:
            addresses.append(token.address)

    transport = calculator.ice_getCommunicator().transport
    transport.watch("@servant/nao/Calculator/**", note).close()
    _, process, file = addresses[0].split(".")
    return f"/proc/{process}/fd/{file}"
