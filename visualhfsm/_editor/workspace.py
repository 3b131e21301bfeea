"""The state that all windows share: a project with its tabs, the clipboard, and the running components."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import msgspec

from visualhfsm._editor.own_robots import OwnRobots
from visualhfsm._monitor.messages import Output
from visualhfsm.project._document import OpenDocument
from visualhfsm.project._editing.journal import Abandoned
from visualhfsm.project._project import Project

from .check_scheduler import CheckScheduler
from .code_questions import CodeQuestions
from .components import Components
from .limits import Limits
from .news import News
from .parts import MakeParts, Parts
from .protocol import VIEWS, Outside, Problems, Recoverable, Shelf, TabState, WorkspacePush
from .tab import Dated, Tab, Threads
from .tabs import Tabs
from .views import offered
from .window import Window
from .windows import Windows

_CLOSE_LIMIT: Final = 20.0  # s that a part may take to close: a real robot crouches first

_logger = logging.getLogger(__name__)


class Workspace:
    """A project as the windows see it. Used on one event loop, as an asynchronous context.

    Every window gets what changes. Leaving it ends running components, and keeps unsaved changes for
    recovery. The project gets the parts that check and read code.
    """

    news: News
    parts: Parts
    project: Project
    code_questions: CodeQuestions
    components: Components
    own_robots: OwnRobots
    _checks: CheckScheduler

    def __init__(
        self,
        limits: Limits,
        make_parts: MakeParts,
        make_project: Callable[[Parts], Project],
        *,
        demo: bool = False,
        share: Callable[[bool], str] = lambda _: "",
    ) -> None:
        self.limits = limits
        self.share = share
        """Returns the read-only address of the page, relative to it; with False, withdraws it."""
        self.threads = Threads(limits.threads)
        self.judging = asyncio.Lock()
        self.tabs = Tabs()
        self.windows = Windows()
        self.instance = secrets.token_hex(8)
        """Distinguishes this run of the server from others, whose tabs had the same numbers."""
        self.clipboard = ""
        """The states that any window has copied last."""
        self._make_parts = make_parts
        self._make_project = make_project
        self._demo = demo
        self._recording = ""
        self._recoverable: list[Abandoned] = []
        self._published: WorkspacePush | None = None
        self._listed: dict[int, tuple[tuple[object, ...], TabState]] = {}
        """By tab, what is listed of its document, and how."""
        self._shelf = Shelf(states=[])
        self._tasks: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> Self:
        self.news = News(self.tabs, self.windows, self.publish_state)
        self.parts = self._make_parts(self.news.publish)
        self.project = self._make_project(self.parts)
        self._checks = CheckScheduler(self.limits.quiet_seconds, self.project.checks.give_up_search)
        self.code_questions = CodeQuestions(self.project.code_help)
        self.own_robots = OwnRobots(self.project.root)
        self.components = Components(
            self.parts,
            self.project.root,
            self.news,
            tabs=self.tabs,
            windows=self.windows,
            threads=self.threads,
            limits=self.limits,
        )
        try:
            await self.look_for_recoverable()
            await self._look_at_shelf()
        except BaseException:
            await self._close()
            raise
        self._tasks = [
            asyncio.create_task(self._watch_files(), name="watch of the files"),
            asyncio.create_task(self._checks.run(), name="checks"),
        ]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._close()

    async def _close(self) -> None:
        """Close everything; what fails, or takes too long, keeps nothing else open."""
        await _end("the checks", asyncio.to_thread(self.project.end_processes))
        await _end("the checks", self._checks.close())
        await _end("what pages had followed", self.components.close())
        parts = self.parts
        for view, work in parts.views.items():
            await _end(f"the view {view}", work.close())
        for part in (parts.tests, parts.started, parts.robot, parts.followers):
            await _end(type(part).__name__, part.close())
        for tab in self.tabs:
            await _end(tab.shown.title, tab.edit(OpenDocument.abandon))
        await _end("the threads", self.threads.close())
        await _end("the project", asyncio.to_thread(self.project.close))

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
            found=self._report,
            output=self.limits.room_for_output(),
            recording=recording,
        )
        self.tabs.add(tab)
        self.parts.started.prepare()
        self._show(tab)
        return tab

    def _show(self, tab: Tab) -> None:
        """Show the new version of a tab's document."""
        if tab.id not in self.tabs:
            return
        shown, (listed, _) = tab.shown, self._listed.get(tab.id, ((), None))
        if tab.loaded is not None or tab.listed != listed:
            self.publish_state()  # first: a window gets a tab before its document
        self.windows.show(tab)
        reports: list[Dated[Any]] = [*tab.of_views.values(), tab.tests]
        for dated in reports:
            if dated.now is not None and (report := dated.compare(shown.document, tab.content)) is not None:
                self.windows.push(report)
        self._checks.check(tab)

    def _report(self, tab: Tab, news: Problems | Outside) -> None:
        """Send all windows what was found out about a tab's document."""
        if tab.id not in self.tabs:
            return
        self.windows.push(news)
        if isinstance(news, Outside):
            self.publish_state()
        elif tab.tests.now is not None:
            tests = tab.tests.compare(tab.shown.document, tab.content)
            if tests is not None:
                self.windows.push(tests)

    def remove(self, tab: Tab) -> None:
        """Remove a tab, whose document is closed."""
        self.tabs.remove(tab)
        self._listed.pop(tab.id, None)
        self._checks.forget(tab)
        self.windows.close(tab.id)
        self.publish_state()

    def unsaved(self) -> list[str]:
        """Return the names of the documents with unsaved changes."""
        return [tab.shown.title for tab in self.tabs if tab.shown.is_unsaved]

    def begin_demo(self) -> bool:
        """Return whether a window is to run the demo: the first one, where neither document nor robot is."""
        wanted, self._demo = self._demo, False
        return wanted and not self.tabs and self.news.robot.status == "none"

    def offer_recording(self, path: str) -> None:
        """Let the first window that comes show a recording."""
        self._recording = path

    def begin_recording(self) -> str:
        """Return the recording that a window is to show; empty for all but the first one."""
        wanted, self._recording = self._recording, ""
        return wanted

    async def look_for_recoverable(self) -> None:
        """Find the documents that can be recovered."""
        self._recoverable = await self.threads.do(self.project.recoverable)
        self.publish_state()

    async def _look_at_shelf(self) -> None:
        """Find what is on the shelf, and send all windows what is new."""
        shelf = Shelf(states=await self.threads.do(self.project.shelf))
        if shelf != self._shelf:
            self._shelf = shelf
            self.windows.push(shelf)

    async def _watch_files(self) -> None:
        """Watch the files of the open documents, of their tests and of the shelf, until cancelled."""
        while True:
            await asyncio.sleep(self.limits.file_check_seconds)
            try:
                await self._look_at_shelf()
            except Exception:
                _logger.exception("the shelf cannot be read")
            for tab in self.tabs:
                try:
                    await tab.edit(OpenDocument.refresh)
                    if await tab.imports_changed():
                        self._checks.check(tab)
                    await self.parts.tests.refresh(tab.source)
                except Exception:
                    if tab.id in self.tabs:
                        _logger.exception("the files of %s cannot be watched", tab.shown.title)

    # ---------------------------------------------------------------------------------------- windows

    def greet(self, window: Window, language: str) -> None:
        """Send a window everything, and from now on every change, in its language."""
        self.windows.add(window)
        window.greet(language)
        window.push(self._state())
        window.push(self._shelf)
        window.push(self.news.robot)
        for tab in self.tabs:
            window.show(tab)
            of_views = [each.now for each in tab.of_views.values()]
            for push in (tab.problems, tab.outside, tab.started, *of_views, tab.tests.now):
                if push is not None:
                    window.push(push)
            output = tab.output
            window.push(Output(tab=tab.id, lines=list(output.lines), dropped=output.dropped, whole=True))

    async def leave(self, window: Window) -> None:
        """Forget a window; components that no other window follows are followed no more."""
        self.windows.remove(window)
        await self.components.leave(window)

    def publish_state(self) -> None:
        """Send all windows the state of the workspace, if it changed."""
        state = self._state()
        if state != self._published:
            self._published = state
            self.windows.push(state)

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
            present=[*self.news.present.components],
        )

    def _tab_state(self, tab: Tab) -> TabState:
        listed, state = self._listed.get(tab.id, ((), None))
        if state is None or listed != tab.listed:
            shown = tab.shown
            state = TabState(
                tab=tab.id,
                title=shown.title,
                path=self._name(shown.path),
                component="",
                dirty=shown.dirty,
                recording=self._name(tab.recording),
                outside="" if tab.outside is None else tab.outside.state,
                changed=False,
                views=offered(VIEWS, shown.path),
            )
            self._listed[tab.id] = tab.listed, state
        return msgspec.structs.replace(state, component=tab.component, changed=tab.differs_from_loaded)

    def _name(self, path: Path | None) -> str:
        return "" if path is None else self.project.root.name(path)


async def _end(what: str, work: Awaitable[object]) -> None:
    try:
        async with asyncio.timeout(_CLOSE_LIMIT):
            await work
    except Exception:
        _logger.exception("%s did not close", what)
