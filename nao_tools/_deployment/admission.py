"""Admit TLS connections to a router, so that neither unfinished handshakes nor many links keep anybody out.

After each handshake that fails, Zenoh takes no connection for 0.1 s (zenoh#2685): hundreds of silent ones
shut everybody else out for a minute. So the router's endpoints are ours. A connection is passed on once it
begins a handshake, to one of several listeners of Zenoh on loopback, and is ended early if the handshake does
not go on. Its bytes are passed on as they are: the two ends identify each other, and nobody in between can
read them.

Zenoh bounds the sessions of all together. So links are counted here, by the certificate that Zenoh has seen
and the address from which it is used: who has too many gets no further ones, and everybody else does, also at
the same address.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import resource
import socket
import threading
from collections import Counter, defaultdict
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Final, cast

from zenoh_ice.data.exceptions import EndpointInUseException
from zenoh_ice.settings import host_and_port

LISTENERS: Final = 32
"""Listeners of Zenoh that share the connections: each gets over ten failed handshakes a second."""

_SILENT_LIMIT: Final = 3.0  # s for the first bytes; TCP repeats lost ones after one
_HANDSHAKE_LIMIT: Final = 6.0  # s for the handshake: three round trips, some of them repeated
_MOST_SILENT: Final = 256  # connections without a byte
_MOST_OF_ADDRESS: Final = 32  # handshakes of one address
_RECOVERY: Final = 0.1  # s for which a listener of Zenoh takes nothing after a failed handshake
_LINGER: Final = 5.0  # s for the last bytes to a receiver that is slow
_HANDSHAKE: Final = 0x16  # type of the first record of TLS
_BACKLOG: Final = 1024  # connections that the system holds until they are accepted
_ACCEPTED_AT_ONCE: Final = 8  # before others have their turn
_BUFFER: Final = 1 << 18  # bytes that wait for a slow receiver before its sender has to
_END_LIMIT: Final = 2.0  # s
_MOST_FILES: Final = 1 << 16

_logger = logging.getLogger(__name__)


def raise_file_limit() -> int:
    """Let this process open as many files as the system permits it, at most 65536; return how many."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _MOST_FILES if hard == resource.RLIM_INFINITY else min(hard, _MOST_FILES)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        return wanted
    return soft if soft != resource.RLIM_INFINITY else _MOST_FILES


@dataclass(frozen=True)
class AdmissionLimits:
    """How many handshakes and links there may be at a time."""

    most_handshakes: int = 512
    """All of them; fewer where the system permits few open files."""
    fair_share: float = 0.25
    """The longest handshake in s that keeps its place when another one wants it."""
    links_of_certificate: int = 512
    links_of_address: int = 256
    """The most links of a certificate at one address: a class behind a common one has some hundred."""
    report: float = 10.0
    """s between two reports of what was refused."""


LIMITS: Final = AdmissionLimits()
"""The limits of a router that gets no others."""


