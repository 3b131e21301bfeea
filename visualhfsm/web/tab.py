"""An open document, as the windows see it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Concatenate, Final, ParamSpec, TypeVar

from codegen.hfsm.document import Document
from visualhfsm.editing.diff import differ
from visualhfsm.services import RecentLines, RunPush, Source, retrieve
from visualhfsm.sessions import session as sessions
from visualhfsm.sessions.session import DocumentSession

from .protocol import Outside, Problems, Step

P = ParamSpec("P")
R = TypeVar("R")

_STEPS: Final = 100  # that are sent; there may be more


class Threads:
    """A few threads for work that takes long."""

    def __init__(self, threads: int) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="editor")

    def begin(self, work: Callable[[], R]) -> asyncio.Future[R]:
        """Begin work in a free thread; it is completed even when its caller is cancelled."""
        future = asyncio.get_running_loop().run_in_executor(self._pool, work)
        future.add_done_callback(retrieve)
        return future

    async def do(self, work: Callable[[], R]) -> R:
        """Do work in a free thread and return its result; it continues when the caller is cancelled."""
        return await asyncio.shield(self.begin(work))

    async def close(self) -> None:
        """Drop what has not begun and wait for what has."""
        await asyncio.to_thread(self._pool.shutdown, cancel_futures=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown(Source):
    """A document at one moment, with all that the windows show of it; the steps latest first."""

    undo: tuple[Step, ...]
    redo: tuple[Step, ...]
    is_unsaved: bool
    """Whether closing would lose changes."""


class Tab:
    """An editing session, which executes requests in order in threads, and its state as windows show it.

    `changed` is called on the event loop whenever `shown` is new. `recording` is the file of the recording
    that contains the document, which is not changed then.
    """

    def __init__(
        self,
        number: int,
        session: DocumentSession,
        threads: Threads,
        *,
        changed: Callable[[Tab], None],
        output: RecentLines,
        recording: Path | None = None,
    ) -> None:
        self.id = number
        self.recording = recording
        self.outside: Outside | None = None
        self.problems: Problems | None = None
        self.run: RunPush | None = None
        self.output = output
        self.generated: Document | None = None
        """The document as its component was generated last."""
        self.runs: Document | None = None
        """The document as its running component has loaded it."""
        self._compared: tuple[Document, Document, bool] | None = None
        self._session = session
        self._threads = threads
        self._changed = changed
        self._lock = asyncio.Lock()
        self.shown = self._show()

    @property
    def is_running(self) -> bool:
        """Whether a component was started from it and has not ended."""
        return self.run is not None and self.run.status != "ended"

    @property
    def component(self) -> str:
        """The name of the component that was started from it and runs, or else of the one it would become."""
        return self.run.component if self.run is not None and self.is_running else self.shown.component

    def take_generated(self) -> None:
        """Remember that the running component has loaded the last generated document."""
        self.runs = self.generated

    @property
    def differs_from_run(self) -> bool:
        """Whether the document differs from what its component runs, except in positions."""
        runs, document = self.runs, self.shown.document
        if runs is None or not self.is_running:
            return False
        if self._compared is None or self._compared[0] is not runs or self._compared[1] is not document:
            self._compared = (runs, document, differ(runs, document))
        return self._compared[2]

    async def edit(
        self, work: Callable[Concatenate[DocumentSession, P], R], *args: P.args, **kwargs: P.kwargs
    ) -> R:
        """Do work on the session in a thread, after earlier work; its exceptions are raised here.

        Its changes are shown before this returns. Work that has begun is completed even when the caller is
        cancelled, and later work waits for it.
        """
        await self._lock.acquire()
        future = self._threads.begin(partial(work, self._session, *args, **kwargs))
        future.add_done_callback(self._worked)
        return await asyncio.shield(future)

    def _worked(self, _future: object) -> None:
        """Show the changes of some work. Called before its caller continues, also when that was cancelled."""
        former, self.shown = self.shown, self._show()
        self._lock.release()
        if self.shown != former:
            self._changed(self)

    def _show(self) -> Shown:
        session = self._session
        return Shown(
            self.id,
            session.revision,
            session.document,
            session.path,
            session.dirty,
            session.name,
            undo=_newest(session.undo_steps),
            redo=_newest(session.redo_steps),
            is_unsaved=session.is_unsaved,
        )


def _newest(steps: Iterable[sessions.Step]) -> tuple[Step, ...]:
    return tuple(Step(name=each.name, revision=each.revision) for each in islice(steps, _STEPS))
