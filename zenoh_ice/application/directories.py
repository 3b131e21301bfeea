"""Where the programs keep what outlasts them, and that it does."""

from __future__ import annotations

import os
from pathlib import Path


def state_directory() -> Path:
    """Return our directory in the user's directory of states, by the XDG Base Directory Specification.

    Raises OSError when the user has no home directory and the environment names none.
    """
    state = os.environ.get("XDG_STATE_HOME", "")
    if state.startswith("/"):  # a relative path is to be ignored
        return Path(state, "visualhfsm")
    try:
        return Path.home() / ".local" / "state" / "visualhfsm"
    except RuntimeError as error:
        raise OSError(f"{error}: set XDG_STATE_HOME to a folder that can be written") from error


def flush(path: Path) -> None:
    """Write a file or directory to the disk. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
