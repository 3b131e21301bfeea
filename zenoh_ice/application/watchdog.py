"""Reports to systemd, if that started a command: that it is ready, and that it still works.

The protocol of sd_notify(3) is one datagram to the socket that the environment names. systemd ends a command
of a unit with WatchdogSec that does not report in time that it works; it then starts it again.
"""

from __future__ import annotations

import logging
import os
import socket
import threading
import time
from collections.abc import Callable
from typing import Final

_SHARE: Final = 0.3  # of the time that systemd gives, between two reports: one may be late
_SENDING_LIMIT: Final = 0.5  # s

_logger = logging.getLogger(__name__)


class Watchdog:
    """systemd's watchdog over this command; make one, as it takes its variables out of the environment.

    So processes that the command starts do not report in its name.
    """

    def __init__(self) -> None:
        self._address: Final = os.environ.pop("NOTIFY_SOCKET", "")
        os.environ.pop("WATCHDOG_PID", None)
        wanted = os.environ.pop("WATCHDOG_USEC", "")
        self._period: Final = int(wanted) / 1e6 * _SHARE if self._address and wanted.isdecimal() else 0.0
        self._due = time.monotonic()

    def report_ready(self) -> None:
        """Report that the command is ready."""
        self._notify("READY=1")

    def report(self, problem: Callable[[], str]) -> None:
        """Report that the command works, if that is due and `problem` returns nothing.

        `problem` tries whether it works, and returns what keeps it from working.
        """
        now = time.monotonic()
        if not self._period or now < self._due:
            return
        self._due = now + self._period
        if why := problem():
            _logger.error("not reporting to systemd that this command works: %s", why)
        else:
            self._notify("WATCHDOG=1")

    def wait(self, stop: threading.Event, problem: Callable[[], str], check_period: float = 0.5) -> None:
        """Wait for an event; meanwhile look every `check_period` s whether to report, as `report` does.

        For a watchdog with less patience, it looks as often as it has to report.
        """
        while not stop.wait(min(check_period, self._period) if self._period else None):
            self.report(problem)

    def _notify(self, state: str) -> None:
        if not self._address:
            return
        address = f"\0{self._address[1:]}" if self._address.startswith("@") else self._address
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as service_manager:
                service_manager.settimeout(_SENDING_LIMIT)
                service_manager.sendto(state.encode(), address)
        except OSError as error:
            _logger.warning("cannot report %s to systemd: %s", state, error)
