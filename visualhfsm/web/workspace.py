"""The state that all windows share: the open documents, the clipboard, and the running components."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import time
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from codegen.hfsm.code.names import component_name
from visualhfsm.code_help.service import CodeHelper
from visualhfsm.editing.check_process import CheckProcess
from visualhfsm.editing.serialization import written
from visualhfsm.errors import EditError, MissingError, TooManyError, VisualHfsmError
from visualhfsm.live.service import Monitoring
from visualhfsm.robots import Robots
from visualhfsm.running import RunningComponents
from visualhfsm.services import (
    Components,
    Output,
    Publish,
    Push,
    RecentLines,
    Robot,
    RunPush,
    Snapshot,
    Stale,
    Structure,
    free_endpoint,
)
from visualhfsm.sessions.journal import Abandoned, find_abandoned, journal_directory
from visualhfsm.sessions.session import Choice, DocumentSession
from zenoh_ice.settings import Settings

from .checking import Checking
from .protocol import Outside, Problems, Recoverable, TabState
from .protocol import Workspace as WorkspacePush
from .security import Root
from .tab import Tab, Threads
from .window import Window

_RECORDINGS: Final = "recordings"  # directory below the root for recordings from the page
_CLOSE_LIMIT: Final = 20.0  # s that a service may take to close: a real robot crouches first
_COMPONENTS_END: Final = 4.0  # s in which components end at STOP before their processes are ended
_ANY_PORT: Final = Settings().listen
_LONGEST_TITLE: Final = 18  # characters before a number: the name of a component has at most 100, in ASCII
_LEAVING_PERIOD: Final = 0.1  # s
_LEAVING_ROUNDS: Final = 10

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits that keep one client from exhausting the server; requests beyond them are refused or wait."""

    message_bytes: int = 4 * 1024 * 1024
    """Largest message on the websocket; a larger one closes it."""

    connections: int = 256
    """Connections at a time, websockets included; the requests of further ones get the status 503."""

    concurrent_operations: int = 16
    """Requests of one connection that are under way at a time; help with code and stops are counted apart."""

    tabs: int = 32
    """Documents open at a time."""

    threads: int = 4
    """Threads that do the work that takes long."""

    operation_seconds: float = 15.0
    """Longest duration of an operation, after which it is answered with an error."""

    output_lines: int = 2000
    """Lines of a component's output that are kept."""

    output_characters: int = 200_000
    """Characters of these lines."""

    quiet_seconds: float = 0.15
    """How long a document must be unchanged before it is checked."""

    file_check_seconds: float = 1.0
    """Seconds between two checks of the open files for changes by other programs."""

    def room_for_output(self) -> RecentLines:
        """Return room for the output of a component."""
        return RecentLines(self.output_lines, self.output_characters)


@dataclass(frozen=True, slots=True)
class Services:
    """The services of the server beside the documents."""

    code_help: CodeHelper
    running: RunningComponents
    live: Monitoring
    robots: Robots
    checks: CheckProcess = field(default_factory=CheckProcess)


MakeServices = Callable[[Publish], Services]
"""Creates the services once the event loop runs; called on it."""


def make_services(settings: Settings, include: Sequence[Path] = ()) -> MakeServices:
    """Return a factory of the services of a realm, which the settings name.

    `include` are directories with packages of interfaces. Components and robots that are started here connect
    to the editor, too, so that all of them find each other, whatever else runs on this machine.
    """

    def make(publish: Publish) -> Services:
        listens_anywhere = settings.mode == "peer" and settings.listen == _ANY_PORT
        listen = (free_endpoint(),) if listens_anywhere else settings.listen
        meeting = settings.connect if settings.mode == "client" else listen
        robots = Robots(publish, settings.override(connect=meeting), settings.connect)
        return Services(
            code_help=CodeHelper(include=include),
            running=RunningComponents(
                publish,
                settings.override(connect=tuple(dict.fromkeys((*meeting, *settings.connect)))),
                include,
            ),
            live=Monitoring(publish, settings.override(listen=listen), robots.observe),
            robots=robots,
        )

    return make


