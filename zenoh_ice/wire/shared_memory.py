"""Large payloads through shared memory: on one machine they are written once and read once.

Zenoh's own way of doing that unasked is off (see `network.session_config`): it copies once more, and
overwrites what a receiver may still be reading. Who cannot read shared memory, being on another machine or
without the right to lock memory, gets the same payload over the network: Zenoh sees to that for each
receiver.
"""

from __future__ import annotations

import logging
import os
import resource
import threading
from collections import deque
from pathlib import Path
from typing import Final

import zenoh
from zenoh import shm

from ..exceptions import ConnectionLostException
from .pieces import LARGE, Pieces
from .shared_segments import claim, mapped_segments, sweep, sweep_now_and_then
from .text import without_source

__all__ = ["POOL_SIZE", "SharedMemory", "may_lock_enough", "read_payload"]

POOL_SIZE: Final = 32 << 20
"""Bytes of a process's pool, which is made when the first large payload is sent: eight images of 1280x960."""

_KEPT: Final = 2 << 20  # bytes of what was sent that are not reused at once

# A process that receives locks the pools of all who send to it, and Zenoh lets go of none whose process ended
# (zenoh#2787). Beyond the limit it would lose what comes without a word (zenoh#2788).
_LOCKED_AT_LEAST: Final = 1 << 30
_CAP_IPC_LOCK: Final = 14
_NOTHING: Final = 0  # the first byte of memory that was given back; of a map it never is

_opening: Final = threading.Lock()  # so that what two communicators make is not mixed up

_logger = logging.getLogger(__name__)


class SharedMemory:
    """The pool of a communicator, from which payloads are sent; may be used from any thread."""

    def __init__(self, *, enabled: bool, size: int | None = None) -> None:
        self._size: Final = POOL_SIZE if size is None else size
        self._lock = threading.Lock()
        self._wanted = enabled
        self._provider: shm.ShmProvider | None = None
        # What was sent last. While the sender holds it, too, it stays valid on its way to a receiver that is
        # held up; otherwise Zenoh would drop it there after 100 ms without a word (zenoh#2628).
        self._kept: deque[zenoh.ZBytes] = deque()
        self._kept_size = 0
        self._claims: list[int] = []

    @property
    def used(self) -> bool:
        """Whether anything was sent through shared memory, and more would be."""
        return self._provider is not None

    def place(self, payload: bytes | Pieces) -> bytes | zenoh.ZBytes:
        """Return a payload as it is best sent: a large one in shared memory, if there is room."""
        if len(payload) < LARGE:
            return bytes(payload)
        with self._lock:
            buffer = self._allocate(len(payload))
        if buffer is None:
            return bytes(payload)
        position = 0
        for part in payload.parts if isinstance(payload, Pieces) else (payload,):
            end = position + len(part)
            buffer[position:end] = part
            position = end
        placed = zenoh.ZBytes(buffer)
        with self._lock:
            self._keep(placed)
        return placed

    def close(self) -> None:
        """Give the pool back; everything goes over the network from now on."""
        with self._lock:
            self._wanted = False
            self._kept.clear()
            self._provider = None
            while self._claims:
                os.close(self._claims.pop())

    # Whoever calls these holds the lock.

    def _keep(self, placed: zenoh.ZBytes) -> None:
        self._kept.append(placed)
        self._kept_size += len(placed)
        while self._kept_size > _KEPT and len(self._kept) > 1:
            self._kept_size -= len(self._kept.popleft())

    def _allocate(self, size: int) -> shm.ZShmMut | None:
        provider = self._provider or self._open()
        if provider is None:
            return None
        provider.garbage_collect()  # before there is need: the processor's cache has what was used last
        try:
            return provider.alloc(size)
        except zenoh.ZError:
            self._kept.clear()
            self._kept_size = 0
        # A receiver that was killed gives nothing back: what is held by somebody who gave no sign of life for
        # 100 ms is taken. One that was only held up finds that out by `read_payload`.
        provider.garbage_collect_unsafe()
        try:
            return provider.alloc(size)
        except zenoh.ZError as error:
            _logger.debug("no shared memory is left for %d bytes, sent over the network: %s", size, error)
            return None

    def _open(self) -> shm.ShmProvider | None:
        if not self._wanted:
            return None
        sweep()
        with _opening:
            before = mapped_segments()
            try:
                provider = shm.ShmProvider.default_backend(self._size)
            except zenoh.ZError as error:
                self._wanted = False
                _logger.warning(
                    "no shared memory, large payloads go over the network: %s", without_source(error)
                )
                return None
            self._claims = [
                file for name in mapped_segments() - before if (file := claim(name, self._size)) is not None
            ]
        self._provider = provider
        return self._provider


def read_payload(payload: zenoh.ZBytes, what: str) -> bytes:
    """Return a payload that came, copied out of shared memory if it was there.

    Raises ConnectionLostException when its memory was taken back before: its sender ended, or it was not read
    for too long.
    """
    data = payload.to_bytes()
    if len(data) >= LARGE and (shared := payload.as_shm()) is not None:
        if not shared.is_valid() or data[0] == _NOTHING:
            raise ConnectionLostException(
                f"{what} was lost with its shared memory: its sender ended, or it was not read in time"
            )
        sweep_now_and_then()
    return data


def may_lock_enough() -> bool:
    """Return whether this process may lock the memory that others share with it, for long."""
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    return limit == resource.RLIM_INFINITY or limit >= _LOCKED_AT_LEAST or _may_lock_everything()


def _may_lock_everything() -> bool:
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False
    capabilities = int(status.partition("\nCapEff:")[2].split(maxsplit=1)[0], 16)
    return bool(capabilities >> _CAP_IPC_LOCK & 1)
