"""The file in which a robot server keeps its emergency stop and lease: its place, and what it contains."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import Final

import msgspec

from zenoh_ice.application.directories import state_directory
from zenoh_ice.data import typed

_LARGEST_FILE: Final = 1 << 16
"""Bytes of a file that can be ours."""

UNREADABLE: Final = "the record of its emergency stop cannot be read"


class KeptLease(msgspec.Struct, frozen=True):
    """A lease: who holds it, and until when in s since the epoch."""

    client: str
    holder: str
    until: float


class Kept(msgspec.Struct, frozen=True, kw_only=True):
    """What a server keeps."""

    running: bool = False
    """Whether it has not ended: the next server that reads this knows that it ended without warning."""
    stop: str = ""
    """Why the robot is stopped; empty while it is not."""
    lease: KeptLease | None = None
    body: str = ""
    """The body of the simulated robot that all this is about; empty for any robot, as for a real one."""
    aside: dict[str, str] = {}
    """Why simulated robots of other bodies are stopped, which were served here before."""


def kept_directory() -> Path:
    """Return the directory of the files. Raises OSError when the user has no directory of states."""
    return state_directory() / "robots"


def read_kept(path: Path) -> Kept:
    """Return what a server kept in a file.

    Raises OSError, also for what is no file of the user, such as a pipe, and msgspec.MsgspecError.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        about = os.fstat(descriptor)
        if not stat.S_ISREG(about.st_mode) or about.st_uid != os.geteuid():
            raise OSError(errno.EINVAL, "no file of this user", str(path))
        return typed.from_json(file.read(_LARGEST_FILE), Kept)
