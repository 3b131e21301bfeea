"""Questions of the windows about the code that is typed there: the newest of a kind goes first."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from visualhfsm._code_help.question import Wanted
from visualhfsm._code_help.service import CodeHelp
from visualhfsm._editing.places import Place
from visualhfsm._services import retrieve
from visualhfsm.project._version import Version


class CodeQuestions:
    """Asks `help` in threads. Used on one event loop.

    Of several questions of a kind that arrive while one is being answered, only the newest waits; the others
    get None at once.
    """

    def __init__(self, help: CodeHelp) -> None:
        self._help = help
        self._desks = {wanted: _Desk() for wanted in ("complete", "explain", "signature", "lint")}
        self._interfaces: asyncio.Task[Any] | None = None

    async def ask(
        self, wanted: Wanted, version: Version, place: Place, code: str, *, line: int = 1, column: int = 0
    ) -> Any:  # noqa: ANN401
        """Return the answer of `CodeHelp.ask`, None when a newer question has replaced this one."""
        desk = self._desks[wanted]
        if not await desk.enter():
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
    """A queue for questions of one kind, one at a time; a newer question replaces the one that waits."""

    def __init__(self) -> None:
        self._busy = False
        self._waiting: asyncio.Future[bool] | None = None

    async def enter(self) -> bool:
        """Wait for the turn; return False when a newer question took it, else `leave` must be called."""
        if self._waiting is not None and not self._waiting.done():
            self._waiting.set_result(False)
        if not self._busy:
            self._busy = True
            return True
        waiting: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self._waiting = waiting
        try:
            return await waiting
        except asyncio.CancelledError:
            if not waiting.cancelled() and waiting.result():  # the turn came in the same moment
                self.leave()
            raise

    def leave(self) -> None:
        """Pass the turn to the question that waits, if any."""
        waiting, self._waiting = self._waiting, None
        if waiting is None or waiting.done():
            self._busy = False
        else:
            waiting.set_result(True)
