"""Questions of the windows about the code that is typed there: of each window only the newest is kept."""

from __future__ import annotations

import asyncio
from collections.abc import Hashable
from pathlib import Path
from typing import Any

from visualhfsm._base.work import retrieve
from visualhfsm._document.places import Place
from visualhfsm.project._code_help.protocol import Wanted
from visualhfsm.project._code_help.service import CodeHelp
from visualhfsm.project._version import Version


class CodeQuestions:
    """Asks `help` in threads. Used on one event loop.

    Of several questions of a kind that a window asks while one is being answered, only the newest waits; the
    others get None at once. The windows take turns.
    """

    def __init__(self, help: CodeHelp) -> None:
        self._help = help
        self._desks = {wanted: _Desk() for wanted in ("complete", "explain", "signature")}
        self._interfaces: asyncio.Task[Any] | None = None

    async def ask(
        self,
        asker: Hashable,
        wanted: Wanted,
        version: Version,
        place: Place,
        code: str,
        *,
        line: int = 1,
        column: int = 0,
    ) -> Any:  # noqa: ANN401
        """Return the answer of `CodeHelp.ask`, None when a newer question of the asker has replaced it."""
        desk = self._desks[wanted]
        if not await desk.enter(asker):
            return None
        try:
            return await asyncio.to_thread(
                self._help.ask, wanted, version.document, version.path, place, code, line=line, column=column
            )
        finally:
            desk.leave()

    async def interfaces(self, folder: Path) -> Any:  # noqa: ANN401
        """Return the interfaces of a folder, as `CodeHelp.interfaces` does; all who wait get one answer."""
        if self._interfaces is None or self._interfaces.done():
            self._interfaces = asyncio.create_task(asyncio.to_thread(self._help.interfaces, folder))
            self._interfaces.add_done_callback(retrieve)
        return await asyncio.shield(self._interfaces)


class _Desk:
    """A queue for questions of one kind, one at a time; a newer one replaces that of its asker that waits."""

    def __init__(self) -> None:
        self._busy = False
        self._waiting: dict[Hashable, asyncio.Future[bool]] = {}

    async def enter(self, asker: Hashable) -> bool:
        """Wait for the turn; return False when a newer question took it, else `leave` must be called."""
        if not self._busy:
            self._busy = True
            return True
        waiting: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        former, self._waiting[asker] = self._waiting.get(asker), waiting  # keeps its place
        if former is not None and not former.done():
            former.set_result(False)
        try:
            return await waiting
        except asyncio.CancelledError:
            if not waiting.cancelled() and waiting.result():  # the turn came in the same moment
                self.leave()
            raise
        finally:
            if self._waiting.get(asker) is waiting:
                del self._waiting[asker]

    def leave(self) -> None:
        """Pass the turn to the question that has waited longest, if any."""
        for asker, waiting in [*self._waiting.items()]:
            del self._waiting[asker]
            if not waiting.done():
                waiting.set_result(True)
                return
        self._busy = False
