"""Large byte sequences through shared memory: on one machine they are written once and read once.

The message is then only a reference: the rest of the payload, and the place of the byte sequences in the
sender's memory. docs/decisions/0009-shared-memory.md compares this with Zenoh's own shared memory, and
justifies the memory barriers. The memory consists of files of eight slots without a name in any folder; the
system frees them when the last process closes them. They are sealed, so that no reader loses memory.
"""

from __future__ import annotations

import fcntl
import hashlib
import itertools
import logging
import math
import mmap
import os
import re
import secrets
import struct
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Final

import msgspec
import zenoh
from msgspec import Meta

from .._codec import LARGE, LARGEST_BULK, Parted, Pieces, decode_bounded, too_large
from .._presence import parse_client_token
from ..exceptions import ConnectionLostException, MarshalException

LENT_FOR: Final = 5.0  # s after which lent memory is used again: its reader was killed

# Header of a slot: its generation, 0 while it is written, and the generation that its reader gave back.
HEADER: Final = struct.Struct("=QQ")
RETURNED: Final = struct.Struct("=Q")  # the second of these
SLOT_START: Final = 64  # bytes from a slot's header to what it holds: a line of the processor's cache
SLOTS: Final = 8  # in each file

_SEALS: Final = 0x7  # F_SEAL_SEAL, F_SEAL_SHRINK, F_SEAL_GROW: Python has the names on Linux alone
_NAME: Final = "zenoh_ice-"
_CAPABILITIES: Final = re.compile(r"^Cap(?:Prm|Eff):\s*([0-9a-f]+)$", re.MULTILINE)

_LAST_READS: Final = 0.5  # s
_READ_PERIOD: Final = 0.002  # s
_LARGEST_SLOT: Final = 32 << 20  # bytes of a slot; what is larger goes over the network
_MOST_PARTS: Final = 256  # large byte sequences in one payload
_MOST_MAPS: Final = 256  # at once; a robot's cameras and servants are about ten
_MOST_CLIENTS: Final = 1 << 14  # more than any robot has
_WORD_COMES: Final = 0.5  # s until all existing tokens are known

_Number = Annotated[int, Meta(ge=0, lt=1 << 62)]
_gate: Final = threading.Lock()

_logger = logging.getLogger(__name__)


