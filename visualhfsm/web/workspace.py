"""The state that all windows share: a project with its tabs, the clipboard, and the running components."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Final, Self, TypeVar

from visualhfsm.project.document import OpenDocument
from visualhfsm.project.events import Checked, Event, FileChanged
from visualhfsm.project.project import Project
from visualhfsm.services import (
    Components,
    Output,
    Push,
    Robot,
    RunPush,
    Snapshot,
    Stale,
    Structure,
)
from visualhfsm.sessions.journal import Abandoned

from .checking import Checking
from .code_questions import CodeQuestions
from .limits import Limits
from .protocol import Outside, Problems, Recoverable, TabState
from .protocol import Workspace as WorkspacePush
from .runs import Runs
from .services import MakeServices, Services
from .tab import Tab, Threads
from .tabs import Tabs
from .window import Window
from .windows import Windows

News = TypeVar("News")

_CLOSE_LIMIT: Final = 20.0  # s that a service may take to close: a real robot crouches first

_logger = logging.getLogger(__name__)


class Workspace:
    """A project as the windows see it. Used on one event loop, as an asynchronous context.

    Every window gets what changes. Leaving it ends running components, and keeps unsaved changes for
    recovery. `root` is the folder of the project, `granted` are files that may be elsewhere, `include`
    directories with packages of interfaces.
    """

    services: Services
    project: Project
    code_questions: CodeQuestions
    runs: Runs

    def __init__(
        self,
        root: Path,
        limits: Limits,
        make_services: MakeServices,
        *,
        granted: Iterable[Path] = (),
        journals: Path | None = None,
        include: Sequence[Path] = (),
        demo: bool = False,
    ) -> None:
        self.limits = limits
        self.threads = Threads(limits.threads)
        self.tabs = Tabs()
        self.windows = Windows()
        self.run_id = secrets.token_hex(8)
        """Distinguishes this run of the server from others, whose tabs had the same numbers."""
        self.clipboard = ""
        self._make_services = make_services
        self._root, self._granted, self._include = root, granted, include
        self._journals = journals
        self._demo = demo
        self._checking = Checking(limits.quiet_seconds)
        self._recoverable: list[Abandoned] = []
        self._published: WorkspacePush | None = None
        self._tasks: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        self.services = self._make_services(self._publish_from_anywhere)
        self.project = Project(
            self._root,
            self._include,
            granted=self._granted,
            journals=self._journals,
            most=self.limits.tabs,
            checks=self.services.checks,
            code_help=self.services.code_help,
        )
        self.project.subscribe(self._hear)
        self.code_questions = CodeQuestions(self.project.code_help)
        self.runs = Runs(
            self.services,
            self.tabs,
            self.windows,
            self.threads,
            self.project.root,
            changed=self.publish_state,
        )
        await self.look_for_recoverable()
        self._tasks = [
            asyncio.create_task(self._watch_files(), name="watch of the files"),
            asyncio.create_task(self._checking.run(), name="checks"),
        ]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await asyncio.to_thread(self.project.end_processes)
        await self._checking.close()
        services = self.services
        for service in (services.running, services.robots, services.live):
            try:
                async with asyncio.timeout(_CLOSE_LIMIT):
                    await service.close()
            except Exception:
                _logger.exception("%s did not close", type(service).__name__)
        for tab in self.tabs:
            await tab.edit(OpenDocument.abandon)
        await self.threads.close()
        self.project.close()

    # ---------------------------------------------------------------------------------------- documents

    def show(self, document: OpenDocument, *, recording: Path | None = None) -> Tab:
        """Return the tab of an open document, a new one if it has none."""
        if (known := self.tabs.of_document(document)) is not None:
            return known
        tab = Tab(
            self.tabs.next_number(),
            document,
            self.threads,
            changed=self._show,
            output=self.limits.room_for_output(),
            recording=recording,
        )
        self.tabs.add(tab)
        self._show(tab)
        return tab

    def remove(self, tab: Tab) -> None:
        """Remove a tab, whose document is closed."""
        self.tabs.remove(tab)
        self._checking.forget(tab)
        self.windows.close(tab.id)
        self.publish_state()

    def unsaved(self) -> list[str]:
        """Return the names of the documents with unsaved changes."""
        return [tab.shown.title for tab in self.tabs if tab.shown.is_unsaved]

    def begin_demo(self) -> bool:
        """Return whether a window is to run the demo: the first one, where neither document nor robot is."""
        wanted, self._demo = self._demo, False
        return wanted and not self.tabs and self.runs.robot.status == "none"

    async def look_for_recoverable(self) -> None:
        """Find the documents that can be recovered."""
        self._recoverable = await self.threads.do(self.project.recoverable)
        self.publish_state()

    async def _watch_files(self) -> None:
        """Watch the files of the open documents, until cancelled."""
        while True:
            await asyncio.sleep(self.limits.file_check_seconds)
            for tab in self.tabs:
                try:
                    await tab.edit(OpenDocument.refresh)
                except Exception:
                    if tab.id in self.tabs:
                        _logger.exception("the file of %s cannot be watched", tab.shown.title)

    # ---------------------------------------------------------------------------------------- windows

    def greet(self, window: Window) -> None:
        """Send a window everything, and from now on every change."""
        self.windows.add(window)
        window.greet()
        window.push(self._state())
        window.push(self.runs.robot)
        for tab in self.tabs:
            window.show(tab)
            for push in (tab.problems, tab.outside, tab.run):
                if push is not None:
                    window.push(push)
            output = tab.output
            window.push(Output(tab=tab.id, lines=list(output.lines), dropped=output.dropped, whole=True))

    async def leave(self, window: Window) -> None:
        """Forget a window; components that no other window follows are detached."""
        self.windows.remove(window)
        await self.runs.leave(window)

    def publish_state(self) -> None:
        """Send all windows the state of the workspace, if it changed."""
        state = self._state()
        if state != self._published:
            self._published = state
            self.windows.push(state)

    # ---------------------------------------------------------------------------------------- news

    def _show(self, tab: Tab) -> None:
        """Show the new version of a tab's document."""
        if tab.id not in self.tabs:
            return
        self.publish_state()  # first: a window gets a tab before its document
        self.windows.show(tab)
        self._checking.check(tab)

    def _hear(self, event: Event) -> None:
        """Take an event of the project, in any thread; the tabs hear of changes by themselves."""
        if isinstance(event, Checked | FileChanged):
            self._call_soon(self._take, event)

    def _take(self, event: Checked | FileChanged) -> None:
        tab = self.tabs.of_document(event.document)
        if tab is None:
            return
        match event:
            case Checked(version=version, findings=findings):
                tab.problems = Problems(tab=tab.id, revision=version.revision, items=findings.problems)
                self.windows.push(tab.problems)
            case FileChanged(state=state, message=message):
                outside = Outside(tab=tab.id, state=state, message=message)
                tab.outside = outside if state in {"changed", "deleted"} else None
                self.windows.push(outside)
                self.publish_state()

    def _publish_from_anywhere(self, news: Components | Push) -> None:
        self._call_soon(self._publish, news)

    def _publish(self, news: Components | Push) -> None:
        match news:
            case Components():
                self.runs.components = news
                self.publish_state()
            case Robot():
                self.runs.robot = news
                self.windows.push(news)
            case Snapshot(component=component) | Structure(component=component) | Stale(component=component):
                self.windows.push_to_followers(component, news)
            case Output(tab=number, lines=lines, dropped=dropped) if number in self.tabs:
                self.tabs.get(number).output.add(lines, dropped)
                self.windows.push(news)
            case RunPush(tab=number) if number in self.tabs:
                tab = self.tabs.get(number)
                if news.status == "generating":
                    tab.output.clear()
                tab.run = news
                self.publish_state()  # first: a window follows the run by the name that the tab has now
                self.windows.push(news)
            case _:
                _logger.debug("no window is left for %s", type(news).__name__)

    def _call_soon(self, take: Callable[[News], None], news: News) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed: there is no listener
            self._loop.call_soon_threadsafe(take, news)

    # ---------------------------------------------------------------------------------------- state

    def _state(self) -> WorkspacePush:
        return WorkspacePush(
            tabs=[self._tab_state(tab) for tab in self.tabs],
            recoverable=[
                Recoverable(
                    journal=each.file.name,
                    name=each.name,
                    path=self._name(each.path),
                    changed_at=each.changed_at,
                )
                for each in self._recoverable
            ],
            running=[dict(each) for each in self.runs.components.running],
        )

    def _tab_state(self, tab: Tab) -> TabState:
        shown = tab.shown
        return TabState(
            tab=tab.id,
            title=shown.title,
            path=self._name(shown.path),
            component=tab.component,
            dirty=shown.dirty,
            recording=self._name(tab.recording),
            outside="" if tab.outside is None else tab.outside.state,
            changed=tab.differs_from_run,
        )

    def _name(self, path: Path | None) -> str:
        return "" if path is None else self.project.root.name(path)
