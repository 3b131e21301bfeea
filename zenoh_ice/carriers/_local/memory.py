"""Memory that a process lends to others of its machine: large byte sequences are written once and read once.

It is one file without a name, which readers get over a socket, and which the system frees with its last user.
A part of it is lent until all its readers have given it back: nobody writes there meanwhile.
"""

from __future__ import annotations

import fcntl
import logging
import math
import mmap
import os
import threading
import time
from collections.abc import Sequence
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from zenoh_ice.data.exceptions import MarshalException
from zenoh_ice.threads.limits import LIMITS, Limits

_PAGE: Final = mmap.PAGESIZE

# Nobody shrinks the file, so that no reader loses memory, and nobody but its owner writes to it. Python has
# the names on some systems and from some versions on.
_SEAL_SHRINK: Final = 0x2
_SEALS: Final = 0x4 | _SEAL_SHRINK | 0x10  # F_SEAL_GROW, F_SEAL_SHRINK, F_SEAL_FUTURE_WRITE
_ADD_SEALS: Final = 1033
_GET_SEALS: Final = 1034

_Number = Annotated[int, Meta(ge=0, le=LIMITS.memory)]

_logger = logging.getLogger(__name__)


class Extent(msgspec.Struct, array_like=True, frozen=True):
    """Where byte sequences lie in the memory of their sender, one after the other."""

    start: _Number
    sizes: Annotated[tuple[_Number, ...], Meta(max_length=256)]


class _Loan(msgspec.Struct, eq=False):
    start: int
    end: int
    readers: dict[object, float]
    """Readers that have not given it back, and when their part ends in any case, by the monotonic clock."""


class Arena:
    """The memory that a process lends; thread-safe. Raises OSError where the system has none."""

    def __init__(self, limits: Limits = LIMITS) -> None:
        self._size: Final = limits.memory
        self._last_reads: Final = limits.last_reads
        self._lock: Final = threading.Lock()
        self._loans: list[_Loan] = []  # in the order of their places
        self._allocated = 0
        self._closed = self._complained = False
        if not hasattr(os, "memfd_create"):  # Python was built for an older system
            raise OSError("this Python makes no memory files")
        self.file: Final = os.memfd_create("zenoh_ice", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(self.file, self._size)
            self._map: Final = mmap.mmap(self.file, self._size)
            fcntl.fcntl(self.file, _ADD_SEALS, _SEALS)
        except OSError:
            os.close(self.file)
            raise

    def lend(self, parts: Sequence[bytes], readers: Sequence[object]) -> Extent | None:
        """Write byte sequences where nothing is lent, for some readers; None if there is no room."""
        sizes = tuple(map(len, parts))
        with self._lock:
            loan = self._find_room(sum(sizes), readers)
            if loan is None:
                return None
            position = loan.start
            for part, size in zip(parts, sizes, strict=True):
                self._map[position : position + size] = part
                position += size
        return Extent(loan.start, sizes)

    def give_back(self, start: int, reader: object) -> None:
        """End the loan of a reader that begins somewhere, if there is one."""
        with self._lock:
            for place, loan in enumerate(self._loans):
                if loan.start == start:
                    loan.readers.pop(reader, None)
                    if not loan.readers:
                        del self._loans[place]
                    return

    def lent_to(self, reader: object) -> int:
        """Return the number of loans of a reader."""
        with self._lock:
            return sum(reader in loan.readers for loan in self._loans)

    def forget(self, reader: object) -> None:
        """End the loans of a reader that ended, once it cannot be reading any more."""
        end = time.monotonic() + self._last_reads
        with self._lock:
            for loan in self._loans:
                if reader in loan.readers:
                    loan.readers[reader] = end

    def close(self) -> None:
        """Release the memory; readers keep what they have mapped."""
        with self._lock:
            if not self._closed:
                self._closed = True
                self._map.close()
                os.close(self.file)

    def _find_room(self, size: int, readers: Sequence[object]) -> _Loan | None:
        now = time.monotonic()
        self._loans = [loan for loan in self._loans if any(end > now for end in loan.readers.values())]
        start = place = 0
        while place < len(self._loans) and self._loans[place].start - start < size:
            start = -(-self._loans[place].end // _PAGE) * _PAGE
            place += 1
        end = start + size
        if self._closed or end > self._size:
            return None
        if end > self._allocated:
            try:  # the system would end a process that writes where it can allocate nothing
                os.posix_fallocate(self.file, self._allocated, end - self._allocated)
            except OSError as error:
                if not self._complained:
                    self._complained = True
                    _logger.warning("no memory to share, large values go through the socket: %s", error)
                return None
            self._allocated, self._complained = end, False
        made = _Loan(start, end, dict.fromkeys(readers, math.inf))
        self._loans.insert(place, made)
        return made


class ArenaView:
    """The memory of another process; raises OSError for a file that is none, which it closes in any case."""

    def __init__(self, file: int) -> None:
        try:
            if not fcntl.fcntl(file, _GET_SEALS) & _SEAL_SHRINK:
                raise PermissionError("its owner could shrink it while it is read")
            self._map: Final = mmap.mmap(file, 0, access=mmap.ACCESS_READ)
        except ValueError as error:  # an empty one
            raise OSError(str(error)) from error
        finally:
            os.close(file)

    def read(self, extent: Extent, limit: int, what: str) -> list[bytes]:
        """Return copies of byte sequences; raises MarshalException for more than `limit` bytes."""
        size = sum(extent.sizes)
        if size > limit or extent.start + size > len(self._map):
            raise MarshalException(f"{what}: {size} bytes of shared memory; at most {limit} are accepted")
        position = extent.start
        found = []
        for size in extent.sizes:
            found.append(self._map[position : position + size])
            position += size
        return found

    def close(self) -> None:
        """Unmap it."""
        self._map.close()
