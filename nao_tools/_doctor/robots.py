"""Check the robots that were served on this machine, and whether their stops can be kept."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec

from nao_tools._doctor.findings import Finding, fail, note, ok
from zenoh_ice.application.kept_stop import UNREADABLE, Kept, kept_directory, read_kept
from zenoh_ice.text import printable

_MOST_KEPT: Final = 20  # whose kept stops are listed
_RECORD: Final = bytes(4096)  # larger than any that a server keeps, and a block of a disk
_FULL: Final = (errno.ENOSPC, errno.EDQUOT)
_CANNOT: Final = "no emergency stop can be kept"


def check_robots() -> Iterator[Finding]:
    """Yield a note for each robot whose next server on this machine starts stopped, or may do so.

    Where a server could not keep its stop, and so would not start, there is a failure.
    """
    try:
        folder = kept_directory()
        files = sorted(folder.glob("*.json"))
    except OSError as error:
        yield fail(f"{_CANNOT}: {error}", "set XDG_STATE_HOME to a folder")
        return
    try:
        _write_in(folder)
    except OSError as error:
        text = f"{_CANNOT} in {folder}, so that no robot server starts: {error.strerror}"
        remedy = "make room there" if error.errno in _FULL else "make it yours"
        yield fail(text, f"{remedy}, or set XDG_STATE_HOME to a folder that can be written")
    for path in files[:_MOST_KEPT]:
        realm = printable(path.stem.rpartition("-")[0])
        try:
            kept = read_kept(path)
        except (OSError, msgspec.MsgspecError):
            kept = Kept(stop=UNREADABLE)
        look = f"look at it, then: nao stop --reset --realm {realm}"
        if kept.stop:
            yield note(f"a robot of realm {realm} is stopped: {printable(kept.stop)}", look)
        elif kept.running:
            text = f"a server of realm {realm} runs, or was killed: then the next one starts stopped"
            yield note(text, "look at the robot before you start its server again")
    if len(files) > _MOST_KEPT:
        yield note(f"{len(files) - _MOST_KEPT} more in {files[0].parent}", "delete those of former robots")
    if not files:
        yield ok("none is stopped")


def _write_in(folder: Path) -> None:
    """Write a record in a folder, or in what there is of it so far, and take it away; raises OSError."""
    while not folder.exists():
        folder = folder.parent
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(_RECORD)
        file.flush()
        os.fsync(file.fileno())