class Workspace:
    """The open documents and their windows. Used on one event loop, as an asynchronous context.

    Every window gets what changes. Leaving it ends running components, and keeps unsaved changes for
    recovery. `include` are directories with packages of interfaces.
    """

    services: Services
    _checking: Checking

    def __init__(
        self,
        root: Root,
        limits: Limits,
        make_services: MakeServices,
        journals: Path | None = None,
        include: Sequence[Path] = (),
        *,
        demo: bool = False,
    ) -> None:
        self.root = root
        self.limits = limits
        self._demo = demo
        self.journals = journals or journal_directory()
        self.threads = Threads(limits.threads)
        self.opening = asyncio.Lock()
        """Held while a document is opened, so that two windows do not open it twice."""
        self.run_id = secrets.token_hex(8)
        """Distinguishes this run of the server from others, whose tabs had the same numbers."""
        self.clipboard = ""
        self._make_services = make_services
        self._tabs: dict[int, Tab] = {}
        self._numbers = count(1)
        self._windows: set[Window] = set()
        self._followers: dict[str, set[Window]] = {}
        self._components = Components([])
        self._robot = Robot()
        self._abandoned: dict[str, Abandoned] = {}
        self._published: WorkspacePush | None = None
        self._include = include
        self._tasks: list[asyncio.Task[None]] = []
        self._stops: set[asyncio.Task[object]] = set()

    async def __aenter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        self.services = self._make_services(self._publish_from_anywhere)
        self._checking = Checking(
            self.services.checks, self.limits.quiet_seconds, self._show_problems, self._include
        )
        await self.look_for_abandoned()
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
        await self._checking.close()
        services = self.services
        for service in (services.running, services.robots, services.live, services.code_help):
            try:
                async with asyncio.timeout(_CLOSE_LIMIT):
                    await service.close()
            except Exception:
                _logger.exception("%s did not close", type(service).__name__)
        for tab in self._tabs.values():
            await tab.edit(DocumentSession.abandon)
        await self.threads.close()

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

    def editable(self, number: int) -> Tab:
        """Return an open document to change it; raises MissingError, or EditError for that of a recording."""
        tab = self.tab(number)
        if tab.recording is not None:
            why, hint = (
                "a recording contains it as it ran",
                "make a copy with `Save as`, which can be changed",
            )
            raise EditError(f"{tab.shown.title} cannot be changed", why, hint)
        return tab

    def tab_of(self, path: Path) -> Tab | None:
        """Return the open document of a file."""
        return next((tab for tab in self._tabs.values() if tab.shown.path == path), None)

    def require_room(self) -> None:
        """Raise TooManyError when no more documents can be opened."""
        if len(self._tabs) >= self.limits.tabs:
            raise TooManyError(f"{len(self._tabs)} documents are open; close one first")

    async def add(self, session: DocumentSession, *, recording: Path | None = None) -> Tab:
        """Show a session in a new tab."""
        number = next(self._numbers)
        tab = await self.threads.do(
            lambda: Tab(
                number,
                session,
                self.threads,
                changed=self._show,
                output=self.limits.room_for_output(),
                recording=recording,
            )
        )
        self._tabs[number] = tab
        self._show(tab)
        return tab

    def remove(self, tab: Tab) -> None:
        """Remove a tab, whose session is closed."""
        del self._tabs[tab.id]
        self._checking.forget(tab)
        for window in self._windows:
            window.close(tab.id)
        self.publish_state()

    def free_title(self, wanted: str) -> str:
        """Return a title for a document without a file, `untitled 2`, whose component no other tab has."""
        taken = {tab.shown.component for tab in self._tabs.values()}
        numbers = range(2, len(taken) + 3)
        titles = [wanted, *(f"{wanted[:_LONGEST_TITLE]} {number}" for number in numbers)]
        return next(title for title in titles if component_name(title) not in taken)

    def unsaved(self) -> list[str]:
        """Return the names of the documents with unsaved changes."""
        return [tab.shown.title for tab in self._tabs.values() if tab.shown.is_unsaved]

    def begin_demo(self) -> bool:
        """Return whether a window is to run the demo: the first one, where neither document nor robot is."""
        wanted, self._demo = self._demo, False
        return wanted and not self._tabs and self._robot.status == "none"

    def require_rest(self) -> None:
        """Raise VisualHfsmError while components run: they would drive a robot that is connected now."""
        if names := [str(each["component"]) for each in self._components.running]:
            raise VisualHfsmError(f"stop {', '.join(names)} first: it would drive the real robot at once")

    async def look_for_abandoned(self) -> None:
        """Find the documents that can be recovered: of those below the root, and those without a file."""
        found = await self.threads.do(lambda: find_abandoned(self.journals))
        self._abandoned = {
            each.file.name: each for each in found if each.path is None or self.root.contains(each.path)
        }
        self.publish_state()

    def abandoned(self, journal: str) -> Path:
        """Return the journal of a document that can be recovered; raises MissingError."""
        if journal not in self._abandoned:
            raise MissingError(f"{journal} cannot be recovered any more")
        return self._abandoned[journal].file

    async def _watch_files(self) -> None:
        """Watch the files of the open documents, until cancelled.

        A document without unsaved changes follows its file; changes of the others are sent to the windows.
        """
        while True:
            await asyncio.sleep(self.limits.file_check_seconds)
            for tab in self.tabs:
                try:
                    outside = await _compare_with_file(tab)
                except Exception:
                    _logger.exception("the file of %s cannot be watched", tab.shown.title)
                    continue
                if outside is not None and tab.id in self._tabs:
                    tab.outside = outside if outside.state in {"changed", "deleted"} else None
                    self._push(outside)
                    self.publish_state()

    # ---------------------------------------------------------------------------------------- windows

    def greet(self, window: Window) -> None:
        """Send a window everything, and from now on every change."""
        self._windows.add(window)
        window.greet()
        window.push(self._state())
        window.push(self._robot)
        for tab in self._tabs.values():
            window.show(tab)
            for push in (tab.problems, tab.outside, tab.run):
                if push is not None:
                    window.push(push)
            output = tab.output
            window.push(Output(tab=tab.id, lines=list(output.lines), dropped=output.dropped, whole=True))

    async def leave(self, window: Window) -> None:
        """Forget a window; components that no other window follows are detached."""
        self._windows.discard(window)
        for component in [name for name, followers in self._followers.items() if window in followers]:
            await self.unfollow(window, component)

    async def follow(self, window: Window, component: str) -> object:
        """Send a window what a component does from now on; raises VisualHfsmError."""
        self._followers.setdefault(component, set()).add(window)
        try:
            return await self.services.live.attach(component)
        except BaseException:
            self._lose(window, component)
            raise

    async def run(
        self, tab: Tab, arguments: Sequence[str], *, record: bool = False, trial: bool = False
    ) -> dict[str, Any]:
        """Start the component of a tab; refused when one of its name runs that was not started here.

        With `record`, its run is recorded with the images that it sees; a `trial` needs no robot.
        """
        name = tab.shown.component
        for _ in range(_LEAVING_ROUNDS):  # one that has just ended may still be listed
            if not self._runs_elsewhere(name):
                break
            await asyncio.sleep(_LEAVING_PERIOD)
        else:
            raise VisualHfsmError(
                f"{name} runs already, and was not started here: stop it first, or save this document under "
                "another name"
            )
        source = tab.shown
        recording: dict[str, str] = {}
        if record:
            file = await self.threads.do(lambda: self._new_recording(name))
            arguments = [*arguments, "--record", str(file), "--record-images"]
            recording = {"recording": self.root.name(file)}
        started = await self.services.running.run(source, arguments, trial=trial)
        tab.generated = source.document
        tab.take_generated()
        self.publish_state()
        return {**started, **recording}

    async def record(self, component: str, pictures: int | None) -> dict[str, str] | None:
        """Record a followed component, with its document if that is open; None ends the recording."""
        live = self.services.live
        if pictures is None:
            await live.end_record(component)
            return None
        tabs = sorted(self._tabs.values(), key=lambda tab: not tab.is_running)
        tab = next((tab for tab in tabs if tab.component == component), None)
        text = ""
        if tab is not None:
            document = (tab.is_running and tab.runs) or tab.shown.document
            text = await self.threads.do(lambda: written(document))
        file = await self.threads.do(lambda: self._new_recording(component))
        live.record(component, file, text, pictures)
        return {"recording": self.root.name(file)}

    def _new_recording(self, component: str) -> Path:
        """Return the path of a file for a recording, in a directory that exists. Raises VisualHfsmError."""
        file = self.root.recording(f"{_RECORDINGS}/{component}-{time.strftime('%Y%m%d-%H%M%S')}.mcap")
        try:
            file.parent.mkdir(exist_ok=True)
        except OSError as error:
            raise VisualHfsmError(f"{file.parent} cannot be made: {error.strerror}") from error
        return file

    def _runs_elsewhere(self, name: str) -> bool:
        return any(each["component"] == name for each in self._components.running) and not any(
            tab.is_running and tab.component == name for tab in self._tabs.values()
        )

    async def generate(self, tab: Tab) -> object:
        """Generate the component of a tab, also for one that runs and is to be reloaded."""
        source = tab.shown
        generated = await self.services.running.generate(source)
        tab.generated = source.document
        return generated

    async def control(self, component: str, action: str, arguments: Mapping[str, Any]) -> object:
        """Steer a component, or ask for its past."""
        result = await self.services.live.control(component, action, arguments)
        if action == "reload":
            for tab in self._tabs.values():
                if tab.is_running and tab.component == component:
                    tab.take_generated()
            self.publish_state()
        return result

    async def emergency_stop(self) -> object:
        """Stop the robot and all components of its realm, then all processes of components started here.

        The window that asked for it may close: it is repeated until the robot is still.
        """
        self.services.running.announce_stop()
        stopping = self._stop(self.services.live.control("", "emergencyStop", {}))
        try:
            await asyncio.wait({stopping}, timeout=_COMPONENTS_END)
        finally:
            self._stop(self.services.running.stop_all())
        return await asyncio.shield(stopping)

    def _stop(self, work: Coroutine[Any, Any, object]) -> asyncio.Task[object]:
        stopping = asyncio.create_task(work, name="emergency stop")
        self._stops.add(stopping)
        stopping.add_done_callback(self._stops.discard)
        return stopping

    async def open_recording(self, window: Window, recording: Path) -> dict[str, Any]:
        """Open a recording, which is closed when the window leaves or detaches."""
        found = await self.services.live.recording(recording)
        self._followers.setdefault(found["component"], set()).add(window)
        return found

    async def unfollow(self, window: Window, component: str) -> None:
        """Stop sending a window the data of a component."""
        if self._lose(window, component):
            await self.services.live.detach(component)

    def _lose(self, window: Window, component: str) -> bool:
        """Remove a window from the followers of a component; return whether it was the last one."""
        followers = self._followers.get(component, set())
        if window not in followers:
            return False
        followers.remove(window)
        if not followers:
            del self._followers[component]
        return not followers

    # ---------------------------------------------------------------------------------------- pushes

    def publish_state(self) -> None:
        """Send all windows the state of the workspace, if it changed."""
        state = self._state()
        if state != self._published:
            self._published = state
            self._push(state)

    def _show(self, tab: Tab) -> None:
        self.publish_state()  # first: a window gets a tab before its document
        for window in self._windows:
            window.show(tab)
        self._checking.check(tab)

    def _show_problems(self, tab: Tab, problems: Problems) -> None:
        if tab.id in self._tabs:
            tab.problems = problems
            self._push(problems)

    def _push(self, push: Push, windows: Iterable[Window] | None = None) -> None:
        for window in self._windows if windows is None else windows:
            window.push(push)

    def _publish_from_anywhere(self, news: Components | Push) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed: there is no listener
            self._loop.call_soon_threadsafe(self._publish, news)

    def _publish(self, news: Components | Push) -> None:
        match news:
            case Components():
                self._components = news
                self.publish_state()
            case Robot():
                self._robot = news
                self._push(news)
            case Snapshot(component=component) | Structure(component=component) | Stale(component=component):
                self._push(news, self._followers.get(component, ()))
            case Output(tab=number, lines=lines, dropped=dropped) if number in self._tabs:
                self._tabs[number].output.add(lines, dropped)
                self._push(news)
            case RunPush(tab=number) if number in self._tabs:
                if news.status == "generating":
                    self._tabs[number].output.clear()
                self._tabs[number].run = news
                self.publish_state()  # first: a window follows the run by the name that the tab has now
                self._push(news)
            case _:
                _logger.debug("no window is left for %s", type(news).__name__)

    def _state(self) -> WorkspacePush:
        return WorkspacePush(
            tabs=[self._tab_state(tab) for tab in self._tabs.values()],
            recoverable=[
                Recoverable(
                    journal=journal, name=each.name, path=self._name(each.path), changed_at=each.changed_at
                )
                for journal, each in self._abandoned.items()
            ],
            running=[dict(each) for each in self._components.running],
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
        return "" if path is None else self.root.name(path)


async def _compare_with_file(tab: Tab) -> Outside | None:
    """Return the news of the file of a tab, which is reloaded unless it has unsaved changes."""
    path = tab.shown.path
    before = "same" if tab.outside is None else tab.outside.state
    if path is None:
        return None
    if not await tab.edit(DocumentSession.is_changed_outside):
        return None if before == "same" else Outside(tab=tab.id, state="same")
    now: Outside
    if not path.exists():
        now = Outside(tab=tab.id, state="deleted")
    elif tab.shown.dirty:
        now = Outside(tab=tab.id, state="changed")
    else:
        try:
            await tab.edit(DocumentSession.resolve, Choice.THEIRS)
            return Outside(tab=tab.id, state="reloaded")
        except EditError as error:  # it is not a document, or incomplete: try again
            now = Outside(tab=tab.id, state="changed", message=str(error))
    return None if now.state == before else now
