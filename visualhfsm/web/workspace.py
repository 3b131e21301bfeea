"""What all windows share: the open documents, the clipboard, and what runs."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Iterable
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from visualhfsm.editing.journal import Abandoned, find_abandoned, journal_directory
from visualhfsm.editing.session import DocumentSession

from .background import Checking, watch_files
from .limits import Limits
from .paths import Root
from .protocol import (
    Output,
    Outside,
    Problems,
    Push,
    Recoverable,
    RunPush,
    Snapshot,
    Stale,
    Structure,
    TabState,
)
from .protocol import Workspace as WorkspacePush
from .refusals import MissingError, TooManyError
from .services import Components, MakeServices, Services
from .tab import Tab
from .window import Window
from .work import Workers

__all__ = ["Workspace"]

_GOODBYE: Final = 8.0  # s that a service may take to close

_logger = logging.getLogger(__name__)


class Workspace:
    """The open documents and who looks at them. Used on one event loop, as an asynchronous context.

    What changes is told to every window. Leaving it ends what runs, and keeps what is not saved for recovery.
    """

    services: Services

    def __init__(
        self, root: Root, limits: Limits, make_services: MakeServices, journals: Path | None = None
    ) -> None:
        self.root = root
        self.limits = limits
        self.journals = journals or journal_directory()
        self.workers = Workers(limits.threads)
        self.opening = asyncio.Lock()
        """Held while a document is opened, so that two windows do not open it twice."""
        self.clipboard = ""
        self.copied_states = 0
        self._make_services = make_services
        self._tabs: dict[int, Tab] = {}
        self._numbers = count(1)
        self._windows: set[Window] = set()
        self._followers: dict[str, set[Window]] = {}
        self._running: list[dict[str, Any]] = []
        self._robot_stopped = ""
        self._abandoned: dict[str, Abandoned] = {}
        self._told: WorkspacePush | None = None
        self._checking = Checking(limits.quiet_seconds, self._tell_problems)
        self._tasks: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        self.services = self._make_services(self._publish_from_anywhere)
        await self.look_for_abandoned()
        self._tasks = [
            asyncio.create_task(watch_files(self), name="watch of the files"),
            asyncio.create_task(self._checking.run(), name="checks"),
        ]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._checking.close()
        services = self.services
        for service in (services.running, services.live, services.code_help):
            try:
                async with asyncio.timeout(_GOODBYE):
                    await service.close()
            except Exception:
                _logger.exception("%s did not close", type(service).__name__)
        for tab in self._tabs.values():
            await tab.abandon()
        await self.workers.close()

    # ---------------------------------------------------------------------------------------- tabs

    @property
    def tabs(self) -> list[Tab]:
        """The open documents in the order in which they were opened."""
        return list(self._tabs.values())

    def tab(self, number: int) -> Tab:
        """Return an open document; raises MissingError."""
        if number not in self._tabs:
            raise MissingError(f"tab {number} is not open")
        return self._tabs[number]

    def require_room(self) -> None:
        """Raise TooManyError when no more documents can be opened."""
        if len(self._tabs) >= self.limits.tabs:
            raise TooManyError(f"{len(self._tabs)} documents are open; close one first")

    async def add(self, session: DocumentSession, *, recovered: bool = False) -> Tab:
        """Show a session in a new tab."""
        number = next(self._numbers)
        tab = await self.workers.do(
            lambda: Tab(
                number,
                session,
                self.workers,
                changed=self._changed,
                output_lines=self.limits.output_lines,
                recovered=recovered,
            )
        )
        self._tabs[number] = tab
        self._changed(tab)
        return tab

    def remove(self, tab: Tab) -> None:
        """Show a tab no longer; its session is closed."""
        del self._tabs[tab.id]
        self._checking.forget(tab)
        for window in self._windows:
            window.close(tab.id)
        self.tell()

    def unsaved(self) -> list[str]:
        """Return the names of the documents with unsaved changes."""
        return [tab.shown.name for tab in self._tabs.values() if tab.is_unsaved]

    # ---------------------------------------------------------------------------------------- windows

    def greet(self, window: Window) -> None:
        """Tell a window everything, and from now on every change."""
        self._windows.add(window)
        window.greet()
        window.push(self._state())
        for tab in self._tabs.values():
            window.show(tab)
            for push in (tab.problems, tab.outside, tab.run):
                if push is not None:
                    window.push(push)
            window.push(Output(tab=tab.id, lines=list(tab.output), whole=True))

    async def leave(self, window: Window) -> None:
        """Forget a window; what nobody else follows is followed no longer."""
        self._windows.discard(window)
        for component in [name for name, followers in self._followers.items() if window in followers]:
            await self.unfollow(window, component)

    async def follow(self, window: Window, component: str) -> object:
        """Tell a window what a component does from now on; raises ServiceError."""
        self._followers.setdefault(component, set()).add(window)
        try:
            return await self.services.live.attach(component)
        except BaseException:
            self._lose(window, component)
            raise

    async def look_at(self, window: Window, recording: Path) -> object:
        """Open a recording, which is let go of when the window leaves or follows it no longer."""
        found = await self.services.live.recording(recording)
        if isinstance(found, dict):
            self._followers.setdefault(found["component"], set()).add(window)
        return found

    async def unfollow(self, window: Window, component: str) -> None:
        """Tell it no longer."""
        if self._lose(window, component):
            await self.services.live.detach(component)

    def _lose(self, window: Window, component: str) -> bool:
        """Let a window not follow a component; return whether it was the last one that did."""
        followers = self._followers.get(component, set())
        if window not in followers:
            return False
        followers.remove(window)
        if not followers:
            del self._followers[component]
        return not followers

    # ---------------------------------------------------------------------------------------- news

    def tell(self) -> None:
        """Tell all windows what is open, if that changed."""
        state = self._state()
        if state != self._told:
            self._told = state
            self._push(state)

    def tell_outside(self, push: Outside) -> None:
        """Tell all windows what another program did to a file."""
        tab = self._tabs.get(push.tab)
        if tab is not None:
            tab.outside = push if push.state in {"changed", "deleted"} else None
            self._push(push)
            self.tell()

    async def look_for_abandoned(self) -> None:
        """Find the documents that can be recovered: of those below the root, and those without a file."""
        found = await self.workers.do(lambda: find_abandoned(self.journals))
        self._abandoned = {
            each.file.name: each for each in found if each.path is None or self.root.contains(each.path)
        }
        self.tell()

    def abandoned(self, journal: str) -> Path:
        """Return the journal of a document that can be recovered; raises MissingError."""
        if journal not in self._abandoned:
            raise MissingError(f"{journal} cannot be recovered any more")
        return self._abandoned[journal].file

    def _changed(self, tab: Tab) -> None:
        self.tell()  # first: a window hears of a tab before it gets its document
        for window in self._windows:
            window.show(tab)
        self._checking.check(tab)

    def _tell_problems(self, tab: Tab, problems: Problems) -> None:
        if tab.id in self._tabs:
            tab.problems = problems
            self._push(problems)

    def _push(self, push: Push, windows: Iterable[Window] | None = None) -> None:
        for window in self._windows if windows is None else windows:
            window.push(push)

    def _publish_from_anywhere(self, news: Components | Push) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody listens any more
            self._loop.call_soon_threadsafe(self._publish, news)

    def _publish(self, news: Components | Push) -> None:
        match news:
            case Components(running=running, robot_stopped=reason):
                self._running = [dict(each) for each in running]
                self._robot_stopped = reason
                self.tell()
            case Snapshot(component=component) | Structure(component=component) | Stale(component=component):
                self._push(news, self._followers.get(component, ()))
            case Output(tab=number, lines=lines) if number in self._tabs:
                self._tabs[number].output.extend(lines)
                self._push(news)
            case RunPush(tab=number) if number in self._tabs:
                if news.status == "starting":
                    self._tabs[number].output.clear()
                self._tabs[number].run = news
                self._push(news)
            case _:
                _logger.debug("nobody is left to hear %s", type(news).__name__)

    def _state(self) -> WorkspacePush:
        return WorkspacePush(
            tabs=[self._tab_state(tab) for tab in self._tabs.values()],
            recoverable=[
                Recoverable(
                    journal=journal,
                    name=each.name,
                    path="" if each.path is None else self.root.name(each.path),
                    changed_at=each.changed_at,
                )
                for journal, each in self._abandoned.items()
            ],
            running=self._running,
            clipboard=self.copied_states,
            robot_stopped=self._robot_stopped,
        )

    def _tab_state(self, tab: Tab) -> TabState:
        shown = tab.shown
        return TabState(
            tab=tab.id,
            title=shown.name,
            path="" if shown.path is None else self.root.name(shown.path),
            dirty=shown.dirty,
            dialect=shown.dialect,
            recovered=tab.recovered,
            outside="" if tab.outside is None else tab.outside.state,
        )
