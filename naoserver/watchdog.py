"""The thread that sees to it that nothing moves that should not."""

from __future__ import annotations

import logging
import threading
from collections.abc import Sequence
from typing import Final

from naoserver.guarded_device import GuardedDevice

_logger = logging.getLogger(__name__)

_LONGEST: Final = 1.0
_AFTER_ERROR: Final = 0.1
_END: Final = 2.0


class Watchdog:
    """Look after devices on the steady wall clock: sleep while all rest, and wake with the first command."""

    def __init__(self) -> None:
        self._devices: Sequence[GuardedDevice] = ()
        self._condition = threading.Condition()
        self._woken = False
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)

    def start(self, devices: Sequence[GuardedDevice]) -> None:
        """Start to look after `devices`."""
        self._devices = tuple(devices)
        self._thread.start()

    def wake(self) -> None:
        """Look again now: something has been commanded."""
        with self._condition:
            self._woken = True
            self._condition.notify()

    def close(self) -> None:
        """End the thread."""
        with self._condition:
            self._stopping = True
            self._condition.notify()
        if self._thread.ident is not None:
            self._thread.join(_END)
            if self._thread.is_alive():
                _logger.error("the watchdog did not end within %g s", _END)

    def _run(self) -> None:
        while True:
            due = min((self._watch(device) for device in self._devices), default=_LONGEST)
            with self._condition:
                self._condition.wait_for(lambda: self._woken or self._stopping, due)
                self._woken = False
                if self._stopping:
                    return

    def _watch(self, device: GuardedDevice) -> float:
        """Look after a device; return in how many seconds to look again."""
        try:
            due = device.watch()
        except Exception:
            _logger.exception("the watchdog could not look after %s", device.name)
            return _AFTER_ERROR
        return _LONGEST if due is None else due
