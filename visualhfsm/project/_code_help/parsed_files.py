"""The cache of the files that jedi has parsed."""

from __future__ import annotations

import os
import pickle
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

import jedi
from parso.cache import parser_cache

T = TypeVar("T")

_temporary: Final[list[tempfile.TemporaryDirectory[str]]] = []
"""Deleted when the process ends."""


def keep_parsed_files(directory: Path | None = None) -> None:
    """Let jedi use a directory of this program, by default `visualhfsm/parsed` in the user's cache.

    When it cannot be used, as in a read-only home directory, jedi uses a temporary one.
    """
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    directory = directory or cache / "visualhfsm" / "parsed"
    try:
        directory.mkdir(parents=True, exist_ok=True)
        usable = os.access(directory, os.W_OK)
    except OSError:
        usable = False
    if usable:
        jedi.settings.cache_directory = str(directory)
    else:
        _keep_apart()


def _keep_apart() -> None:
    """Let jedi use a temporary directory, to which no other process writes."""
    _temporary.append(tempfile.TemporaryDirectory(prefix="visualhfsm-", ignore_cleanup_errors=True))
    jedi.settings.cache_directory = _temporary[-1].name


def with_readable_files(question: Callable[[], T]) -> T:
    """Return the result of a function; call it again without cached files when one cannot be read.

    Such a file is being written by another process, or was left behind by one that was killed. The cache is
    deleted, and this process uses a separate one from then on.
    """
    try:
        return question()
    except (EOFError, pickle.UnpicklingError):
        shutil.rmtree(jedi.settings.cache_directory, ignore_errors=True)  # others may be writing there
        _keep_apart()
        parser_cache.clear()
        return question()
