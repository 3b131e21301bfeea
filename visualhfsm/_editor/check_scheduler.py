"""When the open documents are checked in the background."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from functools import partial
from typing import Final

from visualhfsm._base.errors import VisualHfsmError

from .tab import Tab, Threads

_LONGEST_WAIT: Final = 10  # quiet periods after which a document that keeps changing is checked anyway

_logger = logging.getLogger(__name__)


class CheckScheduler:
    """Checks documents that have not changed for a moment, one at a time, in their newest version.

    `quiet` is that moment in seconds. The listeners of the document get what is found. As soon as another
    document is to be checked, `give_up_search` ends the search of the model checker, which is made up for.
    """

    def __init__(self, quiet: float, give_up_search: Callable[[], None] = lambda: None) -> None:
        self._quiet = quiet
        self._give_up_search = give_up_search
        self._threads = Threads(1)
        self._waiting: dict[int, Tab] = {}
        self._wanted = asyncio.Event()
        self._changed_at = 0.0

    def check(self, tab: Tab) -> None:
        """Check a tab's document soon."""
        self._waiting[tab.id] = tab
        self._changed_at = asyncio.get_running_loop().time()
        self._wanted.set()
        self._give_up_search()

    def forget(self, tab: Tab) -> None:
        """Stop checking a tab's document."""
        self._waiting.pop(tab.id, None)

    async def run(self) -> None:
        """Check the documents that are due, until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            until = loop.time() + _LONGEST_WAIT * self._quiet
            while (left := min(self._changed_at + self._quiet, until) - loop.time()) > 0:
                await asyncio.sleep(left)
            while self._waiting:
                await self._check(self._waiting.pop(next(iter(self._waiting))))

    async def close(self) -> None:
        """Wait for the check that runs."""
        await self._threads.close()

    async def _check(self, tab: Tab) -> None:
        try:
            again = await tab.look_at_imports()
            findings = await self._threads.begin(partial(tab.document.check, again=again))
            if findings.pending:
                self._waiting.setdefault(tab.id, tab)
        except VisualHfsmError as error:
            _logger.warning("%s was not checked: %s", tab.shown.title, error)
        except Exception:  # an internal error of one check must not end all checks
            _logger.exception("%s cannot be checked", tab.shown.title)
