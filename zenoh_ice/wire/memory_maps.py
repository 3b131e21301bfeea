"""Memory of other processes, mapped into this one to read what they sent."""

from __future__ import annotations

import fcntl
import mmap
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

from ..exceptions import ConnectionLostException, MarshalException
from .memory_file import HEADER, RETURNED, SEALS, SLOT_START, SLOTS, fence, link_name
from .memory_reference import MemoryReference

__all__ = ["MemoryMaps"]

_F_GET_SEALS: Final = 1034
_MOST: Final = 256  # maps at a time; a robot's cameras and servants are some ten


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
            raise _lost(what) from error
        if not whole:
            raise _lost(what)
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
                raise _lost(what)
            found = self._maps.get(reference.token)
            if found is None:
                self._forget_ended()
                if len(self._maps) >= _MOST:
                    self._forget(next(iter(self._maps)))
                try:
                    found = self._maps[reference.token] = _map(reference)
                except (FileNotFoundError, ProcessLookupError) as error:  # its maker has ended, or closed it
                    raise _lost(what) from error
                except (OSError, ValueError) as error:
                    self._on_unreadable()
                    raise ConnectionLostException(
                        f"{what}: the shared memory of process {reference.process} cannot be read from here "
                        f"({error}); the next comes over the network"
                    ) from error
            return found

    def forget_ended(self) -> None:
        """Let go of what its maker has let go of."""
        with self._lock:
            self._forget_ended()

    def _forget_ended(self) -> None:
        for token, each in list(self._maps.items()):
            if not _is_open(each.path, token):
                self._forget(token)

    def _forget(self, token: str) -> None:
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


def _lost(what: str) -> ConnectionLostException:
    return ConnectionLostException(
        f"{what} was lost with its shared memory: its sender ended, or it was not read in time"
    )
