"""Open the user's browser without showing its token to the other users of the machine.

Everybody can read the command lines of all processes, so the browser gets the path of a page that only the
user can read, and that page leads it to the editor. Jupyter does the same.
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import html
import logging
import os
import shutil
import stat
import sys
import threading
import time
import webbrowser
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import Final

_PREFIX: Final = "visualhfsm-launch-"
_OPENING_LIMIT: Final = 20.0
"""Seconds after which a browser has opened the page, or cannot read it."""
_YOUNGEST: Final = 60.0
"""Seconds after which a directory that nobody holds was left behind, and not just made."""
_DISPLAYS: Final = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")  # one of them is set where there is a browser
_PAGE: Final = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0;url={address}">
<title>VisualHFSM</title>
<p><a href="{address}">Open the editor</a></p>
</html>
"""

_logger = logging.getLogger(__name__)


class LaunchPage:
    """A file that leads a browser to an address, and that only the user can read, until `close`.

    It is in the user's runtime directory, or else in the directory for temporary files. Making one also
    removes those of editors that were killed. Raises OSError.
    """

    def __init__(self, address: str) -> None:
        base = _base()
        _remove_abandoned(base)
        self._directory = TemporaryDirectory(prefix=_PREFIX, dir=base, ignore_cleanup_errors=True)
        self._lock = os.open(self._directory.name, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        self.is_open = True
        self.path = Path(self._directory.name, "editor.html")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                file.write(_PAGE.format(address=html.escape(address)))
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Remove the file."""
        if self.is_open:
            self.is_open = False
            self._directory.cleanup()
            os.close(self._lock)


def has_browser() -> bool:
    """Return whether a browser with windows can be opened.

    Without a display only text browsers are found, which would occupy the terminal.
    """
    return sys.platform != "linux" or any(os.environ.get(name) for name in _DISPLAYS)


def open_browser(page: LaunchPage) -> None:
    """Open a page in the user's browser; one that is missing, or does not open it in time, is logged.

    Call it on the event loop; the page is to be closed as soon as the browser was let in.
    """

    def launch() -> None:
        if not webbrowser.open(page.path.as_uri()) and page.is_open:
            _logger.warning("found no browser: open the printed address yourself")

    def expect() -> None:
        if page.is_open:
            _logger.warning(
                "the browser has not opened the editor; those of snap, flatpak and Windows may not read %s: "
                "open the printed address yourself",
                page.path,
            )

    # Some browsers run until they are closed.
    threading.Thread(target=launch, name="launch of the browser", daemon=True).start()
    asyncio.get_running_loop().call_later(_OPENING_LIMIT, expect)


def _base() -> Path:
    """Return the user's runtime directory where there is one, or else that of temporary files."""
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or os.devnull)
    with contextlib.suppress(OSError):
        status = runtime.stat()
        if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o077:
            return runtime
    return Path(gettempdir())


def _remove_abandoned(base: Path) -> None:
    """Remove the pages of editors that were killed; others are locked by theirs."""
    for directory in base.glob(f"{_PREFIX}*"):
        with contextlib.suppress(OSError):
            _remove_unless_locked(directory)


def _remove_unless_locked(directory: Path) -> None:
    descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        status = os.fstat(descriptor)
        if status.st_uid != os.getuid() or time.time() - status.st_mtime < _YOUNGEST:
            return
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(directory)
    finally:
        os.close(descriptor)
