"""Servers of the tests get ports that nobody else has, in all processes of a machine."""

from __future__ import annotations

import random
import socket
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.support.ports import Ports, free_port, server_ports
from tests.support.processes import ComponentProcess

pytestmark = pytest.mark.slow

TAKE = """
import signal, sys
from pathlib import Path
from tests.support.ports import Ports
ports = Ports(map(int, sys.argv[2:]), Path(sys.argv[1]))
print("taken", ports.take(), ports.take())
signal.pause()
"""


@pytest.fixture
def few() -> list[int]:
    return [free_port() for _ in range(6)]


@pytest.fixture
def reservations(tmp_path: Path) -> Path:
    return tmp_path / "reservations"


@pytest.fixture
def ports(few: list[int], reservations: Path) -> Iterator[Ports]:
    with closing(Ports(few, reservations)) as ports:
        yield ports


def taking(reservations: Path, few: list[int]) -> ComponentProcess:
    """Return a process that takes two ports and keeps them."""
    return ComponentProcess([sys.executable, "-c", TAKE, str(reservations), *map(str, few)])


def taken(process: ComponentProcess) -> set[int]:
    return {*map(int, process.wait_for("^taken (.*)")[1].split())}


def test_each_port_is_given_once_before_any_is_given_again(ports: Ports, few: list[int]) -> None:
    assert {ports.take() for _ in few} == {*few}
    assert {ports.take() for _ in few} == {*few}


def test_processes_get_different_ports_until_one_ends(
    ports: Ports, few: list[int], reservations: Path
) -> None:
    own = {ports.take(), ports.take()}
    with taking(reservations, few) as first, taking(reservations, few) as second:
        assert own | taken(first) | taken(second) == {*few}
        assert {ports.take() for _ in few} == own
        first.process.kill()
        first.wait()
        assert {ports.take() for _ in few} == own | taken(first)


def test_a_port_on_which_somebody_listens_is_left_out(ports: Ports, few: list[int]) -> None:
    with socket.create_server(("127.0.0.1", few[0])), socket.create_server(("127.0.0.2", few[1] + 1)):
        assert {ports.take() for _ in few} == {*few[2:]}


def test_a_port_of_a_connection_that_has_just_ended_is_left_out(ports: Ports, few: list[int]) -> None:
    with (
        socket.create_server(("127.0.0.1", few[0])) as server,
        socket.create_connection(server.getsockname()[:2]) as client,
    ):
        server.accept()[0].close()  # the end that closes first waits
        assert client.recv(1) == b""
    assert few[0] not in {ports.take() for _ in few}


def test_that_none_is_free_is_reported(few: list[int], reservations: Path) -> None:
    with (
        closing(Ports(few[:1], reservations)) as ports,
        socket.create_server(("127.0.0.1", few[0])),
        pytest.raises(RuntimeError, match="none of 1 ports is free"),
    ):
        ports.take()


def test_a_seed_decides_nothing(tmp_path: Path) -> None:
    found = []
    for name in ("first", "second"):
        random.seed(0)
        with closing(Ports(server_ports(range(0)), tmp_path / name)) as ports:
            found.append([ports.take() for _ in range(8)])
    assert found[0] != found[1]


def test_ports_that_the_system_gives_by_itself_are_left_out() -> None:
    assert server_ports(range(32_768, 61_000)) == [*range(11_000, 32_768, 2), *range(61_000, 1 << 16, 2)]
    assert server_ports(range(11_001, 1 << 16)) == [*range(11_000, 1 << 16, 2)]
