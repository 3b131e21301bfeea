"""Code that all commands share; this module lets Ctrl-C end a command quietly while its modules load.

Every command imports it before anything else, so it imports as little as possible itself.
"""

from __future__ import annotations

import gc
import os
import signal
import sys

__all__ = ["begin_loading", "end_at_ctrl_c", "missing_package", "tether_command"]

_TETHER = f"{os.path.dirname(__file__)}/tether.py"  # noqa: PTH120 - pathlib takes time to load

_INTERRUPTED = 130


def begin_loading() -> None:
    """Prepare to import a command: Ctrl-C ends the process at once, and garbage collection is off.

    Imported objects all stay, and checking them takes a tenth of the time. `cli.run` ends both.
    """
    end_at_ctrl_c()
    gc.disable()


def end_at_ctrl_c() -> None:
    """Let Ctrl-C end the process at once, with exit code 130, until another handler takes its place.

    Nothing is cleaned up, so use it only while there is nothing to clean up.
    """
    signal.signal(signal.SIGINT, lambda _number, _frame: os._exit(_INTERRUPTED))


def missing_package(error: ModuleNotFoundError, extra: str) -> str:
    """Return what to do about a module that cannot be imported: install an extra, or rename a file."""
    name = error.name or ""
    first = sys.modules.get(name.partition(".")[0])
    if first is not None and first.__name__ != name:  # another package of this name was imported
        place = first.__file__ or ", ".join(first.__path__)
        return f"{name} is not in {place}, which hides ours: rename it; `nao doctor` finds all such files"
    if name == "qi" and sys.version_info >= (3, 13):
        return "qi is not available for Python 3.13 and newer: the real robot needs Python 3.11 or 3.12"
    return f"{name} is not installed; type: pip install 'visualhfsm[{extra}]'"


def tether_command(place: str = "background") -> list[str]:
    """Return the prefix that makes a command end with this process, in the `foreground` or not."""
    return [sys.executable, "-I", "-S", _TETHER, str(os.getpid()), place]
