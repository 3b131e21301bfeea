"""Large byte sequences through shared memory: on one machine they are written once and read once.

What is sent then is a reference: the rest of the payload, and where the byte sequences stand in memory of
the sender. docs/decisions/0009-shared-memory.md compares this with Zenoh's own shared memory, which copies an
image twice at the receiver and leaves the memory of a killed process behind, and argues the memory barriers.

The memory is files without a name in any folder, divided into slots. The system takes such a file back with
the last process that has it open, however that ends. It is sealed at its size, so that no reader can be
struck by memory that is gone.
"""

from __future__ import annotations

import fcntl
import hashlib
import logging
import math
import mmap
import os
import re
import secrets
import struct
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Final

import msgspec
import zenoh
from msgspec import Meta

from .._codec import LARGE, Parted, Pieces
from .._tokens import parse_client_token
from ..exceptions import ConnectionLostException, MarshalException
from ..text import printable
from ..transport import Closing, Served

__all__ = ["LENT_FOR", "MemoryFile", "MemoryMaps", "MemoryReference", "Ring", "SharedMemory", "memory_space"]

LENT_FOR: Final = 5.0
"""Seconds after which what was lent is used again though nobody gave it back: its reader was killed."""

HEADER: Final = struct.Struct("=QQ")
"""Of a slot: its generation, 0 while it is written, and the generation that its reader gave back."""
RETURNED: Final = struct.Struct("=Q")
"""The second of these."""
SLOT_START: Final = 64
"""Bytes from a slot's header to what it holds: a line of the processor's cache."""
SLOTS: Final = 8
"""In each file."""
SEALS: Final = 0x1 | 0x2 | 0x4
"""F_SEAL_SEAL, F_SEAL_SHRINK and F_SEAL_GROW, by number: Python has the names on Linux alone."""

_F_ADD_SEALS: Final = 1033
_F_GET_SEALS: Final = 1034
_PAGE: Final = mmap.PAGESIZE
_CAPABILITIES: Final = re.compile(r"^Cap(?:Prm|Eff):\s*([0-9a-f]+)$", re.MULTILINE)

_LAST_READS: Final = 0.5  # s
_LOOK_AGAIN: Final = 0.002  # s
_LARGEST: Final = 32 << 20  # bytes of a slot; what is larger goes over the network
_MOST_PARTS: Final = 256  # large byte sequences in one payload
_MOST_MAPS: Final = 256  # at a time; a robot's cameras and servants are some ten
_MOST_CLIENTS: Final = 1 << 14  # no robot has so many
_WORD_COMES: Final = 0.5  # s until all tokens that are there are known

# The first byte of an array in MessagePack; every payload is a map.
_ARRAY: Final = 0x90
_ARRAY_MASK: Final = 0xF0

_gate: Final = threading.Lock()

_logger = logging.getLogger(__name__)