class SharedMemory:
    """The shared memory of a communicator: its own, to send from, and that of others; thread-safe.

    `watch_clients` reports the tokens of clients to a function; `on_unreadable` is called, once, when
    memory of others exists that this process may not read.
    """

    def __init__(
        self,
        *,
        enabled: bool,
        watch_clients: Callable[[Callable[[str, bool], object]], object],
        on_unreadable: Callable[[], object],
    ) -> None:
        self.space: Final = memory_space() if enabled else ""
        """The same in all processes that can read each other's memory; empty if this one takes no part."""
        self.readable_space = self.space
        """The space whose memory this process can read, as far as known by now."""
        self._watch_clients: Final = watch_clients
        self._on_unreadable: Final = on_unreadable
        self._lock: Final = threading.RLock()
        self._files: Final[set[MemoryFile]] = set()
        self._lent: Final[dict[int, MemoryFile]] = {}  # by capacity: what answers are lent from
        self._may_make = bool(self.space)
        self._maps: Final[dict[tuple[str, bool], tuple[Path, mmap.mmap]]] = {}  # by token, and whether lent
        self._closed = False
        self._known_at = math.inf  # when all clients are known; they are followed from the first query on
        # Clients that can read this memory, and others; changed only on the thread that reports tokens. A
        # token with another client's id has only one effect: images go over the network.
        self._near: Final[set[str]] = set()
        self._far: Final[set[str]] = set()

    def lend(self, payload: Pieces, client: str) -> bytes | None:
        """Write the large parts of a payload for one reader, which gives the memory back.

        Return the reference to send; None if the client cannot read it, or if there is no room.
        """
        self._follow_clients()
        if client not in self._near or client in self._far:
            return None
        capacity = _capacity(payload)
        with self._lock:
            file = self._lent.get(capacity) or self.make_file(capacity)
            if file is None:
                return None
            self._lent[capacity] = file
        return file.place(payload, lent=True)

    def readable_by_all(self) -> bool:
        """Return whether all clients of the realm can read this process's memory."""
        self._follow_clients()
        return not self._far and time.monotonic() >= self._known_at

    def make_file(self, capacity: int) -> MemoryFile | None:
        """Return memory with slots of `capacity` bytes; None if none is available."""
        with self._lock:
            if not self._may_make or capacity > _LARGEST_SLOT:
                return None
            try:
                file = MemoryFile(capacity)
            except OSError as error:
                self._may_make = False
                _logger.warning("no shared memory, large payloads go over the network: %s", error)
                return None
            self._files.add(file)
            return file

    def drop_file(self, file: MemoryFile | None) -> None:
        """Release memory that was made."""
        with self._lock:
            if file in self._files:
                self._files.remove(file)
                file.close()

    def read(self, payload: zenoh.ZBytes, limit: int, what: str) -> bytes | Parted:
        """Return a received payload with the bytes that it refers to, if these are at most `limit` bytes.

        Raises MarshalException for more, ConnectionLostException when its memory is gone: its sender ended,
        or the payload was read too late.
        """
        if len(payload) > limit:
            raise too_large(len(payload), limit, what)
        data = payload.to_bytes()
        if not data or data[0] & 0xF0 != 0x90:  # no array in MessagePack; every whole payload is a map
            return data
        reference = decode_reference(data, what)
        if (size := len(reference.rest) + sum(reference.sizes)) > limit:
            raise too_large(size, limit, what)
        try:
            _, memory = self._maps.get((reference.token, reference.lent)) or self._open(reference)
            return Parted(reference.rest, reference.places, _copy(memory, reference, what))
        except (FileNotFoundError, ProcessLookupError, ValueError) as error:
            raise ConnectionLostException(
                f"{what} was lost with its shared memory: its sender ended, or it was not read in time"
            ) from error
        except OSError as error:
            with self._lock:
                first, self.readable_space = bool(self.readable_space), ""
            if first:
                _logger.warning(
                    "this process may not read the memory of others, although it seemed allowed: large "
                    "payloads come over the network; shared_memory = false in the settings avoids the attempt"
                )
                self._on_unreadable()
            raise ConnectionLostException(
                f"{what}: the shared memory of process {reference.process} cannot be read from here "
                f"({error}); the next comes over the network"
            ) from error

    def close_ended(self) -> None:
        """Close the memory of processes that have ended."""
        with self._lock:
            for key, (path, _) in list(self._maps.items()):
                if not _is_open(path, key[0]):
                    self._maps.pop(key)[1].close()

    def close(self) -> None:
        """Release everything; from now on everything is sent over the network.

        Waits for at most half a second for readers that have not yet read the memory lent to them.
        """
        with self._lock:
            self._may_make = False
            lent = list(self._lent.values())
        deadline = time.monotonic() + _LAST_READS
        while any(len(list(file.free())) < SLOTS for file in lent) and time.monotonic() < deadline:
            time.sleep(_READ_PERIOD)
        with self._lock:
            self._closed = True
            self._lent.clear()
            while self._files:
                self._files.pop().close()
            while self._maps:
                self._maps.popitem()[1][1].close()

    def _follow_clients(self) -> None:
        with self._lock:
            if self.space and self._known_at == math.inf:
                self._watch_clients(self._on_token)
                self._known_at = time.monotonic() + _WORD_COMES

    def _on_token(self, key: str, came: bool) -> None:
        client, space = parse_client_token(key) or ("", "")
        known = self._near if space == self.space else self._far
        if not came:
            known.discard(client)
        elif client and len(known) < _MOST_CLIENTS:
            known.add(client)

    def _open(self, reference: MemoryReference) -> tuple[Path, mmap.mmap]:
        key = reference.token, reference.lent
        with self._lock:
            if self._closed:
                raise ValueError("this end was closed")
            if key not in self._maps:
                self.close_ended()
                if len(self._maps) >= _MOST_MAPS:
                    self._maps.pop(next(iter(self._maps)))[1].close()
                self._maps[key] = _map(reference)
            return self._maps[key]


