"""The connections of programs: each is passed on to libqi, and its calls reach its own objects.

libqi lets a service in Python know neither who calls nor who is gone. So libqi listens at a private address,
and this module at the public one. It reads the headers of messages, and sends what a program addresses to a
service to the object that libqi has lent to this program for it. Such an object is lent by a service, the
door, when the program first addresses the service in question.

A message is a header of 28 bytes and its payload; numbers are little-endian. Source: message.hpp and
binarycodec.cpp of libqi 4.0.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import secrets
import socket
import struct
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple
from urllib.parse import urlsplit

from naoserver.errors import RobotError
from visualhfsm_naoqi.programs._clients import Client, QiLimits
from zenoh_ice.settings import is_loopback

_logger = logging.getLogger(__name__)

LARGEST_MESSAGE: Final = 1 << 18
"""Maximum bytes of a message from a program: libqi decodes it in one go, 20,000 numbers in some 0.1 s."""
MOST_PROGRAMS: Final = 64
"""Maximum connections that use services."""
MOST_SHORT: Final = 4
"""Maximum short calls and posts of a program in libqi; what follows them waits in the connection."""
MOST_LINKS: Final = 100
"""Maximum callbacks of a program at signals, besides those by which libqi follows the directory."""
_KEEP_ALIVE: Final = {"TCP_KEEPIDLE": 2, "TCP_KEEPINTVL": 1, "TCP_KEEPCNT": 3}
"""Options that notice a computer that is gone: s until the first question, between two, and how many."""

_HEADER: Final = struct.Struct("<IIIHBBIII")
_MAGIC: Final = 0x42ADDE42
_NUMBER: Final = struct.Struct("<I")
_ADDRESS: Final = struct.Struct("<II")
_CALL = 1
_REPLY = 2
_ERROR = 3
_POST = 4
_CANCELED = 8
"""Types of messages."""
_DIRECTORY, _MAIN = 1, 1
"""The service that knows the others, and the object of a service itself."""
_CONNECTS: Final = (0, 8)
_DISCONNECT: Final = 1
_LET_GO: Final = 3
"""Numbers of the operations that every object has: connect to a signal, disconnect, let the object go."""
_OWN_LINKS: Final = 2
"""Callbacks by which libqi follows the directory."""
_QUESTION: Final = 80
"""The number of `isStatsEnabled`, an operation of every object, without arguments."""
_FIRST_METHOD: Final = 100
"""The number of the first method of an object."""
_UID: Final = 20
"""Bytes of the identity that may follow the address of a lent object."""
_OWN_CALLS: Final = 0xF000_0000
"""The number of the first call that this module itself makes; programs count from 1."""


class _Header(NamedTuple):
    magic: int
    id: int
    size: int
    version: int
    type: int
    flags: int
    service: int
    object: int
    action: int


class Offer(NamedTuple):
    """What libqi offers at its own address on the loopback interface."""

    url: str
    services: Mapping[int, str]
    """The services whose objects are lent, and their names."""
    door: int
    """The service whose only method lends them; its argument is a text, `key` and the name of a service."""
    key: Callable[[Client], str]
    """Admit a client; return the secret by which the door knows it."""


class Connections:
    """Accept programs until it is closed; `lose` is called with each client that is gone."""

    def __init__(
        self, url: str, offer: Offer, lose: Callable[[Client], None], limits: QiLimits | None = None
    ) -> None:
        """Listen at a URL such as tcp://127.0.0.1:9559. Raises RobotError when it cannot."""
        parts = urlsplit(url)
        try:
            if parts.scheme != "tcp" or not parts.hostname:
                raise ValueError("an address is tcp://HOST:PORT")
            family = socket.AF_INET6 if ":" in parts.hostname else socket.AF_INET
            listening = socket.create_server((parts.hostname, parts.port or 0), family=family)
        except (OSError, ValueError) as error:
            raise RobotError(f"cannot listen at {url}: {error}; give another address") from None
        self.url: Final = _url_of((parts.hostname, listening.getsockname()[1]))
        """The address, with the port that the system picked."""
        if not is_loopback(self.url.replace("://", "/")):
            _logger.warning(
                "NAOqi at %s has no passwords: anyone on that network can see through the cameras and move"
                " the robot; give an address such as tcp://127.0.0.1:9559", self.url,
            )  # fmt: skip
        self._offer = offer
        self._lose = lose
        self._limits = limits or QiLimits()
        self._open: dict[asyncio.Task[None], _Program] = {}
        self._loop = asyncio.new_event_loop()
        self._ending = asyncio.Event()
        self._thread = threading.Thread(
            target=self._run, args=(listening,), name="NAOqi connections", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Close every connection, and wait, with a limit, until each client is dealt with as lost."""
        with suppress(RuntimeError):  # the loop has ended: it was closed before
            self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join(self._limits.end)
        if self._thread.is_alive():
            _logger.error("%s did not end within %g s", self._thread.name, self._limits.end)

    def _run(self, listening: socket.socket) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._accept(listening))

    async def _accept(self, listening: socket.socket) -> None:
        server = await asyncio.start_server(self._begin, sock=listening)
        await self._ending.wait()
        server.close()
        for task in self._open:
            task.cancel()
        await asyncio.gather(*self._open, return_exceptions=True)

    def _begin(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve a new connection in a separate task."""
        program = _Program(self._offer, self._admit, reader, writer, self._limits.talk)
        if len(self._open) >= self._limits.connections:
            writer.transport.abort()
        else:
            self._open[self._loop.create_task(self._serve(program))] = program

    async def _serve(self, program: _Program) -> None:
        task = asyncio.current_task()
        assert task is not None
        try:
            await program.pass_messages()
        finally:
            try:
                if program.client is not None:
                    await self._lose_on_a_thread(program.client)
            finally:
                del self._open[task]

    async def _lose_on_a_thread(self, client: Client) -> None:
        try:
            lost = self._loop.run_in_executor(None, self._lose, client)
        except RuntimeError:  # no thread can start: better that all wait than that the robot goes on
            self._lose(client)
        else:
            try:
                await asyncio.shield(lost)
            except asyncio.CancelledError:
                await lost  # who closes the connections waits for it, and does not end it before it begins
                raise

    def _admit(self) -> Client:
        """Return a new client. Raises _Refused when there are too many."""
        if sum(program.client is not None for program in self._open.values()) >= MOST_PROGRAMS:
            raise _Refused(f"{MOST_PROGRAMS} programs are connected already: end one of them")
        return Client(f"NAOqi {secrets.token_hex(8)}")


class _Refused(Exception):
    """A message is not passed on; the text says why."""


@dataclass(eq=False)
class _Program:
    """A connection of a program, and that to libqi that belongs to it."""

    _offer: Offer
    _admit: Callable[[], Client]
    _reader: asyncio.StreamReader
    _writer: asyncio.StreamWriter
    _talk_limit: float
    client: Client | None = None
    """The program as a client; None until it first addresses a service."""
    _key: str = ""
    # Addresses of lent objects by service, and the reverse.
    _lent: dict[int, tuple[int, int]] = field(default_factory=dict)
    _origins: dict[tuple[int, int], int] = field(default_factory=dict)
    _borrowing: asyncio.Future[tuple[int, bytes]] | None = None
    # Calls by their numbers, and whether the program wants answers.
    _unanswered: dict[int, bool] = field(default_factory=dict)
    _fewer: asyncio.Event = field(default_factory=asyncio.Event)  # whenever fewer short ones may be left
    _links: set[tuple[int, int, bytes]] = field(default_factory=set)  # by object and number
    _own_calls: Iterator[int] = field(default_factory=lambda: itertools.count(_OWN_CALLS))

    async def pass_messages(self) -> None:
        """Pass messages both ways until one side is gone, or breaks the rules."""
        connection = self._writer.get_extra_info("socket")
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        # asyncio does so only for sockets that know their protocol, which accepted ones do not.
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for option, value in _KEEP_ALIVE.items():
            if hasattr(socket, option):
                connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
        self._announced, self._reached = (
            _NUMBER.pack(len(url)) + url.encode()
            for url in (self._offer.url, _url_of(self._writer.get_extra_info("sockname")))
        )
        writer: asyncio.StreamWriter | None = None
        try:
            async with asyncio.timeout(self._talk_limit):
                first = await _header(self._reader)
                inner = urlsplit(self._offer.url)
                reader, writer = await asyncio.open_connection(inner.hostname, inner.port)
            async with asyncio.TaskGroup() as directions:
                directions.create_task(self._pass_calls(first, writer))
                directions.create_task(self._pass_answers(reader))
        except* (OSError, EOFError, ValueError):  # one side is gone, silent or talks something else
            pass
        finally:
            self._writer.transport.abort()
            if writer is not None:
                writer.transport.abort()

    async def _pass_calls(self, header: _Header, libqi: asyncio.StreamWriter) -> None:
        """Pass messages of the program to libqi, the first of which begins with `header`."""
        while True:
            calls = header.type in (_CALL, _POST)
            if calls and header.id in self._unanswered:
                raise ValueError("two calls have one number")
            try:
                payload = await self._payload(header.size)
                if calls:
                    await self._have_room()
                    self._count(header, payload)
                    self._unanswered[header.id] = header.type == _CALL
                if header.service in self._offer.services and header.object == _MAIN:
                    service, lent = self._lent.get(header.service) or await self._borrow(
                        header.service, libqi
                    )
                    header = header._replace(service=service, object=lent)
            except _Refused as error:
                if calls and self._unanswered.pop(header.id, header.type == _CALL):
                    name = self._offer.services.get(header.service, "NAOqi")
                    await self._send(self._writer, *_error(header, f"{name}: {error}"))
            else:
                if header.type == _POST:
                    header, payload = await self._as_call(header, payload, libqi)
                await self._send(libqi, header, payload)
            header = await _header(self._reader)

    def _count(self, call: _Header, payload: bytes) -> None:
        """Keep account of callbacks and objects. Raises _Refused for a callback too many."""
        place = call.service, call.object
        link = *place, payload[8:16]
        if call.action in _CONNECTS and call.service:  # 0 is where a program logs in, without signals
            if link in self._links:
                raise _Refused("two callbacks have one number")
            if len(self._links) >= MOST_LINKS + _OWN_LINKS:
                raise _Refused(f"this program has {MOST_LINKS} callbacks already: disconnect some")
            self._links.add(link)
        elif call.action == _DISCONNECT:
            self._links.discard(link)
        elif call.action == _LET_GO and self.client is not None and place in self.client.objects:
            self.client.objects.remove(place)
            self._links = {each for each in self._links if each[:2] != place}

    async def _payload(self, size: int) -> bytes:
        """Return the payload of a message. Raises _Refused when it is too large."""
        if size <= LARGEST_MESSAGE:
            return await self._reader.readexactly(size)
        left = size
        while left:
            left -= len(await self._reader.readexactly(min(left, LARGEST_MESSAGE)))
        raise _Refused(f"a message of {size} bytes is too large: {LARGEST_MESSAGE} at most")

    async def _as_call(
        self, post: _Header, payload: bytes, libqi: asyncio.StreamWriter
    ) -> tuple[_Header, bytes]:
        """Return what stands for a post, so that libqi answers: it does not report the end of a post."""
        call = post._replace(type=_CALL)
        if (post.service, post.object) in self._origins:  # an object of a service has only operations
            return call, payload
        await self._send(libqi, post, payload)  # perhaps to a signal, which cannot be called
        return call._replace(action=_QUESTION, flags=0, size=0), b""

    async def _pass_answers(self, libqi: asyncio.StreamReader) -> None:
        """Pass messages of libqi to the program."""
        while True:
            header = await _header(libqi)
            payload = await libqi.readexactly(header.size)
            if header.service == self._offer.door and header.id >= _OWN_CALLS and self._borrowing is not None:
                self._borrowing.set_result((header.type, payload))
                self._borrowing = None
                continue
            if header.type in (_REPLY, _ERROR, _CANCELED):
                wanted = self._unanswered.pop(header.id, True)
                self._fewer.set()
                if not wanted:
                    continue
            if header.type == _REPLY and self.client is not None:
                self.client.objects.update(self._addresses(payload))
            if header.service == _DIRECTORY:  # services are where the program has found this one
                payload = payload.replace(self._announced, self._reached)
            origin = self._origins.get((header.service, header.object))
            if origin is not None:
                header = header._replace(service=origin, object=_MAIN)
            await self._send(self._writer, header._replace(size=len(payload)), payload)

    async def _have_room(self) -> None:
        """Wait while libqi is busy with the program: others' calls, such as a stop, queue behind few."""
        while len(self._unanswered) - (self.client.awaited_calls if self.client else 0) >= MOST_SHORT:
            self._fewer.clear()
            await self._fewer.wait()

    async def _borrow(self, service: int, libqi: asyncio.StreamWriter) -> tuple[int, int]:
        """Return the address of the program's own object of a service. Raises _Refused."""
        if self.client is None:
            self.client = client = self._admit()
            loop = asyncio.get_running_loop()
            client.on_awaited_call = lambda: loop.call_soon_threadsafe(self._fewer.set)
            self._key = self._offer.key(self.client)
        door = self._offer.door
        argument = f"{self._key} {self._offer.services[service]}".encode()
        payload = _NUMBER.pack(len(argument)) + argument
        call = _Header(_MAGIC, next(self._own_calls), len(payload), 0, _CALL, 0, door, _MAIN, _FIRST_METHOD)
        borrowing = self._borrowing = asyncio.get_running_loop().create_future()
        await self._send(libqi, call, payload)
        async with asyncio.timeout(self._talk_limit):
            kind, answer = await borrowing
        for address in self._addresses(answer) if kind == _REPLY else ():
            self._lent[service] = address
            self._origins[address] = service
            return address
        raise _Refused("the robot is shutting down")

    def _addresses(self, answer: bytes) -> Iterator[tuple[int, int]]:
        """Yield the address of the object that is an answer, if it is one: it or an identity ends it."""
        for end in (_ADDRESS.size, _ADDRESS.size + _UID):
            if len(answer) >= end:
                service, lent = _ADDRESS.unpack_from(answer, len(answer) - end)
                if service == self._offer.door:
                    yield service, lent
                    return

    async def _send(self, writer: asyncio.StreamWriter, header: _Header, payload: bytes) -> None:
        """Send a message. Raises TimeoutError when the other side does not take it."""
        # Not `writelines`: with that of Python 3.12, `drain` waits for nothing.
        writer.write(_HEADER.pack(*header) + payload)
        async with asyncio.timeout(self._talk_limit):
            await writer.drain()


async def _header(reader: asyncio.StreamReader) -> _Header:
    """Return the next header. Raises ValueError when it is none."""
    header = _Header(*_HEADER.unpack(await reader.readexactly(_HEADER.size)))
    if header.magic != _MAGIC:
        raise ValueError("this is not libqi")
    return header


def _error(call: _Header, what: str) -> tuple[_Header, bytes]:
    """Return the message that a call failed: a value of any type (m), which is a text (s)."""
    text = what.encode()
    payload = b"".join((_NUMBER.pack(1), b"s", _NUMBER.pack(len(text)), text))
    return call._replace(type=_ERROR, flags=0, size=len(payload)), payload


def _url_of(address: tuple[Any, ...]) -> str:
    host, port, *_ = address
    return f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"
