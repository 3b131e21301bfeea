"""Let programs with Fast DDS find our participant of Cyclone DDS, and let DDS miss a program that is gone.

Cyclone DDS announces a participant with its parameter 0x8007. Fast DDS has another one of that id, and drops
the whole announcement: its programs never answer, and see no robot. So each participant that announces itself
here is sent our announcement with the id of that parameter replaced by that of padding.

A program that is killed, or whose package does not leave DDS at its exit, is missed only after the time that
it announced, 10 s with Cyclone DDS and 20 s with Fast DDS, while its robot would walk on. But the system has
closed its port, and refuses the next announcement to it: then its farewell is sent in its place.
"""

from __future__ import annotations

import logging
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from naoserver.errors import RobotError

_logger = logging.getLogger(__name__)

_GROUP, _LOOPBACK = "239.255.0.1", "127.0.0.1"
_FIRST_PORT, _PORTS = 7400, 250
"""Where a domain listens to announcements, and how far it is to the next domain (DDSI-RTPS 2.5, 9.6.2.3)."""
_LEAST_PORT: Final = 1024
_PERIOD: Final = 0.25
"""Wall seconds between two announcements to a participant."""
_END_LIMIT: Final = 5.0
_MOST: Final = 64
"""Most participants that are known; after that, the one that was met first is forgotten."""
_LONGEST: Final = 8192
"""Most bytes of an announcement."""

_HEADER: Final = 20
"""Bytes before the parts of a message: version, vendor, and the beginning of its participant's ids."""
_FAST_DDS: Final = b"\x01\x0f"
_DATA, _PLAIN = 0x15, 0x05
"""The part of a message that has data, and its flags: little endian, nothing between head and data."""
_ANNOUNCER, _PARTICIPANT = b"\0\1\0\xc2", b"\0\0\1\xc1"
"""The ends of the ids of what announces a participant, and of itself."""
_PAD, _END, _PORT, _GUID, _KEY, _STATUS, _VERSION = 0x00, 0x01, 0x32, 0x50, 0x70, 0x71, 0x8007
"""Ids of parameters; the last one is in the way."""


@dataclass(frozen=True, slots=True)
class _Met:
    """A participant by the header of its messages, and the way to it."""

    header: bytes
    way: socket.socket


class Introduction:
    """Introduce the participant whose ids begin with `prefix` to all others of a domain, on loopback alone.

    It has a thread and sockets from `start` to `close`.
    """

    def __init__(self, domain: int, prefix: bytes) -> None:
        self._prefix = prefix
        self._port = _FIRST_PORT + _PORTS * domain
        self._announcement = b""
        self._met: dict[tuple[int, bytes], _Met] = {}
        self._ending = threading.Event()
        self._ears = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._thread = threading.Thread(target=self._run, name="introduction", daemon=True)

    def start(self) -> None:
        """Begin. Raises RobotError if it cannot listen there."""
        ears, loopback = self._ears, socket.inet_aton(_LOOPBACK)
        try:
            ears.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            ears.bind((_GROUP, self._port))
            ears.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(_GROUP) + loopback)
            ears.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, loopback)
        except OSError as error:
            ears.close()
            raise RobotError(f"cannot hear programs at {_GROUP}:{self._port} on loopback: {error}") from None
        ears.settimeout(_PERIOD)
        self._thread.start()

    def close(self) -> None:
        """End, with a limit."""
        self._ending.set()
        if self._thread.ident is None:
            self._ears.close()
        else:
            self._thread.join(_END_LIMIT)

    def _run(self) -> None:
        due = 0.0
        try:
            while not self._ending.is_set():
                with suppress(TimeoutError):
                    self._hear(self._ears.recv(_LONGEST))
                if time.monotonic() >= due:
                    due = time.monotonic() + _PERIOD
                    for key in list(self._met):
                        self._announce(key)
        except Exception:
            _logger.exception("programs are no longer found, or missed late")
        finally:
            for met in self._met.values():
                met.way.close()
            self._ears.close()

    def _hear(self, message: bytes) -> None:
        """Keep our announcement, and who else announces itself."""
        parameters = list(_parameters(message))
        header = message[:_HEADER]
        if not parameters or header[:4] != b"RTPS":
            return
        if header[8:] == self._prefix:
            padded = bytearray(message)
            for place, name, _value in parameters:
                if name == _VERSION:
                    struct.pack_into("<H", padded, place, _PAD)
            self._announcement = bytes(padded)
            return
        for _place, name, value in parameters:
            if name == _PORT and len(value) == 24:
                self._meet(header, int.from_bytes(value[4:8], "little"))

    def _meet(self, header: bytes, port: int) -> None:
        """Announce ourselves to a participant that is new."""
        # With Fast DDS each has a port of its own: if it is another's now, the one before is gone.
        key = port, b"" if header[6:8] == _FAST_DDS else header
        if (known := self._met.get(key)) and known.header == header:
            return
        if known:
            self._part(key)
        if _LEAST_PORT <= port < 2**16:
            if len(self._met) == _MOST:
                self._met.pop(next(iter(self._met))).way.close()
            way = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            way.connect((_LOOPBACK, port))
            self._met[key] = _Met(header, way)
            self._announce(key)

    def _announce(self, key: tuple[int, bytes]) -> None:
        """Announce ourselves to a participant, unless it is gone."""
        try:
            self._met[key].way.send(self._announcement)
        except ConnectionRefusedError:  # the last time
            self._part(key)

    def _part(self, key: tuple[int, bytes]) -> None:
        """Say in place of a participant that it leaves."""
        met = self._met.pop(key)
        met.way.close()
        self._ears.sendto(_farewell(met.header), (_GROUP, self._port))


def _parameters(message: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Yield place, id and value of each parameter in a message's announcements, up to what is cut off."""
    at = _HEADER
    while at + 4 <= len(message):
        kind, flags, length = struct.unpack_from("<BBH", message, at)
        at += 4
        end = min(at + length, len(message)) if length else len(message)
        place = at + 24 if (kind, flags, message[at + 8 : at + 12]) == (_DATA, _PLAIN, _ANNOUNCER) else end
        while place + 4 <= end:
            name, size = struct.unpack_from("<HH", message, place)
            if name == _END or place + 4 + size > end:
                break
            yield place, name, message[place + 4 : place + 4 + size]
            place += 4 + size
        at = end


def _farewell(header: bytes) -> bytes:
    """Return the message with which a participant leaves (DDSI-RTPS 2.5, 8.5.3.4, 9.6.4.8 and 9.6.4.9)."""
    guid = header[8:] + _PARTICIPANT
    head = struct.pack("<HH4s4siI", 0, 16, bytes(4), _ANNOUNCER, 0, 2)
    leaves = struct.pack("<HH4sHH16sHH", _STATUS, 4, b"\0\0\0\3", _KEY, 16, guid, _END, 0)
    data = struct.pack("<4sHH16sHH", b"\0\3\0\0", _GUID, 16, guid, _END, 0)
    length = len(head + leaves + data)
    return header + struct.pack("<BBH", _DATA, 0x0B, length) + head + leaves + data