class Ring:
    """Memory for a stream: the newest payload replaces the oldest, read or not; for a single thread."""

    def __init__(self, memory: SharedMemory) -> None:
        self._memory: Final = memory
        self._file: MemoryFile | None = None

    def place(self, payload: Pieces) -> bytes | None:
        """Write the large parts of a payload, and return the reference to them.

        None if there is no room, or if one of the clients of the realm could not read it.
        """
        if not self._memory.readable_by_all():
            return None
        capacity = _capacity(payload)
        if self._file is None or self._file.capacity < capacity:
            self.close()
            self._file = self._memory.make_file(capacity)
        return None if self._file is None else self._file.place(payload, lent=False)

    def close(self) -> None:
        """Release the memory."""
        self._memory.drop_file(self._file)
        self._file = None


class MemoryFile:
    """A file with eight slots for payloads, each of `capacity` bytes, in whole pages; thread-safe.

    The system allocates memory as slots are written. Raises OSError when it has no room for the file.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity: Final = capacity
        self.token: Final = secrets.token_hex(16)
        self._lock: Final = threading.Lock()
        self._stride: Final = capacity + mmap.PAGESIZE
        # Slices raise ValueError when the map was closed; the functions of struct raise TypeError.
        starts = range(0, self._stride * SLOTS, self._stride)
        self._headers: Final = [slice(start, start + HEADER.size) for start in starts]
        self._generations: Final = [0] * SLOTS
        self._lent_until: Final = [-math.inf] * SLOTS
        self._oldest: Final = itertools.cycle(range(SLOTS))  # slots of a stream
        self.file: Final = os.memfd_create(_NAME + self.token, os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(self.file, self._stride * SLOTS)
            fcntl.fcntl(self.file, fcntl.F_ADD_SEALS, _SEALS)
            self._memory: Final = mmap.mmap(self.file, self._stride * SLOTS)
        except OSError:
            os.close(self.file)
            raise

    def place(self, payload: Pieces, *, lent: bool) -> bytes | None:
        """Write the large parts of a payload into a slot, and return the reference to them.

        A lent payload stays there until its only reader gives it back, others until eight newer ones
        are written. None if all slots are lent, and after `close`.
        """
        memory, sizes = self._memory, tuple(map(len, payload.large))
        try:
            with self._lock:
                slot = next(self.free() if lent else self._oldest, None)
                if slot is None:
                    return None
                self._lent_until[slot] = math.inf
                self._generations[slot] = generation = self._generations[slot] + 1
                memory[self._headers[slot]] = HEADER.pack(0, 0)  # what it held cannot be read any more
            fence()
            position = slot * self._stride + SLOT_START
            for part, size in zip(payload.large, sizes, strict=True):
                memory[position : position + size] = part
                position += size
            fence()
            memory[self._headers[slot]] = HEADER.pack(generation, 0)
        except ValueError:  # closed
            return None
        # Counted from now, not from the start: a thread suspended in between must not share its slot.
        self._lent_until[slot] = time.monotonic() + LENT_FOR
        memory_file = os.getpid(), self.file, self.token
        rest = payload.places, sizes, payload.without_large()
        return msgspec.msgpack.encode((*memory_file, slot, generation, lent, *rest))  # a MemoryReference

    def free(self) -> Iterator[int]:
        """Yield the slots in which nothing is lent; the first may still be in the processor's cache."""
        for slot, until in enumerate(self._lent_until):
            if until < time.monotonic() or self.returned(slot):
                yield slot

    def returned(self, slot: int) -> bool:
        """Return whether a slot's reader gave it back, or there never was one; ValueError after `close`."""
        _, given_back = HEADER.unpack(self._memory[self._headers[slot]])
        return bool(given_back == self._generations[slot])

    def close(self) -> None:
        """Release the memory; readers that mapped it can still read."""
        self._memory.close()
        os.close(self.file)


class MemoryReference(msgspec.Struct, array_like=True, frozen=True):
    """The place of a payload's large byte sequences in memory, and the rest of it."""

    process: Annotated[int, Meta(ge=1, lt=1 << 31)]
    file: Annotated[int, Meta(ge=0, lt=1 << 31)]  # the open file of that process that is the memory
    token: Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]  # part of its name, which nobody can guess
    slot: Annotated[int, Meta(ge=0, lt=SLOTS)]
    generation: Annotated[int, Meta(ge=1, lt=1 << 62)]  # the slot's, until something else is written there
    lent: bool  # whether it is for one reader, which gives it back
    places: Annotated[tuple[_Number, ...], Meta(max_length=_MOST_PARTS)]
    sizes: Annotated[tuple[_Number, ...], Meta(max_length=_MOST_PARTS)]
    rest: bytes


