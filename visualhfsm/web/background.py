"""What goes on beside the requests: documents are checked, and their files are watched."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Final

from visualhfsm.editing.changes import Choice
from visualhfsm.editing.check_process import CheckProcess
from visualhfsm.editing.errors import EditError

from .protocol import Outside, Problems
from .tab import Tab
from .work import Workers

if TYPE_CHECKING:
    from .workspace import Workspace

__all__ = ["Checking", "watch_files"]

_PATIENCE: Final = 10  # moments without rest after which a document is checked all the same

_logger = logging.getLogger(__name__)


class Checking:
    """Checks documents that have not changed for a moment, one at a time, in their newest revision.

    `quiet` is that moment in seconds, `tell` gets what was found.
    """

    def __init__(self, quiet: float, tell: Callable[[Tab, Problems], None]) -> None:
        self._quiet = quiet
        self._tell = tell
        self._process = CheckProcess()
        self._workers = Workers(1)
        self._waiting: dict[int, Tab] = {}
        self._wanted = asyncio.Event()
        self._changed_at = 0.0

    def check(self, tab: Tab) -> None:
        """Check a tab's document soon."""
        self._waiting[tab.id] = tab
        self._changed_at = asyncio.get_running_loop().time()
        self._wanted.set()

    def forget(self, tab: Tab) -> None:
        """Do not check it any more."""
        self._waiting.pop(tab.id, None)

    async def run(self) -> None:
        """Check what is to be checked, until cancelled."""
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            await self._rest()
            while self._waiting:
                await self._check(self._waiting.pop(next(iter(self._waiting))))

    async def _rest(self) -> None:
        """Wait until nothing has changed for a moment, but not for long."""
        loop = asyncio.get_running_loop()
        until = loop.time() + _PATIENCE * self._quiet
        while (left := min(self._changed_at + self._quiet, until) - loop.time()) > 0:
            await asyncio.sleep(left)

    async def close(self) -> None:
        """End the process that checks."""
        await asyncio.to_thread(self._process.close)
        await self._workers.close()

    async def _check(self, tab: Tab) -> None:
        shown = tab.shown
        if tab.problems is not None and tab.problems.revision == shown.revision:
            return
        look = partial(self._process.find_problems, shown.document, shown.path)
        try:
            items = await self._workers.do(look)
        except EditError as error:
            _logger.warning("%s was not checked: %s", shown.name, error)
            return
        except Exception:  # a fault of one check, which must not be the last one
            _logger.exception("%s cannot be checked", shown.name)
            return
        self._tell(tab, Problems(tab=tab.id, revision=shown.revision, items=items))


async def watch_files(workspace: Workspace) -> None:
    """Look after the files of the open documents, until cancelled.

    A document without changes of its own follows its file; of the others the windows are told.
    """
    while True:
        await asyncio.sleep(workspace.limits.file_check_seconds)
        for tab in workspace.tabs:
            try:
                if (news := await _look(tab)) is not None:
                    workspace.tell_outside(news)
            except Exception:
                _logger.exception("the file of %s cannot be watched", tab.shown.name)


async def _look(tab: Tab) -> Outside | None:
    """Return what is new about the file of a tab."""
    path = tab.shown.path
    before = "same" if tab.outside is None else tab.outside.state
    if path is None:
        return None
    if not await tab.is_changed_outside():
        return None if before == "same" else Outside(tab=tab.id, state="same")
    now: Outside
    if not path.exists():
        now = Outside(tab=tab.id, state="deleted")
    elif tab.shown.dirty:
        now = Outside(tab=tab.id, state="changed")
    else:
        try:
            await tab.resolve(Choice.THEIRS)
            return Outside(tab=tab.id, state="reloaded")
        except EditError as error:  # it is no document, or half written: look again
            now = Outside(tab=tab.id, state="changed", message=str(error))
    return None if now.state == before else now
