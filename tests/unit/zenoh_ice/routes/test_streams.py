"""How the reader of large samples comes to memory that their sender lends, and back to it from the network."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from interfaces.jderobot import ImageProviderPrx
from tests.support.waiting import until
from zenoh_ice.carriers._local import messages
from zenoh_ice.carriers._local.channels import RETRY_PAUSE, Channels, NotSent
from zenoh_ice.data.keys import Target
from zenoh_ice.routes._calls import Route
from zenoh_ice.routes._streams import BulkInlet
from zenoh_ice.transport import Registration

SUBSCRIBED = messages.encode((messages.SUBSCRIBED,))
SAMPLE = messages.encode((messages.SAMPLE, b"", b"small"))


class Server(Channels):
    """Channels whose other ends the test has, and which may be out of reach."""

    def __init__(self) -> None:
        super().__init__("0123456789abcdef.1.3", "abc")
        self.ends: list[socket.socket] = []
        self.is_reached = True

    def _connect(self, timeout: float) -> socket.socket:
        if not self.is_reached:
            raise NotSent("it is slow")
        near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.ends.append(far)
        return near

    def send(self, message: bytes) -> None:
        self.ends[-1].send(message)

    def cut(self) -> None:
        self.ends[-1].shutdown(socket.SHUT_RDWR)  # what was sent is read


class Process:
    """The process of a reader: its network, and the jobs of its pool, which run when the test says so."""

    def __init__(self) -> None:
        self.jobs: list[Callable[[], object]] = []
        self.pool = SimpleNamespace(submit=self.jobs.append)
        self.listener: Callable[[Any], object] | None = None

    def subscribe(self, key: str, keep: Callable[[Any], object]) -> Registration:
        self.listener = keep
        return Registration(lambda: setattr(self, "listener", None))

    def run(self, jobs: int) -> None:
        """Wait until the pool has got so many jobs, and run them."""
        until(lambda: len(self.jobs) >= jobs)
        waiting, self.jobs[:] = self.jobs[:], []
        for job in waiting:
            job()

    def publish(self) -> None:
        """Let a sample come over the network."""
        assert self.listener is not None
        self.listener(object())


class Reader:
    def __init__(self) -> None:
        self.server, self.process = Server(), Process()
        self.route = Route()
        self.route.channels = self.server

    def listen(self) -> BulkInlet:
        network: Any = self.process
        target, operation = Target("nao", "Camera"), ImageProviderPrx.getImageData
        self.inlet = BulkInlet(network, self.route, target, operation, 8)
        return self.inlet

    @property
    def channels(self) -> int:
        """How many channels it has asked for."""
        return len(self.server.ends)

    def uses_network(self) -> bool:
        return self.process.listener is not None


@pytest.fixture
def reader() -> Iterator[Reader]:
    reader = Reader()
    yield reader
    reader.inlet.close()
    for end in reader.server.ends:
        end.close()


@pytest.mark.parametrize("sent", [[SUBSCRIBED], [SAMPLE], [SAMPLE, SUBSCRIBED]])
def test_a_channel_that_breaks_before_anybody_notes_what_came_is_replaced(
    reader: Reader, sent: list[bytes]
) -> None:
    """As on a busy machine: its thread is faster than those of the pool, and samples than the server's word."""
    reader.listen()
    for message in sent:
        reader.server.send(message)
    reader.server.cut()
    reader.process.run(jobs=1 + (SUBSCRIBED in sent))
    assert reader.channels == 2
    assert not reader.uses_network()


def test_a_channel_that_ends_without_a_word_leaves_the_network_until_a_later_attempt(
    reader: Reader, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader.listen()
    reader.server.cut()
    reader.process.run(jobs=1)
    assert reader.uses_network()
    comes_back(reader, monkeypatch)


def test_a_server_that_was_slow_for_once_is_asked_again(
    reader: Reader, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader.server.is_reached = False
    reader.listen()
    assert reader.uses_network()
    reader.server.is_reached = True
    comes_back(reader, monkeypatch)


def let_the_pause_end(monkeypatch: pytest.MonkeyPatch) -> None:
    now = time.monotonic() + RETRY_PAUSE
    monkeypatch.setattr("zenoh_ice.routes._streams.time", SimpleNamespace(monotonic=lambda: now))


def comes_back(reader: Reader, monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that samples over the network have a reader try again, but only after a pause, and once."""
    before = reader.channels
    reader.process.publish()
    assert not reader.process.jobs
    let_the_pause_end(monkeypatch)
    reader.process.publish()
    reader.process.publish()
    reader.process.run(jobs=1)
    assert reader.channels == before + 1
    assert reader.uses_network()  # until the server has said that samples come
    reader.process.publish()
    assert not reader.process.jobs
    reader.server.send(SUBSCRIBED)
    reader.process.run(jobs=1)
    assert not reader.uses_network()


def test_without_a_server_near_the_network_is_the_only_way(
    reader: Reader, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader.route.channels = None
    reader.listen()
    let_the_pause_end(monkeypatch)
    reader.process.publish()
    assert not reader.process.jobs