_decode: Final = msgspec.msgpack.Decoder(MemoryReference).decode


def decode_reference(payload: bytes, what: str) -> MemoryReference:
    """Return a received reference; raises MarshalException for a malformed one."""
    reference = decode_bounded(_decode, payload, LARGEST_BULK, f"{what}: reference to shared memory")
    if len(reference.places) != len(reference.sizes):
        raise MarshalException(f"{what}: reference to shared memory: as many places as sizes are wanted")
    return reference


def memory_space() -> str:
    """Return the same text in all processes that can read each other's memory; empty if none can.

    These are processes of one user and group with the same capabilities, on one machine, and in one container
    if in any: see "Ptrace access mode checking" in ptrace(2).
    """
    own = Path("/proc/self")
    try:
        # An old Python cannot make such memory. A process whose program has capabilities, say, cannot be
        # inspected by others of its user: its files in /proc belong to root.
        if not hasattr(os, "memfd_create") or (own / "fd").stat().st_uid != os.geteuid():
            return ""
        machine = Path("/proc/sys/kernel/random/boot_id").read_text("ascii").strip()
        kinds = {"pid", "user"}  # a system may lack one of them
        namespaces = sorted(path.stat().st_ino for path in (own / "ns").iterdir() if path.name in kinds)
        permitted, effective = _CAPABILITIES.findall((own / "status").read_text("utf-8", "replace"))
    except (OSError, ValueError):  # no /proc
        return ""
    if permitted != effective:  # not even another such process
        return ""
    rights = f"{os.geteuid()} {os.getegid()} {permitted}"
    return hashlib.sha256(f"{machine} {namespaces} {rights}".encode()).hexdigest()[:16]


def fence() -> None:
    """Make other processes see earlier reads and writes before later ones: a memory barrier.

    Processors such as ARM's do not keep this order. Releasing a lock and then acquiring one enforces it.
    """
    for _ in range(2):
        with _gate:
            pass


def _copy(memory: mmap.mmap, reference: MemoryReference, what: str) -> list[bytes]:
    """Return the bytes that a reference is to, and give lent ones back; ValueError if they are gone."""
    stride = len(memory) // SLOTS
    offset = reference.slot * stride
    position = offset + SLOT_START
    if SLOT_START + sum(reference.sizes) > stride:
        raise MarshalException(f"{what}: a reference beyond the end of its slot of shared memory")
    large = []
    for size in reference.sizes:
        large.append(memory[position : position + size])
        position += size
    fence()
    generation, _ = HEADER.unpack(memory[offset : offset + HEADER.size])
    if generation != reference.generation:
        raise ValueError("written again")
    if reference.lent:
        memory[offset + RETURNED.size : offset + HEADER.size] = RETURNED.pack(generation)
    return large


def _map(reference: MemoryReference) -> tuple[Path, mmap.mmap]:
    """Map the memory that a reference is to; raises OSError or ValueError if it cannot be mapped."""
    path = Path("/proc", str(reference.process), "fd", str(reference.file))
    # Only a handle to its path at first: opening a device or a pipe may have side effects.
    handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        found = Path("/proc/self/fd", str(handle))
        if not _is_open(found, reference.token):
            raise FileNotFoundError(str(path))
        file = os.open(found, (os.O_RDWR if reference.lent else os.O_RDONLY) | os.O_CLOEXEC)
    finally:
        os.close(handle)
    try:
        if fcntl.fcntl(file, fcntl.F_GET_SEALS) & _SEALS != _SEALS:
            raise PermissionError("it is not sealed")  # its owner could shrink it while we read
        return path, mmap.mmap(file, 0, access=mmap.ACCESS_WRITE if reference.lent else mmap.ACCESS_READ)
    finally:
        os.close(file)


def _is_open(path: Path, token: str) -> bool:
    """Return whether the process that made a memory still has it."""
    try:
        return str(path.readlink()) == f"/memfd:{_NAME}{token} (deleted)"
    except OSError:
        return False


def _capacity(payload: Pieces) -> int:
    """Return the size of a slot for a payload, with some room: images of one kind may differ in size."""
    return max(LARGE, 1 << (sum(map(len, payload.large)) - 1).bit_length())
