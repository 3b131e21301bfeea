"""Shared by all commands; here, Ctrl-C ends the command quietly while its modules load.

Every command begins with this, before it imports anything else; so this imports next to nothing itself.
"""

from __future__ import annotations

import os
import signal
import sys

__all__ = ["end_at_ctrl_c", "tether_command"]

_TETHER = f"{os.path.dirname(__file__)}/tether.py"  # noqa: PTH120 - pathlib takes time to load

_INTERRUPTED = 130


def end_at_ctrl_c() -> None:
    """Let Ctrl-C end the process at once, with exit code 130, until another handler takes its place.

    Nothing is cleaned up: it is for as long as there is nothing to clean up.
    """
    signal.signal(signal.SIGINT, lambda _number, _frame: os._exit(_INTERRUPTED))


def tether_command(place: str = "background") -> list[str]:
    """Return the beginning of a command that ends when this process does, in the `foreground` or not."""
    return [sys.executable, "-I", "-S", _TETHER, str(os.getpid()), place]
