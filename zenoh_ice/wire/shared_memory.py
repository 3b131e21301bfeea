"""Large byte sequences through shared memory: on one machine they are written once and read once.

What is sent then is a reference: the rest of the payload, and where the byte sequences stand in memory of the
sender's. Zenoh's own shared memory is off (see `network.session_config`): its Python cannot read a part of a
payload, so that a receiver copies an image twice, and what a process that was killed has shared stays in the
memory of all who received from it (zenoh#2787).
"""

from __future__ import annotations

import logging
import math
import os
import threading
import time
from collections.abc import Callable
from typing import Final

import zenoh

from ..exceptions import MarshalException
from .memory_file import SLOTS, MemoryFile, memory_space
from .memory_maps import MemoryMaps
from .memory_reference import MemoryReference, decode_reference, encode_reference, is_reference
from .pieces import LARGE, Parted, Pieces

__all__ = ["LENT_FOR", "Lender", "Ring", "SharedMemory"]

LENT_FOR: Final = 5.0
"""Seconds after which what was lent is used again though nobody gave it back: its reader was killed."""

_LAST_READS: Final = 0.5  # s
_LOOK_AGAIN: Final = 0.002  # s
_LARGEST: Final = 32 << 20  # bytes of a slot; what is larger goes over the network

_logger = logging.getLogger(__name__)


class SharedMemory:
    """What a communicator shares: memory that it sends from, and that of others; for any thread."""

    def __init__(self, *, enabled: bool, on_unreadable: Callable[[], object] = lambda: None) -> None:
        """Call a function, once, when the memory of others is there and may not be read."""
        self.space: Final = memory_space() if enabled else ""
        """The same in all processes that can read each other's memory; empty when this one takes no part."""
        self.lender: Final = Lender(self.make_file)
        """For answers."""
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

    @property
    def used(self) -> bool:
        """Whether anything was sent through it."""
        return bool(self._files)

    def ring(self) -> Ring:
        """Return memory to send one stream from."""
        return Ring(self.make_file, self.drop_file)

    def read(self, payload: zenoh.ZBytes, limit: int, what: str) -> bytes | Parted:
        """Return a payload that came, with what it refers to, if that is no more than `limit` bytes.

        Raises MarshalException when it is more, ConnectionLostException when its memory is gone: its sender
        ended, or it was not read for too long.
        """
        size = len(payload)
        if size > limit:
            raise _too_large(size, limit, what)
        data = payload.to_bytes()
        if not is_reference(data):
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

    def forget_ended(self) -> None:
        """Let go of the memory of processes that have ended."""
        self._maps.forget_ended()

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


class Lender:
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

    def __init__(
        self, make_file: Callable[[int], MemoryFile | None], drop_file: Callable[[MemoryFile], None]
    ) -> None:
        self._make_file: Final = make_file
        self._drop_file: Final = drop_file
        self._file: MemoryFile | None = None
        self._next = 0

    def place(self, payload: Pieces) -> bytes | None:
        """Write what is large in a payload, and return the reference to it; None where there is no room."""
        size = sum(map(len, payload.large))
        file = self._file
        if file is None or size > file.capacity:
            self.close()
            file = self._file = self._make_file(_capacity(size))
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
            self._drop_file(file)


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
