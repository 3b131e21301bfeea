"""Components and the robot, as the windows start, follow, record and stop them."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Collection, Coroutine, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from codegen.messages import Message, joined
from visualhfsm._base.errors import SharedRobotError, VisualHfsmError
from visualhfsm._document.serialization import written
from visualhfsm._monitor.followers import Followed, OpenedRecording
from visualhfsm._monitor.messages import Stopper
from visualhfsm._monitor.stopping import StopReport
from visualhfsm.project._root import Root

from . import answers as a
from .limits import Limits
from .news import News
from .parts import Parts
from .tab import Tab, Threads
from .tabs import Tabs
from .window import Window
from .windows import Windows

_RECORDINGS: Final = "recordings"  # directory below the root for recordings from the page
_LEAVING_PERIOD: Final = 0.1  # s


class Components:
    """The components of the realm and those that were started here. Used on the event loop only.

    At STOP, components have some time to end before their processes are ended.
    """

    def __init__(
        self,
        parts: Parts,
        root: Root,
        news: News,
        *,
        tabs: Tabs,
        windows: Windows,
        threads: Threads,
        limits: Limits,
    ) -> None:
        self._parts = parts
        self._root = root
        self._news = news
        self._tabs = tabs
        self._windows = windows
        self._threads = threads
        self._limits = limits
        self._stops: set[asyncio.Task[object]] = set()
        self._leaving: set[asyncio.Task[None]] = set()

    def require_rest(self) -> None:
        """Raise VisualHfsmError while components start or run: they would drive a robot that comes."""
        started = self._parts.started
        present = {str(each["component"]) for each in self._news.present.components}
        if names := (present - started.names(dry=True)) | started.names(dry=False):
            raise VisualHfsmError.because(
                "stop {names} first: it would drive the real robot at once", names=", ".join(sorted(names))
            )

    async def require_accepted(self, tab: Tab, accepted: Collection[str]) -> None:
        """Raise SharedRobotError while components of others run that are not accepted beside that of a tab.

        They count only for a document that uses a robot.
        """
        ours = {each.started.component for each in self._tabs if each.started is not None}
        names = [str(each["component"]) for each in self._news.present.components]
        others = [name for name in names if name not in ours and name not in accepted]
        if not others or not tab.shown.document.interfaces:
            return
        found = await self._parts.followers.described(others)
        raise SharedRobotError.because(
            "{components} runs on this robot, and was started in another editor or a terminal. Two "
            "components that move the same joints work against each other. The list of what runs, beside "
            "the robot, shows what it does; STOP stops all.",
            components=joined(", ", found),
        )

    # ---------------------------------------------------------------------------------------- components

    async def start(
        self,
        window: Window,
        tab: Tab,
        arguments: Sequence[str],
        *,
        record: bool = False,
        dry_run: str | None = None,
    ) -> a.StartedRun:
        """Start the component of a tab, which the window follows from then on, before it is present.

        It is refused when one of its name runs that was not started here. With `record`, its run is recorded
        with the images that it sees; a `dry_run` needs no robot: it names the body of a fake one.
        """
        name = tab.shown.component
        try:
            # One that has just ended may still be listed.
            async with asyncio.timeout(self._limits.component_leaving_seconds):
                while self._runs_elsewhere(name):
                    await asyncio.sleep(_LEAVING_PERIOD)
        except TimeoutError:
            raise VisualHfsmError.because(
                "{name} runs already, and was not started here: stop it first, or save this document "
                "under another name",
                name=name,
            ) from None
        source = tab.source
        recording = ""
        if record:
            file = await self._threads.do(lambda: self._new_recording(name))
            arguments = [*arguments, "--record", str(file), "--record-images"]
            recording = self._root.name(file)
        started = await self._parts.started.start(
            source, arguments, dry_run=dry_run, require_ready=self._parts.robot.require_connected
        )
        tab.generated = source.document
        tab.take_generated()
        self._news.publish_state()
        followed = await self.follow(window, name, awaited=True)
        run: a.StartedRun = {"component": started, "recording": recording, **followed}
        if not recording:
            del run["recording"]
        return run

    async def generate(self, tab: Tab) -> a.Written:
        """Generate the component of a tab, also for one that runs and is to be reloaded."""
        source = tab.source
        generated = await self._parts.started.generate(source)
        tab.generated = source.document
        return {"path": str(generated)}

    async def steer(self, component: str, action: str, arguments: Mapping[str, Any]) -> object:
        """Steer a component that is followed."""
        result = await self._parts.followers.steer(component, action, arguments)
        if action == "reload":
            for tab in self._tabs:
                if tab.is_started and tab.component == component:
                    tab.take_generated()
            self._news.publish_state()
        return result

    def _runs_elsewhere(self, name: str) -> bool:
        present = self._news.present.components
        return any(each["component"] == name for each in present) and not any(
            tab.is_started and tab.component == name for tab in self._tabs
        )

    # ---------------------------------------------------------------------------------------- stopping

    async def emergency_stop(self, by: Stopper) -> StopReport:
        """Stop the robot and all components of its realm, then all processes of components started here.

        The window that asked for it may close: it is repeated until the robot is still.
        """
        parts, limit = self._parts, self._limits.component_end_seconds
        parts.started.announce_stop(by)
        names = parts.started.names()
        stopping = self._stop(parts.followers.emergency_stop())
        try:
            await asyncio.wait({stopping}, timeout=limit)
        finally:
            ending = self._stop(parts.started.stop_all())
        report: StopReport = await asyncio.shield(stopping)
        if names and (unseen := names.difference(report.stopped, report.failed)):
            await asyncio.wait({ending}, timeout=limit)  # what was starting was not in the realm yet
            late = unseen & parts.started.names()
            report.stopped.extend(sorted(unseen - late))
            report.failed.update((name, Message("it has not ended yet")) for name in late)
        return report

    def _stop(self, work: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
        stopping = asyncio.create_task(work, name="emergency stop")
        self._stops.add(stopping)
        stopping.add_done_callback(self._stops.discard)
        return stopping

    # ---------------------------------------------------------------------------------------- recordings

    async def record(self, component: str, pictures: int | None) -> a.Recorded | None:
        """Record a followed component, with its document if that is open; None ends the recording."""
        followers = self._parts.followers
        if pictures is None:
            await followers.end_record(component)
            return None
        tab = self._tabs.of_component(component)
        text = ""
        if tab is not None:
            document = (tab.is_started and tab.loaded) or tab.shown.document
            text = await self._threads.do(lambda: written(document))
        file = await self._threads.do(lambda: self._new_recording(component))
        await followers.record(component, file, text, pictures)
        return {"recording": self._root.name(file)}

    async def open_recording(self, window: Window, recording: Path) -> OpenedRecording:
        """Open a recording, which is closed when the window leaves or follows it no more."""
        found = await self._parts.followers.recording(recording)
        self._windows.follow(window, found["component"])
        return found

    async def recordings(self) -> Path:
        """Return the directory of recordings, which exists. Raises VisualHfsmError."""
        return await self._threads.do(self._recordings)

    def _new_recording(self, component: str) -> Path:
        """Return the path of a file for a recording, in a directory that exists. Raises VisualHfsmError."""
        return self._recordings() / f"{component}-{time.strftime('%Y%m%d-%H%M%S')}.mcap"

    def _recordings(self) -> Path:
        folder = self._root.resolve(_RECORDINGS)
        with VisualHfsmError.in_place_of(OSError, "{folder} cannot be made: {reason}", folder=str(folder)):
            folder.mkdir(exist_ok=True)
        return folder

    # ---------------------------------------------------------------------------------------- following

    async def follow(self, window: Window, component: str, *, awaited: bool = False) -> Followed:
        """Send a window what a component does from now on, if it is present or `awaited`."""
        self._windows.follow(window, component)
        try:
            return await self._parts.followers.follow(component, awaited=awaited)
        except BaseException:
            self._windows.unfollow(window, component)
            raise

    async def unfollow(self, window: Window, component: str) -> None:
        """Stop sending a window the data of a component, which is not followed any more when nobody does."""
        if self._windows.unfollow(window, component):
            await self._parts.followers.unfollow(component)

    async def leave(self, window: Window) -> None:
        """Stop sending a window anything; what nobody follows any more is followed on for a while."""
        for component in self._windows.followed_by(window):
            if self._windows.unfollow(window, component):
                leaving = asyncio.create_task(self._forget_later(component), name="a page that may return")
                self._leaving.add(leaving)
                leaving.add_done_callback(self._leaving.discard)

    async def _forget_later(self, component: str) -> None:
        await asyncio.sleep(self._limits.return_seconds)
        if not self._windows.follows(component):
            await self._parts.followers.unfollow(component)

    async def close(self) -> None:
        """Wait for no page any more."""
        for leaving in self._leaving:
            leaving.cancel()
        await asyncio.gather(*self._leaving, return_exceptions=True)
