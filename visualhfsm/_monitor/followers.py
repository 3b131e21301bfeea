"""Follow and steer the components and the robot of a realm, as the page requests it."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Final, NotRequired, TypedDict

import msgspec

from codegen.hfsm.document import Document
from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason
from interfaces.hfsm import Explanation, HfsmMonitorPrx
from visualhfsm._base.errors import MissingPackageError, VisualHfsmError
from visualhfsm._document.views import of_page
from visualhfsm._monitor import messages
from visualhfsm._monitor.graphs import read_ros_graph
from visualhfsm._monitor.realm.description import nao
from visualhfsm._monitor.realm.explanations import explain_moment
from visualhfsm._monitor.realm.follower import Follower, LiveStructure, News, Silence
from visualhfsm._monitor.realm.moments import Moment, translate_moment, translate_snapshot
from visualhfsm._monitor.realm.pictures import require_pillow
from visualhfsm._monitor.realm.realm import MONITOR_PREFIX, components, describe_component, missing_component
from visualhfsm._monitor.realm.robot import RobotFacts, RobotMonitor, RobotPresence
from visualhfsm._monitor.realm.run_log import LiveSnapshot, RunLog, Timeline
from visualhfsm._monitor.run_page import MOST_PICTURES, ExportedRun, run_page
from zenoh_ice import Communicator, Settings, ZenohIceError, initialize
from zenoh_ice.data.keys import Target
from zenoh_ice.data.text import printable

from .cameras import KEPT_APART, MOST_CAMERAS, Cameras
from .open_recordings import OpenRecordings
from .poses import PoseStream
from .recorder import Recorder
from .steering import operate, reset_robot, set_faults, set_scene, stand_robot
from .stopping import StopReport, stop_once, stop_robot

_POLL_INTERVAL: Final = 0.01  # s
_NEWS_LIMIT: Final = 5.0
"""Seconds to wait for the first news of a component."""
_BODY: Final = "Body"
"""The servant that every robot has."""

_logger = logging.getLogger(__name__)


class Followed(TypedDict):
    """What is known of a component that is followed: its latest data, and when it went silent."""

    structure: LiveStructure | None
    snapshot: Moment | None
    timeline: Timeline
    since: NotRequired[float | None]
    facts: NotRequired[RobotFacts]


class OpenedRecording(Followed):
    """A recording: the name for further requests, its document, and until when it is `shortened` if it is."""

    component: str
    document: str
    shortened: Message
    world: Annotated[Sequence[Any], of_page('import("../robot3d/world-drawing.js").WorldShape[]')]
    cameras: Sequence[str]
    body: str


_READS_NAO: Final = threading.Lock()


@cache
def _read_interfaces_of_nao() -> dict[str, list[str]]:
    from visualhfsm.simulation import served_interfaces  # its libraries are needed only without a robot

    return served_interfaces()


def _interfaces_of_nao() -> dict[str, list[str]]:
    with _READS_NAO:  # each window asks for them when it opens: one thread alone does the work
        return _read_interfaces_of_nao()


class Followers:
    """Follows and steers components. Create it on the event loop; it listens until `close`.

    The past of an open recording is requested by the name that `recording` returned. Everything raises
    VisualHfsmError.
    """

    def __init__(
        self,
        publish: messages.Publish,
        settings: Settings,
        observe: Callable[[RobotPresence], None] = lambda _: None,
        *,
        limits: messages.PartLimits = messages.USUAL_LIMITS,
    ) -> None:
        self._limits = limits
        self._publish = publish
        self._observe = observe
        self._communicator: Final[Communicator] = initialize(settings)
        self._communicator.presence.needs_links = False  # a robot may come and go; its loss is reported
        self._robot = RobotMonitor(self._communicator)
        self._cameras = Cameras(self._communicator)
        self._poses = PoseStream(self._robot)
        self._followers: dict[str, Follower] = {}
        self._recordings: Final = OpenRecordings()
        self._recorders: dict[str, Recorder] = {}
        self._ending: dict[str, asyncio.Task[None]] = {}
        """The ends of recordings, by component: the last of each."""
        self._stops: Final[set[asyncio.Task[StopReport]]] = set()
        self._published: messages.Present | None = None
        self._tasks = {
            asyncio.create_task(self._keep(), name="followers"),
            asyncio.create_task(self._keep_pictures(), name="pictures"),
        }

    async def follow(self, component: str, *, awaited: bool = False) -> Followed:
        """Follow a component, if it is present or `awaited`; return what is known of it."""
        follower = self._followers.get(component)
        if follower is None:
            missing = None if awaited else missing_component(self._communicator, component)
            if missing is not None:
                raise missing
            follower = self._followers[component] = Follower(
                self._communicator,
                component,
                self._robot,
                self._publisher(component),
                silence=self._limits.silence,
                awaited=awaited,
            )
            follower.update()
        return {
            "structure": follower.structure,
            "snapshot": follower.log.newest,
            "timeline": follower.log.timeline(),
            "since": follower.silence.since,
            "facts": self._robot.facts(),
        }

    async def described(self, names: Sequence[str]) -> list[Message]:
        """Return the names of components with their processes, and since when they run."""
        return await asyncio.to_thread(
            lambda: [describe_component(self._communicator, each) for each in names]
        )

    async def unfollow(self, component: str) -> None:
        """Stop following and recording it, or close a recording."""
        self._recordings.close(component)
        follower = self._followers.pop(component, None)  # at once: who follows from now on gets another one
        await self.end_record(component)
        if follower is not None:
            await asyncio.to_thread(follower.close)

    async def steer(self, component: str, action: str, arguments: Mapping[str, Any]) -> object:
        """Call an operation of the monitor of a component that is followed, and return its result."""
        follower = self._follower(component)
        try:
            return await operate(follower.monitor, action, arguments)
        finally:
            follower.forget_breakpoints()

    async def moment(self, component: str, time: float) -> object:
        """Return the snapshot at a component time in s of a component that is followed, or of a recording."""
        return translate_moment((await self._log(component)).at(time))

    async def explanation(self, component: str, automaton: int, time: float) -> Explanation | None:
        """Return why an automaton stayed in its state at a component time in s; None if that is not known."""
        run = await self._recordings.get(component)
        if run is not None:
            return explain_moment(run.structure, run.log.at(time), automaton)
        follower = self._follower(component)
        live = follower.structure
        return None if live is None else explain_moment(live.structure, follower.log.at(time), automaton)

    async def series(
        self, component: str, names: Sequence[str], start: float, end: float, points: int
    ) -> dict[str, Any]:
        """Return numbers over time, as `RunLog.series` does."""
        return await asyncio.to_thread((await self._log(component)).series, names, start, end, points)

    async def picture(self, component: str, camera: str, at: float) -> bytes | None:
        """Return the picture of a camera at a wall time as JPEG; None when it was not kept or recorded."""
        run = await self._recordings.get(component)
        if run is None:
            return self._cameras.former.at(camera, at)
        return await asyncio.to_thread(run.pictures.at, camera, at)

    async def emergency_stop(self) -> StopReport:
        """Stop the robot until it is still, and end all components. The stop goes on without its caller."""
        stop = asyncio.create_task(self._emergency_stop(), name="emergency stop")
        self._stops.add(stop)
        stop.add_done_callback(self._stops.discard)
        return await asyncio.shield(stop)

    async def reset_robot(self) -> None:
        """Let the robot accept commands again, once no stop is repeated any more, which would undo that."""
        if self._stops:
            await asyncio.wait(self._stops)
        await reset_robot(self._communicator)

    async def stand_robot(self) -> None:
        """Put a simulated robot on its feet where it is."""
        await stand_robot(self._communicator)

    async def set_scene(self, action: str, arguments: Mapping[str, Any]) -> object:
        """Call an operation of the world of a simulation, and return its result."""
        return await set_scene(self._communicator, action, arguments)

    async def set_faults(self, action: str, arguments: Mapping[str, Any]) -> None:
        """Let a part of the robot fail, or heal it."""
        await set_faults(self._communicator, action, arguments)

    async def facts(self) -> RobotFacts:
        """Return the constants of the robot."""
        return self._robot.facts()

    async def ros_graph(self) -> dict[str, Any]:
        """Return the graph of ROS as `read_ros_graph` does."""
        return await asyncio.to_thread(read_ros_graph, self._communicator.settings)

    async def record(self, component: str, path: Path, document: str, pictures: int) -> None:
        """Record a component into a new file, as `Recorder` does, at most as long as it is followed.

        The first news of one that has just been started are waited for.
        """
        deadline = asyncio.get_running_loop().time() + _NEWS_LIMIT
        while not self._follower(component).knows and asyncio.get_running_loop().time() < deadline:
            await asyncio.sleep(_POLL_INTERVAL)
        if component in self._recorders:
            raise VisualHfsmError.because("{component} is being recorded already", component=component)
        follower = self._follower(component)
        self._recorders[component] = Recorder(follower, self._robot, path, document, pictures)

    async def end_record(self, component: str) -> None:
        """End what `record` began, and return when its file has all, also if another has ended it."""
        if (recorder := self._recorders.pop(component, None)) is not None:
            self._ending[component] = asyncio.create_task(recorder.close())
        if (ending := self._ending.get(component)) is not None:
            await asyncio.shield(ending)

    async def recording(self, path: Path) -> OpenedRecording:
        """Open the recording of a run; return its first data, and the name for requesting more."""
        name, run = await self._recordings.open(path)
        return {
            "component": name,
            "structure": LiveStructure(run.structure, 1),
            "snapshot": translate_moment(run.log.at(0.0)),
            "timeline": run.log.timeline(),
            "document": run.document,
            "shortened": run.shortened,
            "world": run.world,
            "cameras": run.pictures.cameras,
            "body": run.described.hash,
        }

    async def exported(
        self, component: str, document: Document | None, imported: Sequence[Mapping[str, Any]]
    ) -> str:
        """Return the run of a component that is followed, or of an open recording, as a page of HTML."""
        recorded = await self._recordings.get(component)
        if recorded is not None:
            return await asyncio.to_thread(lambda: run_page(recorded.exported(document, imported)))
        follower = self._follower(component)
        if follower.structure is None:
            raise VisualHfsmError.because(
                "the automata of {component} are not known yet", component=component
            )
        structure, shapes = follower.structure.structure, self._robot.world.shapes
        # Those from before are perhaps of another robot.
        pictures = self._cameras.former.spread(MOST_PICTURES, *follower.log.wall_times())
        body = (follower.described or nao()).page
        run = ExportedRun(component, structure, follower.log, document, imported, shapes, pictures, body=body)
        return await asyncio.to_thread(run_page, run)

    def camera(self, name: str) -> AsyncGenerator[bytes | str, None]:
        """Return the newest image of a camera, as JPEG, whenever there is a newer one, and marks on it."""
        return self._cameras.frames(name)

    def poses(self, language: str) -> AsyncGenerator[bytes, None]:
        """Return which robot it is as JSON, then its state whenever that has changed."""
        return self._poses.frames(language)

    async def close(self) -> None:
        """Stop listening, and close the session, once no stop is repeated any more."""
        if self._stops:
            await asyncio.wait(self._stops)
        for task in self._tasks:
            task.cancel()
        await asyncio.wait(self._tasks)
        for component in list(self._recorders):
            await self.end_record(component)
        await asyncio.to_thread(self._close)

    def _close(self) -> None:
        for follower in self._followers.values():
            follower.close()
        self._followers.clear()
        self._communicator.destroy()

    async def _keep(self) -> None:
        """Update everything, by default ten times a second; what fails may succeed in the next round."""
        while True:
            try:
                await self._update()
            except Exception:
                _logger.exception("the components could not be updated")
            for follower in list(self._followers.values()):
                try:
                    follower.update()
                except Exception:
                    _logger.exception("%s could not be updated", follower.component)
            await asyncio.sleep(self._limits.refreshment)

    async def _update(self) -> None:
        self._robot.update()
        self._robot.others.update(self._robot.world.others())
        self._observe(self._robot.presence())
        for name, recorder in list(self._recorders.items()):
            if recorder.is_over:
                await self.end_record(name)
        running: list[messages.PresentComponent] = [
            {"component": name, "recording": it.file, "since": it.since}
            if (it := self._recorders.get(name))
            else {"component": name}
            for name in components(self._communicator)
        ]
        news = messages.Present(running)
        if news != self._published:
            self._published = news
            self._publish(news)

    async def _keep_pictures(self) -> None:
        """Keep pictures of all cameras while something that runs is followed, for looking back."""
        with suppress(MissingPackageError):
            require_pillow()
            while True:
                runs = any(not follower.silence.since for follower in self._followers.values())
                cameras = self._robot.cameras()[:MOST_CAMERAS] if runs else []
                await self._cameras.keep(cameras)
                await asyncio.sleep(KEPT_APART if cameras else self._limits.refreshment)

    def _publisher(self, component: str) -> Callable[[News], None]:
        def publish(news: News) -> None:
            if (recorder := self._recorders.get(component)) is not None:
                recorder.record(news)
            match news:
                case LiveSnapshot():
                    self._publish(messages.Snapshot(component=component, value=translate_snapshot(news)))
                case LiveStructure():
                    self._publish(messages.Structure(component=component, value=news))
                case Silence(since):
                    self._publish(messages.Stale(component=component, since=since))

        return publish

    def _follower(self, component: str) -> Follower:
        follower = self._followers.get(component)
        if follower is None:
            raise VisualHfsmError.because("{component} is not followed", component=printable(component)[:100])
        return follower

    async def _log(self, component: str) -> RunLog:
        run = await self._recordings.get(component)
        return run.log if run is not None else self._follower(component).log

    async def identities(self) -> dict[str, list[str]]:
        """Return what is served in the realm: identities, each with the type ids of its interfaces.

        Without a robot there, what a Nao serves is among them: documents are written before robots are there.
        """
        communicator = self._communicator
        found = {
            identity: sorted(communicator.presence.interfaces(Target(communicator.realm, identity)))
            for identity in communicator.identities()
        }
        return found if _BODY in found else {**await asyncio.to_thread(_interfaces_of_nao), **found}

    async def body(self, wanted: str) -> msgspec.Raw | None:
        """Return the robot of a hash as the page draws it; None when it is gone."""
        shown = (
            self._robot.described,
            nao(),
            *(described for _, described in self._robot.others.bodies().values()),
            *(follower.described for follower in self._followers.values()),
            *self._recordings.described(),
        )
        found = (each.page for each in shown if each is not None and each.hash == wanted)
        return next(map(msgspec.Raw, found), None)

    async def _emergency_stop(self) -> StopReport:
        """Stop the robot and all components at once, and the robot until it is still when they have ended.

        A component may be in the middle of a cycle that commands the robot after the first stop.
        """
        begun = asyncio.get_running_loop().time()
        names = components(self._communicator)
        if not names:
            return await stop_robot(self._communicator, begun, self._limits)
        ending = asyncio.gather(*(self._stop_component(name) for name in names))
        await stop_once(self._communicator, self._limits)
        problems = dict(zip(names, await ending, strict=True))
        report = await stop_robot(self._communicator, begun, self._limits)
        present = components(self._communicator)  # who has ended by now has ended
        late = {name: problem for name, problem in problems.items() if problem and name in present}
        report.stopped.extend(name for name in names if name not in late)
        report.failed.update(late)
        return report

    async def _stop_component(self, component: str) -> Message:
        """Stop a component, and wait until it has ended; return what went wrong."""
        identity = f"{MONITOR_PREFIX}{component}"
        try:
            proxy = self._communicator.stringToProxy(identity)
            await operate(HfsmMonitorPrx.uncheckedCast(proxy), "stop", {})
        except (VisualHfsmError, ZenohIceError) as error:
            return reason(error)
        limit = self._limits.component_end
        deadline = asyncio.get_running_loop().time() + limit
        while identity in self._communicator.identities():
            if asyncio.get_running_loop().time() > deadline:
                return Message("it has not ended within {stop_limit:g} s", stop_limit=limit)
            await asyncio.sleep(_POLL_INTERVAL)
        return NO_MESSAGE
