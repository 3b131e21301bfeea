"""Where jedi keeps the files that it has parsed: a directory that no other process writes to meanwhile.

jedi's own directory is shared by all programs of a user, and a file that one of them is writing cannot be
read by another.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

import jedi
from parso.cache import parser_cache

from visualhfsm.scratch import ScratchDirectory

__all__ = ["keep_parsed_files", "with_readable_files"]

T = TypeVar("T")

_DIRECTORIES: Final = 16


def keep_parsed_files(root: Path | None = None) -> Path | None:
    """Let jedi use the first of the user's directories that no process uses; return it.

    It is this process's until it ends, however it ends. `root` is where the directories lie, by default
    `visualhfsm/parsed` in the user's cache. When none can be had, as in a home that is read-only, jedi uses
    one that nobody else sees and that is deleted some day; None is returned.
    """
    root = root or Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "visualhfsm" / "parsed"
    for number in range(_DIRECTORIES):
        directory = root / str(number)
        try:
            directory.mkdir(parents=True, exist_ok=True)
            lock = os.open(directory / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC)
        except OSError:
            break
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
        else:  # and stays open: the lock is held as long as the process lives
            jedi.settings.cache_directory = str(directory / "files")
            return directory
    jedi.settings.cache_directory = str(ScratchDirectory().path)
    return None


def with_readable_files(question: Callable[[], T]) -> T:
    """Return what a function returns; it is asked again without the kept files when one cannot be read.

    A process that was killed while it wrote leaves such a file behind.
    """
    try:
        return question()
    except (EOFError, pickle.UnpicklingError):
        with contextlib.suppress(FileNotFoundError):
            shutil.rmtree(jedi.settings.cache_directory)
        parser_cache.clear()
        return question()
