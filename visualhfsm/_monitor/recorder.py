"""Record a followed component for viewing: the data of its monitor, its robot, and pictures.

It only listens, and writes the file here: nothing in the realm can start a recording, or name its file.
"""

from __future__ import annotations

import asyncio
import time
from pathlib import Path
from typing import Final

import msgspec

from hfsm_runtime.recording_file.messages import (
    Action,
    Description,
    Failing,
    Fault,
    Picture,
    RobotPose,
    Snapshot,
    World,
)
from hfsm_runtime.recording_file.writer import RecordingFailedError, RecordingWriter
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.follower import Follower, LiveStructure, News
from visualhfsm._monitor.realm.pictures import require_pillow
from visualhfsm._monitor.realm.robot import RobotMonitor
from visualhfsm._monitor.realm.run_log import LiveSnapshot

from .cameras import MOST_CAMERAS, take_picture

_LONGEST_RECORDING: Final = 3600.0
"""Seconds after which a recording ends by itself."""


class Recorder:
    """Record until `close`. Create it on the event loop. Raises VisualHfsmError.

    `document` is the text of the running document, empty if unknown; `pictures` is the number of pictures per
    second and camera, 0 for none.
    """

    def __init__(
        self, follower: Follower, robot: RobotMonitor, path: Path, document: str, pictures: int
    ) -> None:
        newest, structure = follower.log.newest, follower.structure
        if newest is None or structure is None:
            raise VisualHfsmError.because(
                "{component} has sent nothing yet: try again", component=follower.component
            )
        if pictures:
            require_pillow()
        self.file: Final = path.name
        self.since: Final = time.time()
        """When the recording began, in s of wall time."""
        self._follower = follower
        self._communicator = follower.monitor.ice_getCommunicator()
        self._robot = robot
        self._run = newest.component.startedAt
        self._failing: tuple[Fault, ...] = ()
        with VisualHfsmError.in_place_of(RecordingFailedError):
            self._writer = RecordingWriter.watching(path, follower.component, document)
        self._writer.show("/world", World(list(robot.world.shapes)), self.since)
        if (described := follower.described) is not None:
            self._writer.show("/description", Description.of(described.body, described.looks), self.since)
        self.record(structure)
        self.record(newest)
        self._task = asyncio.create_task(self._take_pictures(pictures))

    @property
    def is_over(self) -> bool:
        """Whether the run has ended, or the recording is too long."""
        newest = self._follower.log.newest
        other = newest is not None and newest.component.startedAt != self._run
        gone = self._follower.identity not in self._communicator.identities()
        return other or gone or time.time() - self.since > _LONGEST_RECORDING

    def record(self, news: News) -> None:
        """Record news of the component; called from any thread."""
        show = self._writer.show
        match news:
            case LiveStructure(structure=structure):
                show("/actions", Action("structure", msgspec.to_builtins(structure)), time.time())
            case LiveSnapshot(at=at, component=component, robot=robot) if component.startedAt == self._run:
                objects = {name: [*place] for name, place in robot.objects.items()}
                torso = None if robot.torso is None else [*robot.torso]
                show("/robot", RobotPose(robot.joints, torso, objects, robot.says, robot.sound), at)
                if robot.failing != self._failing:
                    self._failing = robot.failing
                    show("/faults", Failing(robot.failing), at)
                show("/snapshots", Snapshot.of(component), at)

    async def close(self) -> None:
        """End the file."""
        self._task.cancel()
        await asyncio.wait({self._task})
        await asyncio.to_thread(self._writer.close)

    async def _take_pictures(self, rate: int) -> None:
        """Record pictures of all cameras, until cancelled; where they take long there are fewer."""
        while rate:
            began = time.monotonic()
            await asyncio.gather(*map(self._take_picture, self._robot.cameras()[:MOST_CAMERAS]))
            await asyncio.sleep(max(0.0, began + 1.0 / rate - time.monotonic()))

    async def _take_picture(self, name: str) -> None:
        picture = await take_picture(self._communicator, name)
        if picture is not None:
            at, jpeg = picture
            self._writer.show(f"/images/{name}", Picture.of(name, round(at * 1e9), jpeg), at)
