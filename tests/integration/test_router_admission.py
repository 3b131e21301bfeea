"""A router whose endpoint is held by connections that never finish their TLS handshake, or by too many links."""

from __future__ import annotations

import socket
import ssl
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import partial

import pytest

from nao_tools._deployment.admission import Admission, AdmissionLimits
from tests.support.limits import EVENT_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.security import Keys, routing
from tests.support.waiting import links, until
from zenoh_ice import EndpointInUseException, initialize
from zenoh_ice.settings import host_and_port

LINK_LIMIT = 10.0
"""A link is made within this many s, a third of what it takes behind handshakes that keep it out."""


def hello() -> bytes:
    """The first bytes of a TLS client."""
    sent = ssl.MemoryBIO()
    client = ssl.create_default_context().wrap_bio(ssl.MemoryBIO(), sent, server_hostname="localhost")
    with suppress(ssl.SSLWantReadError):
        client.do_handshake()
    return sent.read()


def place_of(endpoint: str) -> tuple[str, int]:
    place = host_and_port(endpoint)
    assert place is not None
    return place


@contextmanager
def holding(endpoint: str, number: int, first: bytes) -> Iterator[list[socket.socket]]:
    """Hold connections that send some bytes and then nothing."""
    with ExitStack() as held:
        connections = [
            held.enter_context(socket.create_connection(place_of(endpoint), EVENT_LIMIT))
            for _ in range(number)
        ]
        for connection in connections:
            connection.sendall(first)
        yield connections


def connect(keys: Keys) -> None:
    """Make a link as a student, and end it."""
    with initialize(keys.settings("student", timeout=LINK_LIMIT)):
        pass


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Keys:
    return Keys(tmp_path_factory.mktemp("keys"))


@pytest.fixture(scope="module")
def router(keys: Keys) -> Iterator[None]:
    with routing(keys.settings("router")):
        yield


@pytest.mark.usefixtures("router")
class TestUnfinishedHandshakes:
    @pytest.mark.parametrize(
        "first", [pytest.param(b"", id="silent"), pytest.param(hello(), id="a first message alone")]
    )
    def test_a_client_gets_in_beside_them_and_at_once_after_them(self, keys: Keys, first: bytes) -> None:
        # Each costs Zenoh 0.1 s when it ends: without the admission, the last link takes 30 s.
        with holding(keys.endpoint, 300, first):
            connect(keys)
        connect(keys)

    def test_what_is_not_tls_is_ended_at_once(self, keys: Keys) -> None:
        with holding(keys.endpoint, 1, b"GET / HTTP/1.1\r\n\r\n") as (connection,):
            assert ended(connection)


def test_the_log_names_the_address_of_a_client(keys: Keys, endpoint: str) -> None:
    options = ("--config", str(keys.folder / "router.toml"), "--listen", endpoint)
    with ComponentProcess(module("nao_tools", "router", *options)) as router:
        router.wait_for(f"the router listens on {endpoint}")
        with initialize(keys.settings("student", connect=[endpoint])):
            router.wait_for("'student' came, at 127.0.0.1, process")
        router.wait_for("'student' left, at 127.0.0.1, process")