class SharedMemory:
    """What a communicator shares: memory that it sends from, and that of others; for any thread."""

    def __init__(
        self,
        *,
        enabled: bool,
        watch_clients: Callable[[Callable[[str, bool], object]], Served] = lambda _: Closing(lambda: None),
        on_unreadable: Callable[[], object] = lambda: None,
    ) -> None:
        """Make nothing yet.

        `watch_clients` reports the tokens of clients to a function; `on_unreadable` is called, once, when the
        memory of others is there and may not be read.
        """
        self.space: Final = memory_space() if enabled else ""
        """The same in all processes that can read each other's memory; empty when this one takes no part."""
        self._neighbors: Final = _Neighbors(watch_clients, self.space)
        self.lender: Final = _Lender(self.make_file)
        self._maps: Final = MemoryMaps(self._give_up)
        self._on_unreadable: Final = on_unreadable
        self._lock: Final = threading.Lock()
        self._files: list[MemoryFile] = []
        self._enabled = bool(self.space)
        self._gave_up = False

    @property
    def readable_space(self) -> str:
        """The space whose memory this process can read, as far as known by now."""
        return "" if self._gave_up else self.space

    def ring(self) -> Ring:
        """Return memory to send one stream from."""
        return Ring(self)

    def lend(self, payload: Pieces, client: str) -> bytes | None:
        """Write what is large in a payload, for one reader, who gives the memory back.

        Return the reference to send; None where the client cannot read it, or where there is no room.
        """
        return self.lender.place(payload) if self.space and self._neighbors.includes(client) else None

    def readable_by_all(self) -> bool:
        """Return whether all clients of the realm can read this process's memory."""
        return bool(self.space) and self._neighbors.are_all()

    def read(self, payload: zenoh.ZBytes, limit: int, what: str) -> bytes | Parted:
        """Return a payload that came, with what it refers to, if that is no more than `limit` bytes.

        Raises MarshalException when it is more, ConnectionLostException when its memory is gone: its sender
        ended, or it was not read for too long.
        """
        size = len(payload)
        if size > limit:
            raise _too_large(size, limit, what)
        data = payload.to_bytes()
        if not data or data[0] & _ARRAY_MASK != _ARRAY:
            return data
        reference = decode_reference(data, what)
        if reference.size > limit:
            raise _too_large(reference.size, limit, what)
        return Parted(reference.rest, reference.places, self._maps.read(reference, what))

    def make_file(self, capacity: int) -> MemoryFile | None:
        """Return memory with slots of `capacity` bytes; None where there is none."""
        with self._lock:
            if not self._enabled or capacity > _LARGEST:
                return None
            try:
                file = MemoryFile(capacity)
            except OSError as error:
                self._enabled = False
                _logger.warning("no shared memory, large payloads go over the network: %s", error)
                return None
            self._files.append(file)
            return file

    def drop_file(self, file: MemoryFile) -> None:
        """Let go of memory that was made."""
        with self._lock:
            if file in self._files:
                self._files.remove(file)
                file.close()

    def close_ended(self) -> None:
        """Close the memory of processes that have ended."""
        self._maps.close_ended()

    def close(self) -> None:
        """Let go of everything; what is sent goes over the network from now on.

        Waits for at most half a second for those who have not read yet what was lent to them.
        """
        with self._lock:
            self._enabled = False
        self.lender.close(_LAST_READS)
        with self._lock:
            while self._files:
                self._files.pop().close()
        self._maps.close()

    def _give_up(self) -> None:
        with self._lock:
            first, self._gave_up = not self._gave_up, True
        if first:
            _logger.warning(
                "this process may not read the memory of others, though it looks as if: large payloads come "
                "over the network; shared_memory = false in the settings says so from the beginning"
            )
            self._on_unreadable()


class _Lender:
    """Memory for payloads that have one reader, who gives it back."""

    def __init__(self, make_file: Callable[[int], MemoryFile | None]) -> None:
        self._make_file: Final = make_file
        self._lock: Final = threading.Lock()
        self._files: dict[int, tuple[MemoryFile, list[float]]] = {}
        """By capacity: the memory, and until when each slot is lent."""

    def place(self, payload: Pieces) -> bytes | None:
        """Write what is large in a payload, and return the reference to it; None where there is no room."""
        with self._lock:
            try:
                taken = self._take(sum(map(len, payload.large)))
            except ValueError:  # closed
                return None
        if taken is None:
            return None
        lent, file, slot = taken
        try:
            return _write(file, slot, payload, lent=True)
        finally:
            # From now on, not from before: a thread that stood still in between must not share its slot.
            lent[slot] = time.monotonic() + LENT_FOR

    def close(self, timeout: float) -> None:
        """Wait for at most `timeout` s until nobody has anything that is lent, and lend nothing any more."""
        deadline = time.monotonic() + timeout
        while self._is_lent() and time.monotonic() < deadline:
            time.sleep(_LOOK_AGAIN)
        with self._lock:
            self._files.clear()

    def _is_lent(self) -> bool:
        with self._lock:
            now = time.monotonic()
            return any(
                until >= now and not file.returned(slot)
                for file, lent in self._files.values()
                for slot, until in enumerate(lent)
            )

    def _take(self, size: int) -> tuple[list[float], MemoryFile, int] | None:
        capacity = _capacity(size)
        if capacity not in self._files:
            made = self._make_file(capacity)
            if made is None:
                return None
            self._files[capacity] = made, [-math.inf] * SLOTS
        file, lent = self._files[capacity]
        now = time.monotonic()
        # The first that is free: the processor's cache has what was used last.
        for slot, until in enumerate(lent):
            if until < now or file.returned(slot):
                lent[slot] = math.inf
                file.begin(slot)
                return lent, file, slot
        return None


