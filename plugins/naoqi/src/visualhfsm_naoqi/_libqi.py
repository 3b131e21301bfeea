"""The initialization that libqi needs once in a process."""

from __future__ import annotations

import threading

import qi

_lock = threading.Lock()
_applications: list[object] = []


def start_libqi() -> None:
    """Start libqi's threads, unless they are running; they end with the process.

    Without its `Application`, a process that used libqi sometimes aborts when it ends.
    """
    with _lock:
        qi.logging.setLevel(qi.logging.ERROR)  # its messages go to standard output
        if not _applications:
            _applications.append(qi.Application(["naoserver", "--qi-log-level=1"], raw=True))