@pytest.fixture
def inner() -> Iterator[socket.socket]:
    """What the admission passes connections on to."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(EVENT_LIMIT)
        yield server


@pytest.fixture
def endpoint() -> str:
    return free_endpoint().replace("tcp/", "tls/")


@pytest.fixture
def admission(endpoint: str, inner: socket.socket) -> Iterator[Admission]:
    admission = Admission([endpoint], [inner.getsockname()[1]])
    try:
        yield admission
    finally:
        admission.close()


RECORD = b"\x16\x03\x01"  # the beginning of a handshake


class TestPassingOn:
    def test_bytes_pass_in_both_directions_whatever_their_number(
        self, endpoint: str, inner: socket.socket, admission: Admission
    ) -> None:
        data = bytes(range(256)) * 40_000
        with holding(endpoint, 1, RECORD) as (client,):
            server, (_, port) = inner.accept()
            with server:
                assert server.recv(3, socket.MSG_WAITALL) == RECORD
                assert admission.origin(port) == "127.0.0.1"
                for sender, receiver in ((client, server), (server, client)):
                    assert _transfer(sender, receiver, data) == data

    @pytest.mark.parametrize("first", ["client", "server"])
    def test_the_end_of_one_side_ends_the_other(
        self, endpoint: str, inner: socket.socket, admission: Admission, first: str
    ) -> None:
        with holding(endpoint, 1, RECORD) as (client,):
            server, _ = inner.accept()
            with server:
                assert server.recv(3, socket.MSG_WAITALL) == RECORD
                ends = (client, server) if first == "client" else (server, client)
                ends[0].sendall(b"the last")
                ends[0].shutdown(socket.SHUT_RDWR)
                ends[1].settimeout(EVENT_LIMIT)
                assert ends[1].recv(8, socket.MSG_WAITALL) == b"the last"
                assert ends[1].recv(1) == b""

    def test_an_endpoint_in_use_is_named(self, endpoint: str, admission: Admission) -> None:
        with pytest.raises(EndpointInUseException, match=endpoint):
            Admission([endpoint], [1])

    def test_silent_connections_make_room_for_new_ones(
        self, endpoint: str, inner: socket.socket, admission: Admission
    ) -> None:
        with holding(endpoint, admission.most_silent + 1, b"") as connections:
            assert ended(connections[0])
            connections[-1].sendall(RECORD)
            server, _ = inner.accept()
            server.close()

    def test_a_handshake_that_takes_the_place_of_the_only_other_one_has_its_own(
        self, endpoint: str, inner: socket.socket
    ) -> None:
        limits = AdmissionLimits(most_handshakes=1, fair_share=0.0)
        with closing(Admission([endpoint], [inner.getsockname()[1]], limits)) as admission:
            for _ in range(2):
                with holding(endpoint, 2, RECORD):
                    until(lambda: len(admission.clients) == 1)
                until(lambda: not (admission.clients or admission.handshakes or admission.of_address))
            assert admission.listeners[0].load(0.0)[1] == 0

    def test_it_lets_go_of_everything_that_has_ended(self, endpoint: str, admission: Admission) -> None:
        with holding(endpoint, 5, b""), holding(endpoint, 5, RECORD):
            until(lambda: (len(admission.silent), len(admission.handshakes)) == (5, 5))
        until(
            lambda: (
                not (admission.clients or admission.silent or admission.handshakes or admission.of_address)
            )
        )


class TestLinks:
    """Who has as many links as it may have gets no further one; all others do."""

    @contextmanager
    def link(self, endpoint: str, inner: socket.socket) -> Iterator[tuple[socket.socket, int]]:
        """A link, and the port at which Zenoh sees it."""
        with socket.create_connection(place_of(endpoint), EVENT_LIMIT) as client:
            client.sendall(RECORD)
            server, (_, port) = inner.accept()
            with server:
                assert server.recv(3, socket.MSG_WAITALL) == RECORD
                for sender, receiver in ((server, client), (client, server), (server, client)):
                    sender.sendall(RECORD)
                    assert receiver.recv(3, socket.MSG_WAITALL) == RECORD
                yield client, port

    @pytest.mark.parametrize("limit", ["links_of_certificate", "links_of_address"])
    def test_no_further_one_of_a_certificate(self, endpoint: str, inner: socket.socket, limit: str) -> None:
        limits = AdmissionLimits(**{limit: 2})
        with (
            closing(Admission([endpoint], [inner.getsockname()[1]], limits)) as admission,
            self.link(endpoint, inner) as (_, first),
            self.link(endpoint, inner) as (_, second),
            self.link(endpoint, inner) as (further, third),
            self.link(endpoint, inner) as (operator, fourth),
        ):
            for port in (first, second, second, third):
                admission.identify(port, "student")
            admission.identify(fourth, "operator")
            assert ended(further)
            until(lambda: links_of(admission)["operator", "127.0.0.1"] == 1)
            assert links_of(admission)["student", "127.0.0.1"] == 2
            operator.close()
            until(lambda: not links_of(admission)["operator", "127.0.0.1"])
            assert links_of(admission) == {("student", "127.0.0.1"): 2}

    def test_a_student_with_many_leaves_room_for_others(self, keys: Keys, endpoint: str) -> None:
        limits = AdmissionLimits(links_of_certificate=3, report=0.1)
        with (
            routing(keys.settings("router", listen=[endpoint]), limits) as router,
            ExitStack() as opened,
        ):
            for _ in range(5):
                opened.enter_context(initialize(keys.settings("student", connect=[endpoint])))
            for name in ("operator", "robot"):
                with initialize(keys.settings(name, connect=[endpoint], timeout=LINK_LIMIT)) as other:
                    until(partial(links, other))
            router.wait_for("links of 'student' were refused: there are as many as it may have")


def links_of(admission: Admission) -> Counter[tuple[str, str]]:
    """Return how many links each certificate has at each address."""
    return Counter((each.certificate, each.address) for each in tuple(admission.clients) if each.certificate)


def ended(connection: socket.socket) -> bool:
    """Wait for the end of a connection."""
    connection.settimeout(EVENT_LIMIT)
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


def _transfer(sender: socket.socket, receiver: socket.socket, data: bytes) -> bytes:
    """Send while nobody reads, then read: more than fits into the buffers in between."""
    sender.setblocking(False)
    receiver.settimeout(EVENT_LIMIT)
    sent, received = memoryview(data), bytearray()
    while len(received) < len(data):
        with suppress(BlockingIOError):
            while sent:
                sent = sent[sender.send(sent) :]
        received += receiver.recv(1 << 20)
    return bytes(received)
