"""An open document, as the windows see it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from codegen.hfsm.document import Document
from visualhfsm.editing.changes import Change, Choice
from visualhfsm.editing.commands import Command
from visualhfsm.editing.commands.paste import PasteStates
from visualhfsm.editing.libraries import extract, inline
from visualhfsm.editing.session import DocumentSession

from .protocol import OutputLine, Outside, Problems, RunPush
from .rendering import Rendering, render
from .services import Source
from .work import Queue, Workers

__all__ = ["Shown", "Tab"]

R = TypeVar("R")

_NAMES: Final = 100  # names of steps that are told; more are there


@dataclass(frozen=True, slots=True)
class Shown:
    """A document at one moment, with all that the windows show of it; the names of steps latest first."""

    revision: int
    document: Document
    rendering: Rendering
    undo: tuple[str, ...]
    redo: tuple[str, ...]
    dirty: bool
    path: Path | None
    name: str
    dialect: str
    is_unsaved: bool


class Tab:
    """An editing session behind a queue: what it does runs in threads, in the order in which it is asked for.

    `shown` is what it came to, and is followed by a call of `changed` on the event loop whenever it is new.
    """

    def __init__(
        self,
        number: int,
        session: DocumentSession,
        workers: Workers,
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
        self._changed = changed
        self.shown = self._show()
        self._fresh = self.shown
        self._queue = Queue(workers, self._publish)

    @property
    def is_unsaved(self) -> bool:
        """Whether closing would lose something."""
        return self.shown.is_unsaved

    @property
    def source(self) -> Source:
        """What the services work with."""
        shown = self.shown
        return Source(self.id, shown.revision, shown.document, shown.path, shown.dirty, shown.name)

    async def do(self, command: Command) -> dict[str, Any]:
        """Apply a command; raises EditError."""
        return _told(await self._work(lambda: self._session.do(command)))

    async def undo(self, steps: int) -> dict[str, Any]:
        """Undo steps, as many as there are; raises EditError when there is none."""
        session = self._session
        return await self._work(lambda: _repeat(session.undo, min(steps, len(session.undo_names))))

    async def redo(self, steps: int) -> dict[str, Any]:
        """Do steps again, as many as there are; raises EditError when there is none."""
        session = self._session
        return await self._work(lambda: _repeat(session.redo, min(steps, len(session.redo_names))))

    async def copy(self, automaton: int, states: list[int]) -> str:
        """Return states as text for the clipboard; raises EditError."""
        return await self._work(lambda: self._session.copy(automaton, tuple(states)))

    async def cut(self, automaton: int, states: list[int]) -> tuple[str, dict[str, Any]]:
        """Return states as text for the clipboard, and delete them; raises EditError."""
        text, change = await self._work(lambda: self._session.cut(automaton, tuple(states)))
        return text, _told(change)

    async def paste(self, content: str, automaton: int, x: float | None, y: float | None) -> dict[str, Any]:
        """Put copied states into an automaton; raises EditError."""
        return await self.do(PasteStates(automaton=automaton, content=content, x=x, y=y))

    async def extract(self, automaton: int, file: Path) -> dict[str, Any]:
        """Move an automaton to a new file, and import it from there; raises EditError."""
        session = self._session
        change = await self._work(
            lambda: session.do(extract(session.document, automaton, session.path, file))
        )
        return _told(change)

    async def inline(self, automaton: int) -> dict[str, Any]:
        """Put the content of an imported automaton in its place; raises EditError."""
        session = self._session
        change = await self._work(lambda: session.do(inline(session.document, automaton, session.path)))
        return _told(change)

    async def seal(self) -> None:
        """Let the next command be a step of its own."""
        await self._work(self._session.seal)

    async def text(self) -> str:
        """Return the document as its file would hold it; raises EditError."""
        return await self._work(self._session.text)

    async def saved_document(self) -> Document | None:
        """Return the document as it was saved last, None when it never was."""
        return await self._work(lambda: self._session.saved_document)

    async def save(self, path: Path | None = None, *, overwrite: bool = False) -> Path:
        """Save the document, to another file if one is given; raises EditError."""
        saved = await self._work(lambda: self._session.save(path, overwrite=overwrite))
        self.outside = None
        return saved

    async def is_changed_outside(self) -> bool:
        """Return whether another program has changed or removed the file."""
        return await self._work(self._session.is_changed_outside)

    async def resolve(self, choice: Choice) -> dict[str, Any]:
        """Settle what another program did to the file; raises EditError."""
        resolution = await self._work(lambda: self._session.resolve(choice))
        self.outside = None
        return {"revision": self.shown.revision, "conflicts": list(resolution.conflicts)}

    async def close(self, *, discard: bool) -> None:
        """End the session; raises EditError when changes would be lost."""
        await self._work(lambda: self._session.close(discard=discard))

    async def abandon(self) -> None:
        """End the session and keep what is not saved for recovery."""
        await self._work(self._session.abandon)

    async def _work(self, work: Callable[[], R]) -> R:
        def work_and_show() -> R:
            try:
                return work()
            finally:
                self._fresh = self._show()

        return await self._queue.do(work_and_show)

    def _show(self) -> Shown:
        session = self._session
        undo = session.undo_names
        return Shown(
            session.revision,
            session.document,
            render(session.document, session.name),
            tuple(undo[:_NAMES]),
            tuple(session.redo_names[:_NAMES]),
            session.dirty,
            session.path,
            session.name,
            session.dialect,
            session.is_unsaved,
        )

    def _publish(self) -> None:
        if self._fresh != self.shown:
            self.shown = self._fresh
            self._changed(self)


def _told(change: Change) -> dict[str, Any]:
    return {"name": change.name, "revision": change.revision, "added": list(change.added)}


def _repeat(step: Callable[[], Change], steps: int) -> dict[str, Any]:
    change = step()
    for _ in range(steps - 1):
        change = step()
    return _told(change)