class Ring:
    """Memory for a stream: the newest payload takes the place of the oldest, read or not; for one thread."""

    def __init__(self, memory: SharedMemory) -> None:
        self._memory: Final = memory
        self._file: MemoryFile | None = None
        self._next = 0

    def place(self, payload: Pieces) -> bytes | None:
        """Write what is large in a payload, and return the reference to it.

        None where there is no room, or where one of the clients of the realm could not read it.
        """
        if not self._memory.readable_by_all():
            return None
        size = sum(map(len, payload.large))
        file = self._file
        if file is None or size > file.capacity:
            self.close()
            file = self._file = self._memory.make_file(_capacity(size))
            if file is None:
                return None
        slot, self._next = self._next, (self._next + 1) % SLOTS
        try:
            file.begin(slot)
        except ValueError:  # closed
            return None
        return _write(file, slot, payload, lent=False)

    def close(self) -> None:
        """Let go of the memory."""
        file, self._file = self._file, None
        if file is not None:
            self._memory.drop_file(file)


class _Neighbors:
    """The clients of a realm, by their tokens: which of them can read the memory of this process.

    They are followed as soon as somebody wants to know. Any client may declare tokens with the id of another
    one: those only make its images come over the network.
    """

    def __init__(self, watch: Callable[[Callable[[str, bool], object]], Served], memory_space: str) -> None:
        self._watch: Final = watch
        self._space: Final = memory_space
        self._lock: Final = threading.Lock()
        self._watching: Served | None = None
        self._known_at = math.inf
        # Changed on the thread alone that reports tokens.
        self._near: Final[set[str]] = set()
        self._far: Final[set[str]] = set()

    def includes(self, client: str) -> bool:
        """Return whether a client is known to be one that can read this process's memory."""
        self._follow()
        return client in self._near and client not in self._far

    def are_all(self) -> bool:
        """Return whether all clients of the realm can read this process's memory."""
        self._follow()
        return not self._far and time.monotonic() >= self._known_at

    def _follow(self) -> None:
        if self._watching is None:
            with self._lock:
                if self._watching is None:
                    self._known_at = time.monotonic() + _WORD_COMES
                    self._watching = self._watch(self._on_token)

    def _on_token(self, key: str, came: bool) -> None:
        token = parse_client_token(key)
        if token is None:
            return
        client, space = token
        known = self._near if space == self._space else self._far
        if not came:
            known.discard(client)
        elif len(known) < _MOST_CLIENTS:
            known.add(client)


