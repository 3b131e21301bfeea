"""Check the open documents in the background."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from visualhfsm.editing.check_process import CheckProcess
from visualhfsm.errors import EditError

from .protocol import Problems
from .tab import Tab, Threads

_LONGEST_WAIT: Final = 10  # quiet periods after which a document that keeps changing is checked anyway

_logger = logging.getLogger(__name__)


class Checking:
    """Checks documents that have not changed for a moment, one at a time, in their newest revision.

    `quiet` is that moment in seconds, `report` gets the problems. `include` are directories with packages
    of interfaces. Closing it closes `process`.
    """

    def __init__(
        self,
        process: CheckProcess,
        quiet: float,
        report: Callable[[Tab, Problems], None],
        include: Sequence[Path] = (),
    ) -> None:
        self._process = process
        self._quiet = quiet
        self._report = report
        self._include = include
        self._threads = Threads(1)
        self._waiting: dict[int, Tab] = {}
        self._wanted = asyncio.Event()
        self._changed_at = 0.0

    def check(self, tab: Tab) -> None:
        """Check a tab's document soon."""
        self._waiting[tab.id] = tab
        self._changed_at = asyncio.get_running_loop().time()
        self._wanted.set()

    def forget(self, tab: Tab) -> None:
        """Stop checking a tab's document."""
        self._waiting.pop(tab.id, None)

    async def run(self) -> None:
        """Check the documents that are due, until cancelled."""
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            await self._wait_for_quiet()
            while self._waiting:
                await self._check(self._waiting.pop(next(iter(self._waiting))))

    async def _wait_for_quiet(self) -> None:
        """Wait until nothing has changed for a moment, but not for long."""
        loop = asyncio.get_running_loop()
        until = loop.time() + _LONGEST_WAIT * self._quiet
        while (left := min(self._changed_at + self._quiet, until) - loop.time()) > 0:
            await asyncio.sleep(left)

    async def close(self) -> None:
        """End the process that checks."""
        await asyncio.to_thread(self._process.close)
        await self._threads.close()

    async def _check(self, tab: Tab) -> None:
        shown = tab.shown
        if tab.problems is not None and tab.problems.revision == shown.revision:
            return
        look = partial(self._process.find_problems, shown.document, shown.path, self._include)
        try:
            items = await self._threads.do(look)
        except EditError as error:
            _logger.warning("%s was not checked: %s", shown.title, error)
            return
        except Exception:  # an internal error of one check must not end all checks
            _logger.exception("%s cannot be checked", shown.title)
            return
        self._report(tab, Problems(tab=tab.id, revision=shown.revision, items=items))