class Admission:
    """Listens at the endpoints of a router and passes connections on, until `close`."""

    def __init__(
        self, endpoints: Sequence[str], ports: Sequence[int], limits: AdmissionLimits = LIMITS
    ) -> None:
        """Listen at endpoints of TLS; `ports` are those of Zenoh's listeners on loopback.

        Raises EndpointInUseException.
        """
        files = raise_file_limit()  # a handshake takes three, and so does a link
        self.most_silent: Final = min(_MOST_SILENT, files // 8)
        self.most_handshakes: Final = min(limits.most_handshakes, files // 8)
        self.fair_share: Final = limits.fair_share
        self.report: Final = limits.report
        self.most_links: Final = min(limits.links_of_certificate, files // 8)
        self.most_at_address: Final = min(limits.links_of_address, files // 16)
        self.listeners: Final = [_Listener(port) for port in ports]
        self.clients: Final[set[_Client]] = set()
        self.silent: Final[dict[_Client, None]] = {}  # the oldest first
        self.handshakes: Final[dict[_Client, None]] = {}
        self.of_address: Final[defaultdict[str, dict[_Client, None]]] = defaultdict(dict)  # handshakes
        self.clients_by_port: Final[dict[int, _Client]] = {}  # as Zenoh sees them, on loopback
        self.dropped: Final[Counter[str]] = Counter()  # since the last report, by address
        self.refused: Final[Counter[str]] = Counter()  # the same, for too many links, by certificate
        self.loop: Final = asyncio.new_event_loop()
        with ExitStack() as undo:
            undo.callback(self.loop.close)
            doors = [undo.enter_context(_door(endpoint)) for endpoint in endpoints]
            self._servers: Final = [self._serve(door) for door in doors]
            undo.pop_all()
        self.loop.call_later(self.report, self._report)
        self._thread: Final = threading.Thread(target=self.loop.run_forever, name="admission", daemon=True)
        self._thread.start()

    def origin(self, port: int) -> str:
        """Return the address of the client that Zenoh sees at a port of loopback; empty if there is none."""
        client = self.clients_by_port.get(port)
        return "" if client is None else client.address

    def identify(self, port: int, certificate: str) -> None:
        """Note whose certificate Zenoh has seen at a port of loopback; end the link if that has too many."""
        self.loop.call_soon_threadsafe(self._identify, port, certificate)

    def close(self) -> None:
        """End all connections, and listen no more."""
        self.loop.call_soon_threadsafe(self._end)
        self._thread.join(_END_LIMIT)
        if self._thread.is_alive():
            _logger.warning("the admission of connections has not ended after %g s", _END_LIMIT)
        else:
            self.loop.close()

    def _serve(self, door: socket.socket) -> asyncio.Server:
        server = self.loop.run_until_complete(
            self.loop.create_server(lambda: _Client(self), sock=door, backlog=_ACCEPTED_AT_ONCE)
        )
        door.listen(_BACKLOG)  # asyncio takes one number for both
        return server

    def _end(self) -> None:
        for server in self._servers:
            server.close()
        for client in tuple(self.clients):
            client.end()
        self.loop.call_soon(self.loop.call_soon, self.loop.stop)  # after what the aborts have scheduled

    def _report(self) -> None:
        for address, number in self.dropped.most_common(3):
            _logger.warning(
                "%d connections from %s ended, or were ended, before their TLS handshake was over",
                number,
                address,
            )
        for who, number in self.refused.most_common(3):
            _logger.warning("%d links of %r were refused: there are as many as it may have", number, who)
        self.dropped.clear()
        self.refused.clear()
        self.loop.call_later(self.report, self._report)

    # What follows runs on the thread of the loop.

    def hold(self, client: _Client) -> None:
        """Take a new connection; the oldest silent one makes room for it."""
        self.clients.add(client)
        if len(self.silent) >= self.most_silent:
            next(iter(self.silent)).end()
        self.silent[client] = None

    def begin(self, client: _Client) -> _Listener | None:
        """Return the listener for a handshake that begins; None if there are too many."""
        self.silent.pop(client, None)
        of_address = self.of_address.get(client.address, {})
        for others, most in ((of_address, _MOST_OF_ADDRESS), (self.handshakes, self.most_handshakes)):
            if len(others) >= most:
                oldest = next(iter(others))
                if self.loop.time() - oldest.began < self.fair_share:
                    return None
                oldest.end()
        # Looked up again: with its last handshake, an address is forgotten.
        self.handshakes[client] = self.of_address[client.address][client] = None
        return min(self.listeners, key=lambda listener: listener.load(self.loop.time()))

    def finish(self, client: _Client) -> bool:
        """Let go of the place of a handshake; return whether it had one."""
        self.silent.pop(client, None)
        if client not in self.handshakes:
            return False
        del self.handshakes[client]
        of_address = self.of_address[client.address]
        del of_address[client]
        if not of_address:
            del self.of_address[client.address]
        return True

    def _identify(self, port: int, certificate: str) -> None:
        client = self.clients_by_port.get(port)
        if client is None or client.certificate is not None or client not in self.clients:
            return
        at = [each.address for each in self.clients if each.certificate == certificate]
        if len(at) >= self.most_links or at.count(client.address) >= self.most_at_address:
            self.refused[certificate] += 1
            client.end()
        else:
            client.certificate = certificate


class _Listener:
    """A listener of Zenoh, and how busy it is."""

    def __init__(self, port: int) -> None:
        self.port: Final = port
        self._handshakes = 0
        self._free_at = 0.0

    def load(self, now: float) -> tuple[float, int]:
        """Return for how many s it takes nothing, and how many handshakes it has begun."""
        return max(0.0, self._free_at - now), self._handshakes

    def begin(self) -> None:
        """Count a handshake."""
        self._handshakes += 1

    def finish(self, now: float, *, failed: bool) -> None:
        """Count the end of a handshake."""
        self._handshakes -= 1
        if failed:
            self._free_at = max(now, self._free_at) + _RECOVERY


class _End(asyncio.Protocol):
    """One of the two connections that are joined."""

    transport: asyncio.Transport
    other: _End | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast("asyncio.Transport", transport)
        self.transport.set_write_buffer_limits(_BUFFER)
        # asyncio does so only for sockets that know their protocol, which accepted ones do not. Otherwise the
        # second of two small messages waits 40 ms for the acknowledgement of the first.
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def pause_writing(self) -> None:
        if self.other is not None:
            self.other.transport.pause_reading()

    def resume_writing(self) -> None:
        if self.other is not None:
            self.other.transport.resume_reading()

    def connection_lost(self, exception: Exception | None) -> None:  # noqa: ARG002
        if self.other is not None:
            self.other.leave()

    def leave(self) -> None:
        """Close the connection once what it was sent has left, or a little later."""
        self.transport.close()
        asyncio.get_running_loop().call_later(_LINGER, self.transport.abort)


class _Client(_End):
    """A connection from outside."""

    def __init__(self, admission: Admission) -> None:
        self.address = ""
        self.began = 0.0
        """The moment of the loop's clock when its handshake began."""
        self.certificate: str | None = None
        """The name in its certificate, once Zenoh has seen that; empty if it showed none."""
        self.admission: Final = admission
        self._listener: _Listener | None = None
        self._connecting: asyncio.Task[None] | None = None
        self._limit: asyncio.TimerHandle | None = None
        self._answered = False
        self._replied = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.address = str((transport.get_extra_info("peername") or ("",))[0])
        self.admission.hold(self)
        self._limit = self.admission.loop.call_later(_SILENT_LIMIT, self.end)

    def data_received(self, data: bytes) -> None:
        if self.other is not None:
            self._replied = self._replied or self._answered
            self.other.transport.write(data)
        elif self._connecting is None:
            self._begin(data)

    def answered(self, data: bytes) -> None:
        """Pass on what Zenoh sends; when it answers our second flight, the handshake is over."""
        self._answered = True
        if self._replied and self._limit is not None:
            self._finish(failed=False)
        self.transport.write(data)

    def connection_lost(self, exception: Exception | None) -> None:
        super().connection_lost(exception)
        self.admission.clients.discard(self)
        if self._connecting is not None:
            self._connecting.cancel()
        if self._limit is not None:
            self.admission.dropped[self.address] += 1
        self._finish(failed=True)

    def end(self) -> None:
        """End the connection at once."""
        self.admission.finish(self)
        for end in (self, self.other):
            if end is not None:
                end.transport.abort()

    def _begin(self, hello: bytes) -> None:
        """Pass the connection on, if it speaks TLS and there is room for it."""
        admission = self.admission
        self.began = admission.loop.time()
        self._listener = admission.begin(self) if hello[0] == _HANDSHAKE else None
        if self._listener is None:
            self.end()
            return
        assert self._limit is not None
        self._limit.cancel()
        self._limit = admission.loop.call_later(_HANDSHAKE_LIMIT, self.end)
        self._listener.begin()
        self.transport.pause_reading()
        self._connecting = admission.loop.create_task(self._pass_on(self._listener.port, hello))

    async def _pass_on(self, port: int, hello: bytes) -> None:
        try:
            _, inner = await self.admission.loop.create_connection(lambda: _Inner(self), "127.0.0.1", port)
        except OSError as error:
            _logger.error("a connection from %s could not be passed on: %s", self.address, error)
            self.end()
            return
        if self.transport.is_closing():
            inner.transport.abort()
            return
        self.other = inner
        inner.transport.write(hello)
        self.transport.resume_reading()

    def _finish(self, *, failed: bool) -> None:
        """Note the end of the handshake, once."""
        if self._limit is not None:
            self._limit.cancel()
            self._limit = None
        self.admission.finish(self)
        if self._listener is not None:
            self._listener.finish(self.admission.loop.time(), failed=failed)
            self._listener = None


class _Inner(_End):
    """The connection to Zenoh that belongs to one from outside."""

    def __init__(self, client: _Client) -> None:
        self.other = client
        self._client: Final = client
        self._admission: Final = client.admission
        self._port = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._port = transport.get_extra_info("sockname")[1]
        self._admission.clients_by_port[self._port] = self._client

    def data_received(self, data: bytes) -> None:
        self._client.answered(data)

    def connection_lost(self, exception: Exception | None) -> None:
        super().connection_lost(exception)
        self._admission.loop.call_later(_LINGER, self._forget)  # Zenoh reports the end of the link later

    def _forget(self) -> None:
        clients = self._admission.clients_by_port
        if clients.get(self._port) is self._client:
            del clients[self._port]


def _door(endpoint: str) -> socket.socket:
    """Return a socket that listens at an endpoint; raises EndpointInUseException."""
    place = host_and_port(endpoint)
    assert place is not None  # TLS has a host and a port
    try:
        family, _, _, _, address = socket.getaddrinfo(*place, type=socket.SOCK_STREAM)[0]
        return socket.create_server(address[:2], family=family, backlog=_BACKLOG)
    except OSError as error:
        why = f"cannot listen on {endpoint}: {error.strerror or error}"
        if error.errno == errno.EADDRINUSE:
            why = f"port in use: another process listens on {endpoint} already"
        raise EndpointInUseException(f"{why}; stop it or choose another with --listen") from error