class MemoryFile:
    """Eight slots of equal size in one file; who writes takes care that no two threads use one slot.

    Raises OSError when the system has no room for it.
    """

    def __init__(self, capacity: int) -> None:
        """Make a file with slots for `capacity` bytes each; memory is taken as they are written."""
        self.capacity: Final = capacity
        self.token: Final = secrets.token_hex(16)
        self._stride: Final = -(-(capacity + SLOT_START) // _PAGE) * _PAGE
        self._generations: Final = [0] * SLOTS
        self.file: Final = os.memfd_create(_name(self.token), os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(self.file, self._stride * SLOTS)
            fcntl.fcntl(self.file, _F_ADD_SEALS, SEALS)
            self._memory: Final = mmap.mmap(self.file, self._stride * SLOTS)
        except OSError:
            os.close(self.file)
            raise

    def begin(self, slot: int) -> None:
        """Take a slot for something new; what it held cannot be read any more.

        Raises ValueError when the file was closed, as all that write or read here do.
        """
        self._generations[slot] += 1
        self._set_header(slot, 0)
        fence()

    def write(self, slot: int, parts: Sequence[bytes]) -> int:
        """Write parts, one after the other, into a slot that was begun, and return its generation."""
        memory, generation = self._memory, self._generations[slot]
        position = slot * self._stride + SLOT_START
        for part in parts:
            end = position + len(part)
            memory[position:end] = part
            position = end
        fence()
        self._set_header(slot, generation)
        return generation

    def returned(self, slot: int) -> bool:
        """Return whether a slot's reader gave it back, or there never was one."""
        offset = slot * self._stride
        _, given_back = HEADER.unpack(self._memory[offset : offset + HEADER.size])
        return bool(given_back == self._generations[slot])

    def close(self) -> None:
        """Let go of the memory; who has it mapped goes on reading."""
        self._memory.close()
        os.close(self.file)

    def _set_header(self, slot: int, generation: int) -> None:
        # By slices, which raise ValueError when the map was closed; the functions of struct raise TypeError.
        offset = slot * self._stride
        self._memory[offset : offset + HEADER.size] = HEADER.pack(generation, 0)


def fence() -> None:
    """Order what was read and written before and what comes after, in the eyes of other processes.

    A processor such as ARM's keeps no such order by itself. To release a lock and then take one does.
    """
    for _ in range(2):
        with _gate:
            pass


def link_name(token: str) -> str:
    """Return what the link to such a file among the open files of its process says."""
    return f"/memfd:{_name(token)} (deleted)"


def memory_space() -> str:
    """Return what is the same for all processes that can read each other's memory; empty where none can.

    Those of one user and group with the same capabilities, on one machine, and in one container if in any, as
    ptrace(2) tells under "Ptrace access mode checking".
    """
    if not hasattr(os, "memfd_create"):  # no Linux, or a Python that was built on an old one
        return ""
    try:
        # Of a process that nobody of its user may look into, for its program has capabilities, say, they are
        # root's.
        if Path("/proc/self/fd").stat().st_uid != os.geteuid():
            return ""
        machine = Path("/proc/sys/kernel/random/boot_id").read_text("ascii").strip()
        # A system that knows no such namespaces has one of each.
        namespaces = [
            path.stat().st_ino if path.exists() else 0
            for path in (Path("/proc/self/ns", kind) for kind in ("pid", "user"))
        ]
        permitted, effective = _CAPABILITIES.findall(Path("/proc/self/status").read_text("utf-8", "replace"))
    except (OSError, ValueError):  # no Linux, or no /proc
        return ""
    if permitted != effective:  # not even another such process
        return ""
    rights = f"{os.geteuid()} {os.getegid()} {permitted}"
    return hashlib.sha256(f"{machine} {namespaces} {rights}".encode()).hexdigest()[:16]


def _name(token: str) -> str:
    return f"zenoh_ice-{token}"


class MemoryMaps:
    """The maps of a communicator, kept as long as their makers live; may be used from any thread."""

    def __init__(self, on_unreadable: Callable[[], object]) -> None:
        """Call a function when memory is there and may not be read."""
        self._on_unreadable: Final = on_unreadable
        self._lock: Final = threading.Lock()
        self._maps: dict[str, _Map] = {}
        self._closed = False

    def read(self, reference: MemoryReference, what: str) -> list[bytes]:
        """Return a copy of the byte sequences that a reference is to, and give the memory back if it is lent.

        Raises ConnectionLostException when they are no longer there, or cannot be read from here;
        MarshalException when the reference makes no sense.
        """
        found = self._maps.get(reference.token) or self._open(reference, what)
        memory = found.memory
        large = []
        try:
            stride = len(memory) // SLOTS
            offset = reference.slot * stride
            position = offset + SLOT_START
            if SLOT_START + sum(reference.sizes) > stride:
                raise MarshalException(f"{what}: a reference beyond the end of its slot of shared memory")
            for size in reference.sizes:
                large.append(memory[position : position + size])
                position += size
            fence()
            generation, _ = HEADER.unpack(memory[offset : offset + HEADER.size])
            whole = generation == reference.generation
            if whole and found.writable:
                end = offset + HEADER.size
                memory[end - RETURNED.size : end] = RETURNED.pack(generation)
        except ValueError as error:  # closed by another thread, as its maker ended
            raise _gone(what) from error
        if not whole:
            raise _gone(what)
        return large

    def close(self) -> None:
        """Let go of all memory; nothing can be read any more."""
        with self._lock:
            self._closed = True
            while self._maps:
                self._maps.popitem()[1].memory.close()

    def _open(self, reference: MemoryReference, what: str) -> _Map:
        with self._lock:
            if self._closed:
                raise _gone(what)
            found = self._maps.get(reference.token)
            if found is None:
                self._close_ended()
                if len(self._maps) >= _MOST_MAPS:
                    self._close(next(iter(self._maps)))
                try:
                    found = self._maps[reference.token] = _map(reference)
                except (FileNotFoundError, ProcessLookupError) as error:  # its maker has ended, or closed it
                    raise _gone(what) from error
                except (OSError, ValueError) as error:
                    self._on_unreadable()
                    raise ConnectionLostException(
                        f"{what}: the shared memory of process {reference.process} cannot be read from here "
                        f"({error}); the next comes over the network"
                    ) from error
            return found

    def close_ended(self) -> None:
        """Close what its maker has closed."""
        with self._lock:
            self._close_ended()

    def _close_ended(self) -> None:
        for token, each in list(self._maps.items()):
            if not _is_open(each.path, token):
                self._close(token)

    def _close(self, token: str) -> None:
        self._maps.pop(token).memory.close()


class _Map:
    """A file of another process's, mapped."""

    __slots__ = ("memory", "path", "writable")

    def __init__(self, path: Path, memory: mmap.mmap, *, writable: bool) -> None:
        self.path: Final = path
        self.memory: Final = memory
        self.writable: Final = writable


def _map(reference: MemoryReference) -> _Map:
    """Map the memory that a reference is to; raises OSError or ValueError when that cannot be."""
    path = Path("/proc", str(reference.process), "fd", str(reference.file))
    # Only as a place at first: to open a device or a pipe may do something.
    handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        found = Path("/proc/self/fd", str(handle))
        if not _is_open(found, reference.token):
            raise FileNotFoundError(str(path))
        file = os.open(found, (os.O_RDWR if reference.lent else os.O_RDONLY) | os.O_CLOEXEC)
    finally:
        os.close(handle)
    try:
        if fcntl.fcntl(file, _F_GET_SEALS) & SEALS != SEALS:
            raise PermissionError("it is not sealed")  # its maker could take it away under our eyes
        access = mmap.ACCESS_WRITE if reference.lent else mmap.ACCESS_READ
        return _Map(path, mmap.mmap(file, 0, access=access), writable=reference.lent)
    finally:
        os.close(file)


def _is_open(path: Path, token: str) -> bool:
    """Return whether the process that made a memory still has it."""
    try:
        return str(path.readlink()) == link_name(token)
    except OSError:
        return False


def _gone(what: str) -> ConnectionLostException:
    return ConnectionLostException(
        f"{what} was lost with its shared memory: its sender ended, or it was not read in time"
    )


_Number = Annotated[int, Meta(ge=0, lt=1 << 62)]


class MemoryReference(msgspec.Struct, array_like=True, frozen=True):
    """Where the large byte sequences of a payload are, one after the other, and the rest of it."""

    process: Annotated[int, Meta(ge=1, lt=1 << 31)]
    file: Annotated[int, Meta(ge=0, lt=1 << 31)]
    """The open file of that process that is the memory."""
    token: Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
    """Which nobody can guess: part of the memory's name."""
    slot: Annotated[int, Meta(ge=0, lt=SLOTS)]
    generation: Annotated[int, Meta(ge=1, lt=1 << 62)]
    """What the slot's header tells as long as nothing else was written there."""
    lent: bool
    """Whether it is for one reader, who gives it back."""
    places: Annotated[tuple[_Number, ...], Meta(max_length=_MOST_PARTS)]
    sizes: Annotated[tuple[_Number, ...], Meta(max_length=_MOST_PARTS)]
    rest: bytes

    @property
    def size(self) -> int:
        """Bytes of the payload, roughly."""
        return len(self.rest) + sum(self.sizes)


_encoder: Final = msgspec.msgpack.Encoder()
_decoder: Final = msgspec.msgpack.Decoder(MemoryReference)


def encode_reference(reference: MemoryReference) -> bytes:
    """Return a reference as it travels."""
    return _encoder.encode(reference)


def decode_reference(payload: bytes, what: str) -> MemoryReference:
    """Return the reference that travelled; raises MarshalException for a malformed one."""
    try:
        reference = _decoder.decode(payload)
    except (ValueError, RecursionError, OverflowError) as error:
        raise MarshalException(f"{what}: reference to shared memory: {printable(str(error))}") from error
    if len(reference.places) != len(reference.sizes):
        raise MarshalException(f"{what}: reference to shared memory: as many places as sizes are wanted")
    return reference


def _capacity(size: int) -> int:
    """Return the bytes of a slot for so many: images of one kind, compressed, say, differ in size."""
    return max(LARGE, 1 << (size - 1).bit_length())


def _write(file: MemoryFile, slot: int, payload: Pieces, *, lent: bool) -> bytes | None:
    try:
        generation = file.write(slot, payload.large)
    except ValueError:  # closed
        return None
    return encode_reference(
        MemoryReference(
            process=os.getpid(),
            file=file.file,
            token=file.token,
            slot=slot,
            generation=generation,
            lent=lent,
            places=payload.places,
            sizes=tuple(map(len, payload.large)),
            rest=payload.without_large(),
        )
    )


def _too_large(size: int, limit: int, what: str) -> MarshalException:
    return MarshalException(f"{what}: {size} bytes where at most {limit} are taken")
