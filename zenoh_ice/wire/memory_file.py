"""Memory of this process that others read: files without a name in any folder, divided into slots.

The system takes such a file back with the last process that has it open, however that ends: nothing is left
behind. It is sealed at its size, so that no reader can be struck by memory that is gone.
"""

from __future__ import annotations

import fcntl
import hashlib
import mmap
import os
import re
import secrets
import struct
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Final

__all__ = [
    "HEADER",
    "RETURNED",
    "SEALS",
    "SLOTS",
    "SLOT_START",
    "MemoryFile",
    "fence",
    "link_name",
    "memory_space",
]

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
_PAGE: Final = mmap.PAGESIZE
_CAPABILITIES: Final = re.compile(r"^Cap(?:Prm|Eff):\s*([0-9a-f]+)$", re.MULTILINE)

_gate: Final = threading.Lock()


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
    """Have what was read and written before done before what comes after, in the eyes of other processes.

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
