"""An open document, as the windows see it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

from codegen.hfsm.document import Document
from visualhfsm.services import OutputLine, RunPush, Source, complete, retrieve
from visualhfsm.sessions.session import DocumentSession

from .protocol import Outside, Problems

__all__ = ["Shown", "Tab", "Threads"]

R = TypeVar("R")

_NAMES: Final = 100  # names of steps that are sent; more are there


class Threads:
    """A few threads for work that takes long."""

    def __init__(self, threads: int) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="editor")

    async def do(self, work: Callable[[], R]) -> R:
        """Do work in a free thread and return its result; it goes on when the caller is cancelled."""
        future = asyncio.get_running_loop().run_in_executor(self._pool, work)
        future.add_done_callback(retrieve)
        return await asyncio.shield(future)

    async def close(self) -> None:
        """Drop what has not begun and wait for what has."""
        await asyncio.to_thread(self._pool.shutdown, cancel_futures=True)


@dataclass(frozen=True, slots=True)
class Shown:
    """A document at one moment, with all that the windows show of it; the names of steps latest first."""

    revision: int
    document: Document
    undo: tuple[str, ...]
    redo: tuple[str, ...]
    dirty: bool
    path: Path | None
    name: str
    dialect: str
    is_unsaved: bool
    """Whether closing would lose something."""


class Tab:
    """An editing session, which works in threads in the order of the requests, and what windows show of it.

    `changed` is called on the event loop whenever `shown` is new.
    """

    def __init__(
        self,
        number: int,
        session: DocumentSession,
        threads: Threads,
        *,
        changed: Callable[[Tab], None],
        output_lines: int,
        recovered: bool = False,
    ) -> None:
        self.id = number
        self.recovered = recovered
        self.outside: Outside | None = None
        self.problems: Problems | None = None
        self.run: RunPush | None = None
        self.output: deque[OutputLine] = deque(maxlen=output_lines)
        self._session = session
        self._threads = threads
        self._changed = changed
        self._lock = asyncio.Lock()
        self.shown = self._show()

    @property
    def source(self) -> Source:
        """The document for the services."""
        shown = self.shown
        return Source(self.id, shown.revision, shown.document, shown.path, shown.dirty, shown.name)

    async def edit(self, work: Callable[[DocumentSession], R]) -> R:
        """Do work on the session in a thread, after the work before it; raises what that raises.

        What it changed is shown before this returns. Work that has begun ends even when the caller is
        cancelled, and the next waits for it.
        """
        await self._lock.acquire()
        return await complete(self._edit(work))

    async def _edit(self, work: Callable[[DocumentSession], R]) -> R:
        shown = self.shown

        def work_and_show() -> R:
            nonlocal shown
            try:
                return work(self._session)
            finally:
                shown = self._show()

        try:
            return await self._threads.do(work_and_show)
        finally:
            self._lock.release()
            if shown != self.shown:
                self.shown = shown
                self._changed(self)

    def _show(self) -> Shown:
        session = self._session
        return Shown(
            session.revision,
            session.document,
            tuple(session.undo_names[:_NAMES]),
            tuple(session.redo_names[:_NAMES]),
            session.dirty,
            session.path,
            session.name,
            session.dialect,
            session.is_unsaved,
        )
