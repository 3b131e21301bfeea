"""The admission of connections, before a plain listener: what is passed on, what is ended, and what is reported."""

from __future__ import annotations

import logging
import resource
import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress

import pytest

from nao_tools._deployment.admission import Admission, AdmissionLimits, raise_file_limit
from tests.support.handshakes import RECORD, ended, holding, place_of
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.processes import free_endpoint
from tests.support.waiting import until
from zenoh_ice import EndpointInUseException

pytestmark = pytest.mark.slow


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


@contextmanager
def linked(endpoint: str, inner: socket.socket) -> Iterator[tuple[socket.socket, int]]:
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
            connections[1].setblocking(False)
            with pytest.raises(BlockingIOError):  # before its time is over, too
                connections[1].recv(1)
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

    def test_what_is_not_tls_is_ended_and_not_passed_on(
        self, endpoint: str, inner: socket.socket, admission: Admission
    ) -> None:
        with holding(endpoint, 1, b"GET / HTTP/1.1\r\n\r\n") as (connection,):
            assert ended(connection)
        until(lambda: not admission.clients)
        inner.setblocking(False)
        with pytest.raises(BlockingIOError):
            inner.accept()

    def test_a_place_that_is_none_has_no_origin(self, admission: Admission) -> None:
        assert admission.origin(1) == ""

    def test_a_listener_that_is_gone_ends_the_connection_and_is_reported(
        self, endpoint: str, inner: socket.socket, admission: Admission, caplog: pytest.LogCaptureFixture
    ) -> None:
        inner.close()
        with holding(endpoint, 1, RECORD) as (connection,):
            assert ended(connection)
        assert "a connection from 127.0.0.1 could not be passed on" in caplog.text

    def test_where_one_of_two_endpoints_is_in_use_nothing_listens(
        self, endpoint: str, admission: Admission
    ) -> None:
        other = free_endpoint().replace("tcp/", "tls/")
        with pytest.raises(EndpointInUseException, match="another process listens"):
            Admission([other, endpoint], [1])
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(place_of(other), EVENT_LIMIT)

    def test_the_close_ends_every_connection_and_listens_no_more(
        self, endpoint: str, inner: socket.socket
    ) -> None:
        admission = Admission([endpoint], [inner.getsockname()[1]])
        with holding(endpoint, 1, b"") as (silent,), holding(endpoint, 1, RECORD) as (begun,):
            server, _ = inner.accept()
            with server:
                assert server.recv(3, socket.MSG_WAITALL) == RECORD
                until(lambda: len(admission.clients) == 2)
                admission.close()
                assert [ended(each) for each in (silent, begun, server)] == [True] * 3
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(place_of(endpoint), EVENT_LIMIT)


class TestRoom:
    """Which handshakes are begun where, while others go on."""

    def test_a_further_one_is_refused_while_the_oldest_has_its_share(
        self, endpoint: str, inner: socket.socket
    ) -> None:
        limits = AdmissionLimits(most_handshakes=1, fair_share=FOREVER)
        with (
            closing(Admission([endpoint], [inner.getsockname()[1]], limits)) as admission,
            holding(endpoint, 1, RECORD),
        ):
            until(lambda: admission.handshakes)
            (first,) = admission.handshakes
            with holding(endpoint, 1, RECORD) as (further,):
                assert ended(further)
            assert [*admission.handshakes] == [first]

    def test_one_that_is_over_leaves_its_place_to_the_next(self, endpoint: str, inner: socket.socket) -> None:
        limits = AdmissionLimits(most_handshakes=1, fair_share=FOREVER)
        with (
            closing(Admission([endpoint], [inner.getsockname()[1]], limits)) as admission,
            linked(endpoint, inner),
            linked(endpoint, inner),
        ):
            until(lambda: not admission.handshakes)
            assert len(admission.clients) == 2

    def test_the_listener_that_is_least_busy_gets_the_next_one(
        self, endpoint: str, inner: socket.socket
    ) -> None:
        with socket.create_server(("127.0.0.1", 0)) as another, ExitStack() as held:
            another.settimeout(EVENT_LIMIT)
            ports = [each.getsockname()[1] for each in (inner, another)]
            admission = held.enter_context(closing(Admission([endpoint], ports)))
            (first,) = held.enter_context(holding(endpoint, 1, RECORD))
            held.enter_context(inner.accept()[0])
            held.enter_context(holding(endpoint, 1, RECORD))
            held.enter_context(another.accept()[0])
            first.close()  # a handshake that fails: its listener takes nothing for a while
            until(lambda: len(admission.handshakes) == 1)
            assert admission.listeners[0].load(admission.loop.time())[0] > 0.0
            held.enter_context(holding(endpoint, 1, RECORD))
            held.enter_context(another.accept()[0])

    def test_what_was_ended_is_reported_by_address(
        self, endpoint: str, inner: socket.socket, caplog: pytest.LogCaptureFixture
    ) -> None:
        caplog.set_level(logging.WARNING)
        with closing(Admission([endpoint], [inner.getsockname()[1]], AdmissionLimits(report=0.02))):
            with holding(endpoint, 1, b"no TLS"):
                pass
            until(lambda: "1 connections from 127.0.0.1 ended, or were ended" in caplog.text)

    def test_as_many_files_as_the_system_permits_may_be_open(self) -> None:
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(512, hard), hard))
        try:
            found = raise_file_limit()
            assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] == found == raise_file_limit()
            assert found == (1 << 16 if hard == resource.RLIM_INFINITY else min(hard, 1 << 16))
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


class TestLinks:
    """Who has as many links as it may have gets no further one; all others do."""

    @pytest.mark.parametrize("limit", ["links_of_certificate", "links_of_address"])
    def test_no_further_one_of_a_certificate(self, endpoint: str, inner: socket.socket, limit: str) -> None:
        limits = AdmissionLimits(**{limit: 2})
        with (
            closing(Admission([endpoint], [inner.getsockname()[1]], limits)) as admission,
            linked(endpoint, inner) as (_, first),
            linked(endpoint, inner) as (_, second),
            linked(endpoint, inner) as (further, third),
            linked(endpoint, inner) as (operator, fourth),
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


def links_of(admission: Admission) -> Counter[tuple[str, str]]:
    """Return how many links each certificate has at each address."""
    return Counter((each.certificate, each.address) for each in tuple(admission.clients) if each.certificate)


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
